# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The declarations as ROS parameters: declared, checked, applied in that order."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
import difflib
from typing import Any

from rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor, SetParametersResult
from rclpy.node import Node
from rclpy.parameter import Parameter as RosParameter

from ..model.declarations import Option, Parameter
from ..model.errors import ModelError
from ..model.parameters import BASE, BRANCH, SAMPLE_TIME
from ..model.spec import ValveSpec
from . import watchdog
from .pacing import PACING, SPEED_FACTOR


@dataclass(frozen=True)
class Switch:
    """A parameter that is true or false."""

    name: str
    default: bool
    description: str

    def checked(self, value: object) -> bool:
        """Return `value`, or raise a ModelError if it is neither."""
        if not isinstance(value, bool):
            raise ModelError(f'{self.name} = {value!r}: expected true or false')
        return value


def _per_cent(name: str, symbol: str, description: str) -> Parameter:
    return Parameter(name, symbol, '%', 0.0, 0.0, 100.0, 'linear', description)


INITIAL_COMMAND = _per_cent(
    'initial_command', 'u(0)', 'Command that holds until the first one arrives, and after a reset'
)
INITIAL_STATE = (
    _per_cent('initial_p1', 'p1(0)', 'Inlet pressure at the start and after a reset'),
    _per_cent('initial_p2', 'p2(0)', 'Chamber pressure at the start and after a reset'),
    _per_cent('initial_x', 'x(0)', 'Stem position at the start and after a reset'),
)
PUBLISH_SAMPLE = Switch(
    'publish_sample', False, 'Publish each sample as one message t,u,p1,p2,x on ~/sample too'
)
DIAGNOSTICS_PERIOD = Parameter(
    'diagnostics_period',
    'T_d',
    's',
    1.0,
    0.0,
    3600.0,
    'linear',
    'Wall time between two reports on /diagnostics; 0: none',
)
FIXED = (SAMPLE_TIME, PACING, SPEED_FACTOR, PUBLISH_SAMPLE, DIAGNOSTICS_PERIOD)
"""Parameters of the plant node that need a restart."""
LIVE = (INITIAL_COMMAND, *INITIAL_STATE, *watchdog.LIVE)
"""Parameters of the plant node that may change while it runs."""
OF_ROS = ('use_sim_time', 'start_type_description_service', 'qos_overrides')

Declaration = Parameter | Option | Switch


def descriptor(declared: Declaration, fixed: bool = False) -> ParameterDescriptor:
    """Return what `ros2 param describe` shows; an integer is taken for a float."""
    if isinstance(declared, Parameter):
        limits = FloatingPointRange(from_value=declared.lower, to_value=declared.upper, step=0.0)
        words = f'{declared.description} [{declared.unit}]'
        return ParameterDescriptor(
            description=words, read_only=fixed, dynamic_typing=True, floating_point_range=[limits]
        )
    words = declared.description
    if isinstance(declared, Option):
        words += f' (one of {", ".join(declared.choices)})'
    return ParameterDescriptor(description=words, read_only=fixed, dynamic_typing=True)


def declare(node: Node, declared: Declaration, fixed: bool = False) -> Any:
    """Declare one parameter and return its checked value."""
    given = node.declare_parameter(declared.name, declared.default, descriptor(declared, fixed))
    return declared.checked(given.value)


class ValveParameters:
    """The ROS parameters of one valve: a change is checked first and applied only then.

    Attributes
    ----------
    spec : ValveSpec
        The valve in force.
    settings : dict
        Values of `FIXED` and `LIVE` in force, by name.
    """

    def __init__(self, node: Node, apply: Callable[[ValveSpec], None]) -> None:
        """Declare them all.

        Parameters
        ----------
        node : Node
            Node that carries them.
        apply : callable
            Receives the new valve after each accepted change.

        Raises
        ------
        ModelError
            If a given value is refused, with what to do about it.
        """
        self._apply = apply
        refuse_unknown(node, [declared.name for declared in (*BASE, BRANCH, *FIXED, *LIVE)])
        valve = {declared.name: declare(node, declared) for declared in (*BASE, BRANCH)}
        self._names = frozenset(valve)
        self.spec = ValveSpec().changed(valve)
        self.settings = {declared.name: declare(node, declared, fixed=True) for declared in FIXED}
        self._live = {declared.name: declared for declared in LIVE}
        self.settings.update((name, declare(node, live)) for name, live in self._live.items())
        node.add_on_set_parameters_callback(self._check)
        node.add_post_set_parameters_callback(self._accept)

    def _check(self, parameters: Sequence[RosParameter]) -> SetParametersResult:
        """Say whether all of a change together makes a valve; change nothing."""
        try:
            self._changed(parameters)
        except ModelError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _accept(self, parameters: Sequence[RosParameter]) -> None:
        """Hand an accepted change on."""
        spec, settings = self._changed(parameters)
        self.settings.update(settings)
        if spec != self.spec:
            self.spec = spec
            self._apply(spec)

    def _changed(self, parameters: Sequence[RosParameter]) -> tuple[ValveSpec, dict[str, Any]]:
        """Return the valve and the settings that a change leads to."""
        given = {parameter.name: parameter.value for parameter in parameters}
        if 'use_sim_time' in given:
            raise ModelError('use_sim_time: the clock cannot be changed while the valve runs')
        valve = {name: value for name, value in given.items() if name in self._names}
        settings = {
            name: self._live[name].checked(value)
            for name, value in given.items()
            if name in self._live
        }
        return self.spec.changed(valve), settings


def refuse_unknown(node: Node, known: Sequence[str]) -> None:
    """Refuse given parameters that nobody declares: a misspelt one would be lost silently."""
    for name in node._parameter_overrides:  # rclpy has no public way to list them
        if name not in known and not name.startswith(OF_ROS):
            close = difflib.get_close_matches(name, known, 1)
            hint = f'did you mean {close[0]}?' if close else f'known are {", ".join(known)}'
            raise ModelError(f'unknown parameter {name!r}: {hint}')
