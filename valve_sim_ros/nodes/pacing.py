# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Who owns time: the one object that decides when a sample is taken (see doc/time.md)."""

from collections.abc import Callable
import time

from rclpy.clock import Clock, ClockType, JumpThreshold, TimeJump
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.time import Time
from rosgraph_msgs.msg import Clock as ClockMessage

from ..model.declarations import Option, Parameter
from ..model.errors import ModelError

PACING = Option(
    'pacing',
    'auto',
    ('auto', 'wall', 'sim_time', 'own_clock', 'lockstep'),
    'What drives the samples: the wall clock, /clock, a /clock of its own, or each command; '
    'auto is sim_time if use_sim_time is set, else wall',
)
SPEED_FACTOR = Parameter(
    'speed_factor',
    'k',
    '1',
    1.0,
    1e-3,
    1e4,
    'log',
    'Valve seconds per wall second with pacing own_clock',
)

SECOND = 1_000_000_000
LARGEST_GAP = 1 * SECOND
"""Forward jumps of /clock beyond this, and beyond five periods, are not integrated [ns]."""
CATCH_UP, AT_ONCE = 0.2, 0.02
"""Lateness that is still caught up, two periods at least; beyond it periods are given up. So much
of it is made up for before anybody else gets a turn [wall s]."""
SHORTEST_TIMER = 1e-3
"""Shortest period of the timer of a clock that runs fast [wall s]."""
CLOCK_START = 1.0
"""First time on the /clock of own_clock [s]; 0 would mean 'no time yet'."""


class Pacing:
    """Takes samples when they are due. This one takes them only when told: see the others.

    Attributes
    ----------
    paused : bool
        Whether time stands still for the valve; `resume` it to go on without integrating the
        pause.
    missed_periods : int
        Periods without a sample because the machine was too late.
    late_samples : int
        Samples taken when their period was over.
    """

    def __init__(self, node: Node, period: float, take: Callable[[], None]) -> None:
        """Keep the node, the sample time [s] and what takes one sample."""
        self._node, self._period, self._take = node, period, take
        self.paused = False
        self.missed_periods = self.late_samples = 0

    @property
    def now(self) -> float:
        """Time in which a command grows old [s]."""
        return time.monotonic()

    def start(self, jumped: Callable[[bool], None]) -> None:
        """Begin; `jumped` hears that the clock leapt, and whether backward."""

    def commanded(self) -> None:
        """Hear that a command came in."""

    def pause(self, paused: bool) -> None:
        """Stand still, or go on from here."""
        if self.paused and not paused:
            self._skip_pause()
        self.paused = paused

    def step(self) -> None:
        """Take one sample by hand."""
        self._take()

    def _skip_pause(self) -> None:
        """Let the next period begin now."""


class Lockstep(Pacing):
    """One command in, exactly one sample out; no timer, no clock. Time is what was sampled."""

    def __init__(self, node: Node, period: float, take: Callable[[], None]) -> None:
        """Begin at sample 0."""
        super().__init__(node, period, take)
        self._samples = 0

    @property
    def now(self) -> float:
        """Samples taken times the sample time [s]."""
        return self._samples * self._period

    def commanded(self) -> None:
        """Answer a command with a sample."""
        if not self.paused:
            self.step()

    def step(self) -> None:
        """Take one sample."""
        self._take()
        self._samples += 1


class Wall(Pacing):
    """A steady timer. Short lateness is caught up, so that the valve's time is the wall's."""

    speed_factor = 1.0

    def start(self, jumped: Callable[[bool], None]) -> None:
        """Make the timer."""
        self._wall_period = self._period / self.speed_factor
        # the samples of a faster clock come in bunches: more timers than that only cost
        timer = max(self._wall_period, min(self._period, SHORTEST_TIMER))
        self._most_late = max(2, round(CATCH_UP / self._wall_period))
        self._most_at_once = max(2, round(AT_ONCE / self._wall_period))
        self._last: int | None = None
        self._origin = time.monotonic_ns()  # before the timer's, so that no tick comes early
        self._node.create_timer(timer, self._tick, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def _tick(self) -> None:
        """Take the samples that are due, a bunch at a time: commands must come in between."""
        if self.paused:
            return
        index = self._index()
        if self._last is None:  # time before the first tick was the making of other nodes
            self._last = index - 1
        lost = max(0, index - self._last - self._most_late)
        self.missed_periods += lost
        self._last += lost
        for _ in range(min(index - self._last, self._most_at_once)):
            self._last += 1
            self.late_samples += self._last < index
            self.step()

    def _skip_pause(self) -> None:
        self._last = self._index()

    def _index(self) -> int:
        """Return the number of the period that is running."""
        return int((time.monotonic_ns() - self._origin) / SECOND / self._wall_period)


class OwnClock(Wall):
    """Publishes /clock: `speed_factor` valve seconds per wall second, no more and no less."""

    def __init__(
        self, node: Node, period: float, take: Callable[[], None], speed_factor: float
    ) -> None:
        """Prepare the publisher; `speed_factor` is fixed for the life of the node."""
        super().__init__(node, period, take)
        self.speed_factor = speed_factor
        self._samples = 0
        self._clock = node.create_publisher(ClockMessage, '/clock', QoSProfile(depth=10))

    @property
    def now(self) -> float:
        """Time on /clock [s]."""
        return CLOCK_START + self._samples * self._period

    def step(self) -> None:
        """Publish the time, then the sample of that time."""
        stamp = Time(nanoseconds=round(self.now * SECOND)).to_msg()
        self._clock.publish(ClockMessage(clock=stamp))
        self._take()
        self._samples += 1


class SimTime(Pacing):
    """Follows /clock: every period that the clock passed gets its sample, none is lost.

    Backward jumps restart the valve. Large forward gaps are skipped, not integrated. Before the
    first /clock nothing happens.
    """

    def start(self, jumped: Callable[[bool], None]) -> None:
        """Ask the node's clock to report its moves."""
        self._jumped = jumped
        self._step_ns = round(self._period * SECOND)
        self._largest_gap = max(LARGEST_GAP, 5 * self._step_ns)
        self._seen = self._next = 0
        tick = Duration(nanoseconds=1)
        threshold = JumpThreshold(min_forward=tick, min_backward=Duration(nanoseconds=-1))
        self._handle = self._node.get_clock().create_jump_callback(
            threshold, post_callback=self._moved
        )

    @property
    def now(self) -> float:
        """Time on /clock [s]."""
        return self._node.get_clock().now().nanoseconds / SECOND

    def _moved(self, _: TimeJump) -> None:
        """Take the samples that are due at the clock's new time."""
        now = self._node.get_clock().now().nanoseconds
        before, self._seen = self._seen, now
        if not before:
            self._next = now
        elif now < before:
            self._say(f'/clock jumped back by {(before - now) / SECOND:g} s: the valve restarts')
            self._next = now
            self._jumped(True)
        elif now - before > self._largest_gap:
            self._say(
                f'/clock jumped ahead by {(now - before) / SECOND:g} s: the valve goes on from '
                'here as if that time had not been'
            )
            self._next = now
            self._jumped(False)
        if self.paused:
            return
        while self._next <= now:
            self._next += self._step_ns
            self._take()

    def _skip_pause(self) -> None:
        self._next = self._seen + self._step_ns

    def _say(self, text: str) -> None:
        self._node.get_logger().warning(text)


def make_pacing(
    node: Node, choice: str, speed_factor: float, period: float, take: Callable[[], None]
) -> Pacing:
    """Return the owner of time that the parameters ask for.

    Raises
    ------
    ModelError
        If the parameters contradict each other.
    """
    simulated = bool(node.get_parameter('use_sim_time').value)
    if choice == 'auto':
        choice = 'sim_time' if simulated else 'wall'
    if speed_factor != 1.0 and choice != 'own_clock':
        raise ModelError(
            f'speed_factor = {speed_factor:g} with pacing {choice}: only own_clock has a speed; '
            'set pacing to own_clock or leave speed_factor out'
        )
    if simulated != (choice == 'sim_time') and choice != 'lockstep':
        raise ModelError(
            f'pacing {choice} with use_sim_time {str(simulated).lower()}: two clocks; '
            'use_sim_time belongs to pacing sim_time and to no other'
        )
    if choice == 'own_clock':
        return OwnClock(node, period, take, speed_factor)
    return {'wall': Wall, 'sim_time': SimTime, 'lockstep': Lockstep}[choice](node, period, take)
