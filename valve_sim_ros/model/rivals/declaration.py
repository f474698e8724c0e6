# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What it takes to declare a rival of the base valve: one constant MODEL per file."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
import math
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from ..declarations import Parameter
from ..errors import ModelError
from ..kernels import interpreted, Make
from ..parameters import SAMPLE_TIME
from ..pipeline import Array
from .run import made

Channel = Literal['u', 'p2']


@dataclass(frozen=True)
class Rival:
    """One model of the literature behind the interface of the base valve.

    Attributes
    ----------
    name : str
        Name in files, ROS parameters and results.
    title : str
        Authors and year.
    parameters : tuple of Parameter
        Declared in the order in which the kernels receive their values as theta.
    advance : kernel
        ``advance(u, dt, state, theta) -> x``, signals in % of span, dt [s] since the sample
        before, 0 at the first; state, updated in place, begins with p1, p2, x.
    driven : kernel
        The same, with the measured p2 [% of span] in the place of u.
    begin : kernel
        ``begin(p1, p2, x, theta) -> state``: a valve at rest.
    channel : {'u', 'p2'}
        The signal that the paper drives it with.
    from_friction : callable
        Values of its parameters for levels of static and dynamic friction f_s, f_d [%].
    held : tuple of str
        Parameters that no recording at these rates identifies, or switches: a fit keeps them.
    confirmed, reconstructed : str
        What a source states or code confirms; what had to be reconstructed.
    work : float
        Time that a sample takes, relative to He's model: a search tries fewer candidates.
    remark : str
        What a user has to know, e.g. an input that the model cannot answer.
    presets : mapping of str to mapping
        Further sets of values by name.
    """

    name: str
    title: str
    parameters: tuple[Parameter, ...]
    advance: Any
    driven: Any
    begin: Any
    channel: Channel
    from_friction: Callable[[Any, Any], dict[str, Any]]
    held: tuple[str, ...] = ()
    confirmed: str = ''
    reconstructed: str = ''
    work: float = 1.0
    remark: str = ''
    presets: Mapping[str, Mapping[str, float]] = field(default_factory=dict)

    @property
    def defaults(self) -> dict[str, float]:
        """Default value of each parameter."""
        return {parameter.name: parameter.default for parameter in self.parameters}

    @property
    def data_driven(self) -> bool:
        """Whether it maps commands to positions sample by sample, without pressures or time."""
        return self.driven is self.advance

    @property
    def free(self) -> tuple[str, ...]:
        """The parameters that a fit chooses."""
        return tuple(p.name for p in self.parameters if p.name not in self.held)

    def theta(self, values: Mapping[str, float]) -> Array:
        """Return `values` as the kernels receive them, shape (len(parameters),)."""
        return np.array([values[parameter.name] for parameter in self.parameters])

    def start(self, p1: float, p2: float, x: float, theta: Array) -> Array:
        """Return the state of a valve at rest, without waiting for machine code."""
        return np.asarray(interpreted(self.begin, {})(p1, p2, x, theta))

    def make(self, channel: Channel = 'u') -> Make:
        """Return its compiled functions: driven by the command, or by a measured p2."""
        return made(self.name, self.driven if channel == 'p2' else self.advance)

    def drive(
        self,
        signal: npt.ArrayLike,
        values: Mapping[str, float] | None = None,
        *,
        channel: Channel = 'p2',
        sample_time: float = SAMPLE_TIME.default,
        x: float = 0.0,
    ) -> Array:
        """Return the stem position for a recorded signal, as the paper's Fig. 7 does with p2.

        Parameters
        ----------
        signal : array_like, shape (n,)
            p2, held over the sample that it ends (or u) [% of span].
        values : mapping of str to float, optional
            Parameters; the rest keeps its default.
        channel : {'p2', 'u'}
            What `signal` is: from u the physical models take their first two stages in front.
        sample_time : float
            [s].
        x : float
            Position at the start [% of span]; both pressures start at the first signal.

        Returns
        -------
        ndarray, shape (n,)
            x [% of span].
        """
        theta = self.theta({**self.defaults, **(values or {})})
        inputs = np.ascontiguousarray(signal, dtype=np.float64)
        outputs = np.empty((3, inputs.size))
        state = self.start(float(inputs[0]), float(inputs[0]), x, theta)
        dt = np.array([sample_time])
        self.make(channel).run(inputs, dt, state, theta, math.inf, (), (), outputs)
        return outputs[2]

    def preset(self, name: str) -> dict[str, float]:
        """Return all values of a preset.

        Raises
        ------
        ModelError
            If there is none of that name.
        """
        if name not in self.presets:
            known = ', '.join(self.presets) or 'none'
            raise ModelError(f'{self.name} has no preset {name!r}: expected one of {known}')
        return {**self.defaults, **self.presets[name]}
