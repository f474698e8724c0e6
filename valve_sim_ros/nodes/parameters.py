# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The model's declarations as ROS parameters: declared, checked, applied in that order."""

from collections.abc import Callable, Sequence
import difflib

from rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor, SetParametersResult
from rclpy.node import Node
from rclpy.parameter import Parameter as RosParameter

from ..model.declarations import Parameter
from ..model.errors import ModelError
from ..model.parameters import BASE, BRANCH, SAMPLE_TIME
from ..model.spec import ValveSpec

INITIAL_COMMAND = Parameter(
    'initial_command',
    'u(0)',
    '%',
    0.0,
    0.0,
    100.0,
    'linear',
    'Command that holds until the first one arrives',
)
FIXED = (SAMPLE_TIME, INITIAL_COMMAND)
"""Parameters of the plant node that need a restart."""
OF_ROS = ('use_sim_time', 'start_type_description_service', 'qos_overrides')


def descriptor(parameter: Parameter, fixed: bool = False) -> ParameterDescriptor:
    """Return what `ros2 param describe` shows; an integer is taken for a float."""
    return ParameterDescriptor(
        description=f'{parameter.description} [{parameter.unit}]',
        read_only=fixed,
        dynamic_typing=True,
        floating_point_range=[
            FloatingPointRange(from_value=parameter.lower, to_value=parameter.upper, step=0.0)
        ],
    )


class ValveParameters:
    """The ROS parameters of one valve: a change is checked first and applied only then."""

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
        _refuse_unknown(node)
        for parameter in BASE:
            node.declare_parameter(parameter.name, parameter.default, descriptor(parameter))
        node.declare_parameter(
            BRANCH.name,
            BRANCH.default,
            ParameterDescriptor(
                description=f'{BRANCH.description} (one of {", ".join(BRANCH.choices)})',
                dynamic_typing=True,
            ),
        )
        self.fixed = {
            parameter.name: parameter.checked(
                node.declare_parameter(
                    parameter.name, parameter.default, descriptor(parameter, fixed=True)
                ).value
            )
            for parameter in FIXED
        }
        names = [*(parameter.name for parameter in BASE), BRANCH.name]
        self._names = frozenset(names)
        self.spec = ValveSpec().changed({name: node.get_parameter(name).value for name in names})
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
        self.spec = self._changed(parameters)
        self._apply(self.spec)

    def _changed(self, parameters: Sequence[RosParameter]) -> ValveSpec:
        return self.spec.changed({p.name: p.value for p in parameters if p.name in self._names})


def _refuse_unknown(node: Node) -> None:
    """Refuse given parameters that nobody declares: a misspelt one would be lost silently."""
    known = [parameter.name for parameter in (*BASE, *FIXED)] + [BRANCH.name]
    for name in node._parameter_overrides:  # rclpy has no public way to list them
        if name not in known and not name.startswith(OF_ROS):
            close = difflib.get_close_matches(name, known, 1)
            hint = f'did you mean {close[0]}?' if close else f'known are {", ".join(known)}'
            raise ModelError(f'unknown parameter {name!r}: {hint}')
