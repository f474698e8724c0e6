# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A record of commands in, pressures and position out; and the same valve sample by sample."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
import math
import threading
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from .composition import memory_of
from .errors import ModelError
from .kernels import Make, make
from .parameters import SAMPLE_TIME
from .pipeline import Array
from .rivals import RIVALS
from .spec import BASE_MODEL, ValveSpec
from .state import BASE_STEP, State

NO_EFFECTS: tuple[()] = ()


@dataclass(frozen=True)
class InitialState:
    """A stem at rest: inlet pressure, chamber pressure and position [% of span].

    The default is a vented, closed valve.
    """

    p1: float = 0.0
    p2: float = 0.0
    x: float = 0.0

    def array(self, spec: ValveSpec) -> Array:
        """Return the state of a valve as the compiled code receives it."""
        if not np.isfinite([self.p1, self.p2, self.x]).all():
            raise ModelError(f'initial state {self}: expected finite numbers in % of span')
        if spec.model != BASE_MODEL:
            return np.asarray(RIVALS[spec.model].start(self.p1, self.p2, self.x, spec.theta))
        return np.array(
            State(self.p1, self.p2, self.x, 0.0, 0.0, 0.0, play=self.p1, command=self.p1, time=0.0)
        )


class Drive(NamedTuple):
    """What a valve's functions receive beside the command and the state."""

    theta: Any
    finest: float
    effects: Any
    memory: Any


def machine(spec: ValveSpec) -> Make:
    """Return the compiled functions for the valve's model."""
    if spec.model != BASE_MODEL:
        return RIVALS[spec.model].make()
    return make(effects=bool(spec.active))


def drive(spec: ValveSpec) -> Drive:
    """Return what the functions of `machine(spec)` need, with the effects' memory empty."""
    if not spec.active:
        return Drive(spec.theta, BASE_STEP, NO_EFFECTS, NO_EFFECTS)
    effects, memory, finest = spec.composition
    return Drive(spec.theta, finest, effects, memory)


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
        Values by name (``{'f_s': 4.0, 'effects': ['air_leak'], 'air_leak.leak_rate': 0.01}``,
        ``{'model': 'kano'}``); the rest keeps its defaults, the paper's values of eq. (12).
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
    state = (initial or InitialState()).array(spec)
    machine(spec).run(command, dt, state, *drive(spec), outputs)
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
        self._initial = initial or InitialState()
        self._spec = spec or ValveSpec()
        self._drive: Drive
        self._background = background
        self._make: Make | None = None
        self._compiled: Callable[..., float] | None = None
        self._state: Any = None
        self._first = True
        self._prepare(machine(self._spec))
        self.reset()

    @property
    def spec(self) -> ValveSpec:
        """Parameters in force; assigning takes effect with the next sample.

        Another model, or effects where there were none, start the valve anew from where it is.
        Effects that go on acting keep their memory; one that newly acts has none.
        """
        return self._spec

    @spec.setter
    def spec(self, spec: ValveSpec) -> None:
        acted, self._spec = self._spec.active, spec
        make = machine(spec)
        if make is not self._make:
            self._prepare(make)
            return
        memory, self._drive = self._drive.memory, drive(spec)
        for name in set(acted) & set(spec.active):
            self._drive.memory[memory_of(name)] = memory[memory_of(name)]

    def reset(self, initial: InitialState | None = None) -> None:
        """Put the valve at rest in `initial` (its start by default) before a first sample."""
        self._begin(initial or self._initial)

    def step(self, u: float, dt: float) -> tuple[float, float, float]:
        """Take one sample: command [% of span], time since the sample before [s].

        The first sample after a reset reports the starting state under the new command.

        Returns
        -------
        p1, p2, x : float
            After the sample [% of span].
        """
        if self._compiled is not None:
            self._step, self._compiled = self._compiled, None
            self._state = np.array(self._state)
        x = self._step(float(u), 0.0 if self._first else float(dt), self._state, *self._drive)
        self._first = False
        self._position = float(x)
        return float(self._state[0]), float(self._state[1]), self._position

    def impose(self, p1: float = math.nan, p2: float = math.nan) -> None:
        """Replace pressures [% of span] between two samples, e.g. by measured ones; NaN: none."""
        for index, value in enumerate((p1, p2)):
            if math.isfinite(value):
                self._state[index] = float(value)

    def _prepare(self, make: Make) -> None:
        """Start with the interpreted step and have the machine code made or fetched."""
        first = self._make is None
        self._make, self._step = make, make.interpreted
        if not first:
            p1, p2 = map(float, self._state[:2])
            self._begin(InitialState(p1, p2, self._position))
        if self._background:
            threading.Thread(
                target=self._compile, args=(make, self._spec), name='compile', daemon=True
            ).start()
        else:
            self._compile(make, self._spec)

    def _begin(self, initial: InitialState) -> None:
        """Stand at rest, nothing remembered."""
        state = initial.array(self._spec)
        self._drive = drive(self._spec)
        # plain numbers are what the interpreted step is fastest with
        interpreting = self._make is not None and self._step is self._make.interpreted
        self._state = state.tolist() if interpreting else state
        self._position = initial.x
        self._first = True

    def _compile(self, make: Make, spec: ValveSpec) -> None:
        """Make or fetch the machine code with a step that counts for nothing."""
        make.step(0.0, 0.0, InitialState().array(spec), *drive(spec))
        if make is self._make:
            self._compiled = make.step
