# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A record of commands in, pressures and position out; and the same valve sample by sample."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
import threading
from typing import Any

import numpy as np
import numpy.typing as npt

from . import kernels, pipeline
from .errors import ModelError
from .parameters import SAMPLE_TIME
from .pipeline import Array
from .spec import ValveSpec

NOTHING = np.empty(0)


@dataclass(frozen=True)
class InitialState:
    """A stem at rest: inlet pressure, chamber pressure and position [% of span].

    The default is a vented, closed valve.
    """

    p1: float = 0.0
    p2: float = 0.0
    x: float = 0.0

    def array(self) -> Array:
        """Return the state as the compiled code receives it."""
        state = np.zeros(pipeline.STATE_SIZE)
        state[: pipeline.V] = self.p1, self.p2, self.x
        if not np.isfinite(state).all():
            raise ModelError(f'initial state {self}: expected finite numbers in % of span')
        return state


@dataclass(frozen=True)
class Simulation:
    """What a simulated valve did; all arrays have shape (n,).

    Attributes
    ----------
    t : ndarray
        Time [s].
    u, p1, p2, x : ndarray
        Command, inlet pressure, chamber pressure, stem position [% of span].
    spec : ValveSpec
        The valve that did it.
    """

    t: Array
    u: Array
    p1: Array
    p2: Array
    x: Array
    spec: ValveSpec


def simulate(
    u: npt.ArrayLike,
    sample_time: float = SAMPLE_TIME.default,
    parameters: Mapping[str, Any] | ValveSpec | None = None,
    *,
    time: npt.ArrayLike | None = None,
    initial: InitialState | None = None,
) -> Simulation:
    """Simulate the valve over a record of commands.

    Parameters
    ----------
    u : array_like, shape (n,)
        Commands [% of span]; u[k] acts from time t[k] on.
    sample_time : float
        Sampling period [s], used unless `time` is given.
    parameters : mapping or ValveSpec, optional
        Values by name (``{'f_s': 4.0, 'branch': 'printed'}``); the rest keeps the paper's
        values, eq. (12).
    time : array_like, shape (n,), optional
        Strictly increasing times of the samples [s], for records without a fixed period.
    initial : InitialState, optional
        State before the first sample; a vented, closed valve by default.

    Returns
    -------
    Simulation
        With arrays t, u, p1, p2, x of shape (n,).

    Raises
    ------
    ModelError
        If a parameter is refused, or u or time are not finite, not one-dimensional or do not
        match.

    Notes
    -----
    Stages are eq. (1), (5) and (10) of *A semi-physical model for pneumatic control valves*
    (2016), the stem solved exactly between events.
    """
    spec = (
        parameters if isinstance(parameters, ValveSpec) else ValveSpec().changed(parameters or {})
    )
    command = _vector(u, 'u')
    if time is None:
        dt = np.array([SAMPLE_TIME.checked(sample_time)])
        t = dt[0] * np.arange(command.size)
    else:
        t = _vector(time, 'time')
        dt = np.diff(t, prepend=t[:1])
        if t.size != command.size or (dt[1:] <= 0).any():
            raise ModelError(
                f'time has {t.size} values for {command.size} commands; expected as many, '
                'strictly increasing'
            )
    outputs = np.empty((3, command.size))
    state = (initial or InitialState()).array()
    kernels.run(command, dt, state, spec.theta, NOTHING, NOTHING, outputs)
    p1, p2, x = outputs
    return Simulation(t, command, p1, p2, x, spec)


def _vector(values: npt.ArrayLike, name: str) -> Array:
    """Return `values` as a contiguous float vector, or say what is wrong with it."""
    try:
        vector = np.ascontiguousarray(values, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise ModelError(f'{name}: expected a sequence of numbers ({error})') from None
    if vector.ndim != 1:
        raise ModelError(f'{name} has {vector.ndim} dimensions: expected a plain sequence')
    bad = np.flatnonzero(~np.isfinite(vector))
    if bad.size:
        raise ModelError(
            f'{name} has {bad.size} values that are not finite, the first at index {bad[0]}: '
            'remove or hold them before simulating'
        )
    return vector


class Valve:
    """One valve, sample by sample: the same step function as `simulate`.

    Starts at once with the interpreted step; a background thread fetches or makes the machine
    code, which then takes over between two samples. Not thread-safe: one caller steps it.
    """

    def __init__(
        self,
        spec: ValveSpec | None = None,
        initial: InitialState | None = None,
        *,
        background: bool = True,
    ) -> None:
        """Prepare the valve.

        Parameters
        ----------
        spec : ValveSpec, optional
            Its parameters; the paper's by default.
        initial : InitialState, optional
            State before the first sample.
        background : bool
            Compile in a thread; if False, compile before returning.
        """
        self._step: Callable[..., float] = kernels.interpreted(pipeline.advance)
        self._compiled: Callable[..., float] | None = None
        self._transition: Any = [float('nan')] * pipeline.TRANSITION_SIZE
        self.reset(initial)
        self.spec = spec or ValveSpec()
        if background:
            threading.Thread(target=self._compile, name='compile', daemon=True).start()
        else:
            self._compile()

    @property
    def spec(self) -> ValveSpec:
        """Parameters in force; assigning takes effect with the next sample."""
        return self._spec

    @spec.setter
    def spec(self, spec: ValveSpec) -> None:
        self._spec = spec
        self._theta: Any = self._like_state(spec.theta)
        self._transition[pipeline.DT] = float('nan')

    def reset(self, initial: InitialState | None = None) -> None:
        """Put the valve at rest in `initial`; the next sample is its first."""
        state = (initial or InitialState()).array()
        self._state: Any = state if self._compiled else state.tolist()
        self._first = True

    def step(self, u: float, dt: float) -> tuple[float, float, float]:
        """Take one sample: command [% of span], time since the sample before [s].

        The first sample after a reset reports the starting state under the new command.

        Returns
        -------
        p1, p2, x : float
            After the sample [% of span].
        """
        if self._compiled and isinstance(self._state, list):
            self._adopt_machine_code()
        x = self._step(
            float(u),
            0.0 if self._first else float(dt),
            self._state,
            self._theta,
            self._transition,
            NOTHING,
            NOTHING,
        )
        self._first = False
        return float(self._state[pipeline.P1]), float(self._state[pipeline.P2]), float(x)

    def _compile(self) -> None:
        """Make or fetch the machine code with a step that counts for nothing."""
        kernels.advance(
            0.0,
            0.0,
            InitialState().array(),
            ValveSpec().theta,
            np.full(pipeline.TRANSITION_SIZE, np.nan),
            NOTHING,
            NOTHING,
        )
        self._compiled = kernels.advance

    def _like_state(self, values: Array) -> Any:
        """Return numbers in the container the current make of the step is fastest with."""
        return values.tolist() if isinstance(self._state, list) else values

    def _adopt_machine_code(self) -> None:
        """Hand state and parameters over to the compiled step."""
        assert self._compiled is not None
        self._step = self._compiled
        self._state = np.array(self._state)
        self._transition = np.array(self._transition)
        self._theta = np.array(self._theta)
