# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The declarations as ROS parameters: declared, checked, applied in that order."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
import difflib
from typing import Any

from rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor, SetParametersResult
from rclpy.node import Node
from rclpy.parameter import Parameter as RosParameter

from ..model.declarations import Option, Parameter
from ..model.effects import CATALOGUE
from ..model.errors import ModelError
from ..model.parameter_file import NODE_ONLY
from ..model.parameters import BRANCH, SAMPLE_TIME
from ..model.spec import BASE_MODEL, EFFECTS, MODEL, ValveSpec
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


@dataclass(frozen=True)
class Text:
    """A parameter that is any text."""

    name: str
    description: str
    default: str = ''

    def checked(self, value: object) -> str:
        """Return `value`, or raise a ModelError if it is no text."""
        if not isinstance(value, str):
            raise ModelError(f'{self.name} = {value!r}: expected a text')
        return value


@dataclass(frozen=True)
class Names:
    """A parameter that is a list of names; ROS cannot type an empty list, so [''] is one too."""

    name: str
    description: str
    default: tuple[str, ...] = ('',)

    def checked(self, value: object) -> tuple[str, ...]:
        """Return the names in `value`, or raise a ModelError if it is no list of them."""
        names = () if value is None else value
        if not isinstance(names, Sequence) or isinstance(names, str):
            raise ModelError(f'{self.name} = {value!r}: expected a list, as in [one, another]')
        if not all(isinstance(name, str) for name in names):
            raise ModelError(f'{self.name} = {list(names)}: expected names, as in [one, another]')
        return tuple(name for name in names if name)


def per_cent(name: str, symbol: str, description: str) -> Parameter:
    """Declare a signal's value, 0 to 100 % of span."""
    return Parameter(name, symbol, '%', 0.0, 0.0, 100.0, 'linear', description)


INITIAL_COMMAND = per_cent(
    'initial_command', 'u(0)', 'Command that holds until the first one arrives, and after a reset'
)
INITIAL_STATE = (
    per_cent('initial_p1', 'p1(0)', 'Inlet pressure at the start and after a reset'),
    per_cent('initial_p2', 'p2(0)', 'Chamber pressure at the start and after a reset'),
    per_cent('initial_x', 'x(0)', 'Stem position at the start and after a reset'),
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
EFFECT_NAMES = Names(EFFECTS, f'Effects added to model base, of {", ".join(CATALOGUE)}')
OF_ROS = ('use_sim_time', 'start_type_description_service', 'qos_overrides')

Declaration = Parameter | Option | Switch | Text | Names


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


class Settings:
    """Checked ROS parameters of a node: a change is checked first and applied only then.

    Attributes
    ----------
    values : dict
        Values in force, by name.
    """

    def __init__(
        self, node: Node, fixed: Sequence[Declaration] = (), live: Sequence[Declaration] = ()
    ) -> None:
        """Declare those that need a restart and those that may change while the node runs.

        Raises
        ------
        ModelError
            If a given value is refused, with what to do about it.
        """
        self.values = {declared.name: declare(node, declared, fixed=True) for declared in fixed}
        self._live = {declared.name: declared for declared in live}
        self.values.update((name, declare(node, one)) for name, one in self._live.items())
        node.add_on_set_parameters_callback(self._check)
        node.add_post_set_parameters_callback(self._accept)

    def _check(self, parameters: Sequence[RosParameter]) -> SetParametersResult:
        """Say whether all of a change together is possible; change nothing."""
        try:
            self._changed({parameter.name: parameter.value for parameter in parameters})
        except ModelError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _accept(self, parameters: Sequence[RosParameter]) -> None:
        """Put an accepted change in force."""
        self.values.update(self._changed({p.name: p.value for p in parameters}))

    def _changed(self, given: Mapping[str, Any]) -> dict[str, Any]:
        """Return what a change leads to, or raise a ModelError."""
        if 'use_sim_time' in given:
            raise ModelError('use_sim_time: the clock cannot be changed while the node runs')
        known = self._live.keys() & given.keys()
        return {name: self._live[name].checked(given[name]) for name in known}


class ValveParameters(Settings):
    """The ROS parameters of one valve: its model, and with the base model all effects.

    The parameters of an effect are declared whether it is active or not, so that one change can
    add it with its values.

    Attributes
    ----------
    spec : ValveSpec
        The valve in force.
    """

    def __init__(
        self,
        node: Node,
        apply: Callable[[ValveSpec], None],
        fixed: Sequence[Declaration] = FIXED,
        live: Sequence[Declaration] = LIVE,
    ) -> None:
        """Declare them all; `apply` receives the new valve after each accepted change.

        `fixed` and `live` are the node's own parameters, as for `Settings`.

        Raises
        ------
        ModelError
            If a given value is refused, with what to do about it.
        """
        self._apply = apply
        self._model = declare(node, MODEL, fixed=True)
        base = self._model == BASE_MODEL
        most = ValveSpec(model=self._model, effects=tuple(CATALOGUE) if base else ())
        declared: tuple[Declaration, ...] = (*most.parameters, BRANCH)
        names = [one.name for one in declared]
        others = [one.name for one in (MODEL, *fixed, *live)]
        # one file may serve a plant and the twin beside it
        refuse_unknown(node, [*names, EFFECTS, *others, *NODE_ONLY])
        self._held: dict[str, Any] = {one.name: declare(node, one) for one in declared}
        self._held[EFFECTS] = declare(node, EFFECT_NAMES)
        given = node._parameter_overrides.keys() & self._held.keys()
        self.spec = self._valve({name: self._held[name] for name in given})
        super().__init__(node, fixed, live)

    def _accept(self, parameters: Sequence[RosParameter]) -> None:
        """Put an accepted change in force and hand the valve on."""
        super()._accept(parameters)
        given = {p.name: p.value for p in parameters if p.name in self._held}
        if given:
            self.spec = self._valve(given)
            self._held |= given
            self._apply(self.spec)

    def _changed(self, given: Mapping[str, Any]) -> dict[str, Any]:
        self._valve({name: given[name] for name in self._held.keys() & given.keys()})
        return super()._changed(given)

    def _valve(self, given: Mapping[str, Any]) -> ValveSpec:
        """Return the valve that a change of what is held leads to, or raise a ModelError."""
        effects = EFFECT_NAMES.checked(given.get(EFFECTS, self._held[EFFECTS]))
        bare = ValveSpec(model=self._model).changed({EFFECTS: effects})
        held = {parameter.name: self._held[parameter.name] for parameter in bare.parameters}
        branch = {BRANCH.name: self._held[BRANCH.name]}
        return bare.changed({**branch, **held, **given, EFFECTS: effects})


def refuse_unknown(node: Node, known: Sequence[str]) -> None:
    """Refuse given parameters that nobody declares: a misspelt one would be lost silently."""
    for name in node._parameter_overrides:  # rclpy has no public way to list them
        if name not in known and not name.startswith(OF_ROS):
            close = difflib.get_close_matches(name, known, 1)
            hint = f'did you mean {close[0]}?' if close else f'known are {", ".join(known)}'
            raise ModelError(f'unknown parameter {name!r}: {hint}')
