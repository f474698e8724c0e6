# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The PI controller of the paper's closed loop, C(s) = K (1 + 1/(T_i s)), free of ROS."""

from dataclasses import dataclass, field
import math

from ..model.errors import ModelError


@dataclass
class PiController:
    """A sampled PI controller with limits, anti-windup and bumpless transfer.

    Attributes
    ----------
    gain : float
        K [% of command per % of error]; negative for a reverse-acting process.
    integral_time : float
        T_i [s].
    sample_time : float
        T_s [s].
    low, high : float
        Limits of the command [% of span].
    integral : float
        The integral's share of the command [% of span].

    Notes
    -----
    ``e = r - x(k-1); I += K T_s/T_i e; u = K e + I``, clipped. While u is clipped, the integral
    moves only away from the limit. The paper (Sect. 3.4.4) prints C(s) and T_s = 0.02 s; the form
    of the difference equation, the limits and the anti-windup are assumptions.
    """

    gain: float = 0.2083
    integral_time: float = 15.0
    sample_time: float = 0.02
    low: float = 0.0
    high: float = 100.0
    integral: float = field(default=0.0)

    def __post_init__(self) -> None:
        """Refuse settings that make no controller."""
        if not (math.isfinite(self.gain) and self.integral_time > 0.0 and self.sample_time > 0.0):
            raise ModelError(
                f'gain = {self.gain}, integral_time = {self.integral_time} s, sample_time = '
                f'{self.sample_time} s: expected a finite gain and times above 0'
            )
        if not self.low < self.high:
            raise ModelError(f'low = {self.low:g} % must lie below high = {self.high:g} %')

    def step(self, setpoint: float, measurement: float) -> float:
        """Return the command [% of span] for the sample; all arguments in % of span."""
        error = setpoint - measurement
        increment = self.gain * self.sample_time / self.integral_time * error
        wanted = self.gain * error + self.integral + increment
        command = self._clipped(wanted)
        if wanted == command or (wanted - command) * increment < 0.0:
            self.integral += increment
        return command

    def track(self, command: float, setpoint: float, measurement: float) -> None:
        """Set the integral so that the next `step` goes on from `command` without a bump.

        Call it while somebody else, e.g. a person, sets the command.
        """
        error = setpoint - measurement
        share = self.gain * (1.0 + self.sample_time / self.integral_time)
        self.integral = self._clipped(command) - share * error

    def reset(self) -> None:
        """Forget the past."""
        self.integral = 0.0

    def _clipped(self, command: float) -> float:
        return min(max(command, self.low), self.high)
