# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Node `valve_plant`: a simulated valve behind the topics u, p1, p2 and x."""

from array import array
from collections.abc import Sequence
import math
import sys
import time
from typing import Any

from rclpy.node import Node
from std_msgs.msg import Float64, Float64MultiArray
from std_srvs.srv import SetBool, Trigger

from ..model.simulation import InitialState, Valve
from ..model.spec import ValveSpec
from .health import Health, Report
from .messages import INPUT, labelled, LOSSLESS, LOSSLESS_LATCHED, OUTPUT, publisher, subscription
from .pacing import Lockstep, make_pacing
from .parameters import ValveParameters
from .spinning import ends_quietly, run
from .start import valve_plant
from .watchdog import Watchdog

SAMPLE = 't,u,p1,p2,x'
REPORT_PERIOD = 10.0
"""Seconds between two reports of the same trouble."""


class ValvePlant(Node):
    """Subscribes u, steps the valve when the pacing says so, publishes p1, p2 and x.

    All topics are std_msgs/Float64 in per cent of span. A sample always advances the valve by
    the nominal sample time; periods that the machine missed are counted and reported, they do not
    change the physics. When samples are taken is the business of `pacing` alone.

    Attributes
    ----------
    command : float
        Last good command [% of span].
    refused_commands, clamped_commands, samples : int
        Counts since the start; `samples` since the last reset.
    outputs : dict of str to Publisher
        By topic: p1, p2, x, and sample if it is published.
    """

    def __init__(self, node_name: str = 'valve_plant', **options: Any) -> None:
        """Declare the parameters and connect; `options` go to rclpy's Node."""
        super().__init__(node_name, **options)
        self._valve_parameters = ValveParameters(self, self._apply)
        self._settings = self._valve_parameters.values
        self.sample_time = self._settings['sample_time']
        self.refused_commands = self.clamped_commands = self._logged_misses = 0
        self._reported = (0, 0, 0)
        self._quiet_until: dict[str, float] = {}
        # machine code and interpreted code may differ in the last bit: lockstep never mixes them
        lockstep = self._settings['pacing'] == 'lockstep'
        self._valve = Valve(self._valve_parameters.spec, background=not lockstep)
        self.watchdog = Watchdog(self._settings, self._announce)
        self.pacing = make_pacing(
            self,
            self._settings['pacing'],
            self._settings['speed_factor'],
            self.sample_time,
            self._take,
        )
        self._connect()
        self.reset()
        self.pacing.start(self._clock_jumped)
        self._health = Health(self, self._settings['diagnostics_period'], self._report)

    def _connect(self) -> None:
        """Make the topics and services."""
        lockstep = isinstance(self.pacing, Lockstep)
        out, into = (LOSSLESS_LATCHED, LOSSLESS) if lockstep else (OUTPUT, INPUT)
        self._message = Float64()
        self._sample_message = labelled(SAMPLE, [0.0] * 5)
        kinds = {'p1': Float64, 'p2': Float64, 'x': Float64}
        if self._settings['publish_sample']:
            kinds['~/sample'] = Float64MultiArray
        self.outputs = {
            name.removeprefix('~/'): publisher(self, kind, name, out)
            for name, kind in kinds.items()
        }
        self._signals = [self.outputs[name] for name in ('p1', 'p2', 'x')]
        self._sample = self.outputs.get('sample')
        subscription(self, Float64, 'u', self._receive, into)
        self.create_service(Trigger, '~/reset', self._serve_reset)
        self.create_service(SetBool, '~/pause', self._serve_pause)
        self.create_service(Trigger, '~/step', self._serve_step)

    @property
    def spec(self) -> ValveSpec:
        """The valve in force."""
        return self._valve.spec

    @property
    def missed_periods(self) -> int:
        """Periods without a sample because the machine was late."""
        return self.pacing.missed_periods

    def step(self) -> tuple[float, float, float]:
        """Take one sample and publish it; return p1, p2, x [% of span]."""
        command = self.watchdog.command(self.command, self.pacing.now)
        sample = self._valve.step(command, self.sample_time)
        message = self._message
        if self._sample:
            seconds = self.samples * self.sample_time
            self._sample_message.data = array('d', (seconds, command, *sample))
        self.samples += 1
        for signal, value in zip(self._signals, sample, strict=True):
            message.data = value
            signal.publish(message)
        if self._sample:
            self._sample.publish(self._sample_message)
        return sample

    def reset(self) -> None:
        """Put valve and command back to the start that the parameters name."""
        settings = self._settings
        self._valve.reset(
            InitialState(*(settings[name] for name in ('initial_p1', 'initial_p2', 'initial_x')))
        )
        self.command = settings['initial_command']
        self.samples = 0
        self.watchdog.feed(self.pacing.now)

    def _clock_jumped(self, back: bool) -> None:
        """Start anew, or let the command's age begin again behind a gap."""
        if back:
            self.reset()
        self.watchdog.feed(self.pacing.now)

    def _apply(self, spec: ValveSpec) -> None:
        # callbacks and ticks take turns on one thread, so this falls between two samples
        self._valve.spec = spec

    @ends_quietly
    def _receive(self, message: Float64) -> None:
        """Take over a command, unless it is no number; clamp it to the span."""
        value = message.data
        if not math.isfinite(value):
            self.refused_commands += 1
            self._warn(
                'refused',
                f'command {value} refused ({self.refused_commands} so far): expected a '
                f'number from 0 to 100 %; the last good one, {self.command:g} %, holds',
            )
        else:
            self.command = min(max(value, 0.0), 100.0)
            self.watchdog.feed(self.pacing.now)
            if self.command != value:
                self.clamped_commands += 1
                self._warn(
                    'clamped',
                    f'command {value:g} % clamped to {self.command:g} % '
                    f'({self.clamped_commands} so far): the span is 0 to 100 %',
                )
        self.pacing.commanded()

    @ends_quietly
    def _take(self) -> None:
        """Step on behalf of the pacing."""
        self.step()
        if self.pacing.missed_periods != self._logged_misses:
            self._logged_misses = self.pacing.missed_periods
            self._warn(
                'missed',
                f'{self._logged_misses} periods of {self.sample_time:g} s missed so far: this '
                'machine is too slow or too busy; the valve itself is not affected',
            )

    def _warn(self, trouble: str, text: str) -> None:
        """Log a warning, but the same trouble only every so often."""
        now = time.monotonic()  # rclpy's own throttle costs half a millisecond a call
        if now >= self._quiet_until.get(trouble, 0.0) and self.context.ok():
            self._quiet_until[trouble] = now + REPORT_PERIOD
            self.get_logger().warning(text)

    def _announce(self, stale: bool, text: str) -> None:
        """Log what the watchdog does."""
        log = self.get_logger()
        log.warning(text) if stale else log.info(text)

    def _report(self) -> Report:
        """Return what /diagnostics shall say."""
        age = self.watchdog.age(self.pacing.now)
        counts = self.missed_periods, self.refused_commands, self.clamped_commands
        new = [count - before for count, before in zip(counts, self._reported, strict=True)]
        self._reported = counts
        names = 'periods missed', 'commands refused', 'commands clamped'
        troubles = [f'{n} {name}' for n, name in zip(new, names, strict=True) if n]
        if self.watchdog.stale:
            troubles.append(f'no command for {age:.3g} s: {self._settings["fail_action"]}')
        return troubles, {
            'model': self.spec.model,
            'effects': ', '.join(self.spec.effects) or 'none',
            'pacing': type(self.pacing).__name__,
            'paused': self.pacing.paused,
            'samples': self.samples,
            'missed periods': self.missed_periods,
            'late samples': self.pacing.late_samples,
            'command [%]': self.command,
            'command age [s]': f'{age:.3f}',
            'refused commands': self.refused_commands,
            'clamped commands': self.clamped_commands,
        }

    def _serve_reset(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """Answer `~/reset`."""
        self.reset()
        response.success, response.message = True, 'the valve is at its start'
        return response

    def _serve_pause(self, request: SetBool.Request, response: SetBool.Response) -> Any:
        """Answer `~/pause`: true stands still, false goes on."""
        self.pacing.pause(request.data)
        self.watchdog.feed(self.pacing.now)
        response.success, response.message = True, 'paused' if request.data else 'running'
        return response

    def _serve_step(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """Answer `~/step`: one sample with the command that holds."""
        response.success = self.pacing.paused or isinstance(self.pacing, Lockstep)
        if response.success:
            self.pacing.step()
            response.message = f'{self.samples} samples since the start'
        else:
            response.message = 'time runs by itself: pause it first, with ~/pause'
        return response


def main(args: Sequence[str] | None = None) -> None:
    """Run the node until SIGINT or SIGTERM; exit code 1 if a parameter is refused."""
    sys.exit(run(ValvePlant, args))


if __name__ == '__main__':
    valve_plant()
