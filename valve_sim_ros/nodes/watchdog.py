# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the valve does when its command grows old."""

from collections.abc import Callable, Mapping
from typing import Any

from ..model.declarations import Option, Parameter

COMMAND_TIMEOUT = Parameter(
    'command_timeout',
    'T_w',
    's',
    0.0,
    0.0,
    3600.0,
    'linear',
    'Age of the command from which fail_action holds, in the time of the pacing; 0: never',
)
FAIL_ACTION = Option(
    'fail_action',
    'hold',
    ('hold', 'vent', 'value'),
    'When the command is too old: hold the last one, vent the actuator (see fail_position), or '
    'take fail_value',
)
FAIL_POSITION = Option(
    'fail_position',
    'closed',
    ('closed', 'open'),
    'Where the spring takes the vented valve: closed is a command of 0 %, open one of 100 %',
)
FAIL_VALUE = Parameter(
    'fail_value', 'u_f', '%', 0.0, 0.0, 100.0, 'linear', 'Command of fail_action value'
)
LIVE = (COMMAND_TIMEOUT, FAIL_ACTION, FAIL_POSITION, FAIL_VALUE)


class Watchdog:
    """Replaces a command that is too old, says so once, and recovers with the next command.

    Attributes
    ----------
    stale : bool
        Whether the command in force is too old.
    """

    def __init__(self, settings: Mapping[str, Any], announce: Callable[[bool, str], None]) -> None:
        """Prepare it; the settings are looked up at each sample, so they may change.

        Parameters
        ----------
        settings : mapping
            Values of `LIVE` by name.
        announce : callable
            Receives whether the command is stale now, and a sentence.
        """
        self._settings, self._announce = settings, announce
        self._fed = 0.0
        self.stale = False

    def feed(self, now: float) -> None:
        """Take note of a good command, or of a start, at time `now` [s]."""
        self._fed = now
        if self.stale:
            self.stale = False
            self._announce(False, 'commands are back; the valve follows them again')

    def age(self, now: float) -> float:
        """Return the age of the command [s]."""
        return now - self._fed

    def command(self, last: float, now: float) -> float:
        """Return the command in force [% of span]; `last` is the last good one."""
        limit = self._settings[COMMAND_TIMEOUT.name]
        # a hair of slack: times are sums of steps
        if not limit or self.age(now) <= limit * (1.0 + 1e-9):
            if self.stale:
                self.feed(self._fed)  # the limit was raised or removed
            return last
        command, words = self._failed(last)
        if not self.stale:
            self.stale = True
            self._announce(True, f'no command for {self.age(now):.3g} s: the valve {words}')
        return command

    def _failed(self, last: float) -> tuple[float, str]:
        """Return the command of the fail action, and what the valve does in words."""
        action = self._settings[FAIL_ACTION.name]
        if action == 'vent':
            position = self._settings[FAIL_POSITION.name]
            command = 100.0 if position == 'open' else 0.0
            return command, f'is vented, its spring takes it {position}'
        if action == 'value':
            command = self._settings[FAIL_VALUE.name]
            return command, f'takes fail_value, {command:g} %'
        return last, f'holds the last one, {last:g} %'
