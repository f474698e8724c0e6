# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A plant node in lockstep and what a test needs to drive it."""

from collections.abc import Callable, Mapping
import time
from typing import Any, NamedTuple

import numpy as np
from rclpy.node import Node
from rclpy.parameter import Parameter
from std_msgs.msg import Float64, Float64MultiArray

from ..model.simulation import Simulation
from ..model.spec import ValveSpec
from ..nodes.messages import LOSSLESS
from ..nodes.spinning import new_executor
from ..nodes.valve_plant import ValvePlant


class Sample(NamedTuple):
    """One sample: time [s]; command, inlet pressure, chamber pressure, position [% of span]."""

    t: float
    u: float
    p1: float
    p2: float
    x: float


class _LimitedPlant(ValvePlant):
    """Stands still after so many samples, however many commands come."""

    limit: float = float('inf')

    def step(self) -> tuple[float, float, float]:
        sample = super().step()
        if self.samples >= self.limit:
            self.pacing.pause(True)
        return sample


class LockstepValve:
    """A `valve_plant` in lockstep in this process; every message goes over DDS.

    The same commands give the same samples to the last bit, on any machine, under any load.

    Attributes
    ----------
    plant : ValvePlant
        The node.
    samples : list of Sample
        Everything it published.
    """

    def __init__(
        self,
        parameters: Mapping[str, Any] | ValveSpec | None = None,
        sample_time: float = 0.2,
        *,
        namespace: str = '',
        patience: float = 20.0,
        **settings: Any,
    ) -> None:
        """Start the node and connect to it.

        Parameters
        ----------
        parameters : mapping or ValveSpec, optional
            The valve: values by name, with `model` and `effects` if wanted.
        sample_time : float
            Sampling period [s].
        namespace : str
            Namespace of the node and of its topics.
        patience : float
            Wall time [s] without a sample after which a test has failed.
        settings
            Other parameters of the node, such as ``initial_x=20.0`` or ``command_timeout=1.0``.
        """
        spec = (
            parameters
            if isinstance(parameters, ValveSpec)
            else ValveSpec().changed(parameters or {})
        )
        given = {
            **as_parameters(spec),
            'sample_time': sample_time,
            'pacing': 'lockstep',
            'publish_sample': True,
            'diagnostics_period': 0.0,
            **settings,
        }
        self.samples: list[Sample] = []
        self._patience, self._driven = patience, False
        self.plant = _LimitedPlant(
            namespace=namespace,
            parameter_overrides=[Parameter(name, value=value) for name, value in given.items()],
        )
        self._probe = Node('lockstep_probe', namespace=namespace)
        self._nodes: list[Node] = [self.plant, self._probe]
        self._u = self._probe.create_publisher(Float64, 'u', LOSSLESS)
        topic = f'{self.plant.get_name()}/sample'
        self._probe.create_subscription(Float64MultiArray, topic, self._hear, LOSSLESS)
        self._executor = new_executor()
        for node in self._nodes:
            self._executor.add_node(node)
        self._spin(self._connected, 'the plant did not connect to the test')

    def step(self, u: float) -> Sample:
        """Publish one command [% of span] and return the sample that answers it."""
        goal = len(self.samples) + 1
        self._u.publish(Float64(data=float(u)))
        self._spin(lambda: len(self.samples) >= goal, f'no sample answered the command {u}')
        return self.samples[-1]

    def drive(
        self, *controllers: Node, samples: int, first_command: float | None = None
    ) -> Simulation:
        """Let nodes control the valve until exactly so many samples are taken.

        Parameters
        ----------
        controllers : Node
            Nodes under test: among them they subscribe x (or p1, p2, ~/sample) and publish u.
            They are spun here and destroyed by `close`.
        samples : int
            Number of samples, counted from now.
        first_command : float, optional
            Command [% of span] that takes the first sample and so starts the loop; the valve's
            initial command by default. A controller that sends its first command by itself needs
            none: give NaN.

        Returns
        -------
        Simulation
            With arrays t, u, p1, p2, x of shape (samples,).
        """
        if self._driven:
            raise RuntimeError('drive was called before: make a new valve for a new run')
        self._driven = True
        before = len(self.samples)
        self.plant.limit = self.plant.samples + samples
        self._nodes.extend(controllers)
        for node in controllers:
            self._executor.add_node(node)
        self._spin(
            lambda: self._probe.count_publishers('u') > 1 and self._is_heard(),
            'no node publishes u and hears p1, p2, x or sample',
        )
        first = self.plant.command if first_command is None else first_command
        if first == first:
            self._u.publish(Float64(data=float(first)))
        self._spin(
            lambda: len(self.samples) >= before + samples, 'the controller sent no further command'
        )
        t, u, p1, p2, x = np.array(self.samples[before:]).T.copy()
        return Simulation(t, u, p1, p2, x, self.plant.spec)

    def close(self) -> None:
        """Take everything down."""
        self._executor.shutdown()
        for node in self._nodes:
            node.destroy_node()

    def _hear(self, message: Float64MultiArray) -> None:
        self.samples.append(Sample(*message.data))

    def _connected(self) -> bool:
        return bool(
            self._u.get_subscription_count()
            and self.plant.outputs['sample'].get_subscription_count()
        )

    def _is_heard(self) -> bool:
        """Tell whether anybody but the probe listens to an output."""
        counts = {n: p.get_subscription_count() for n, p in self.plant.outputs.items()}
        return sum(counts.values()) > 1

    def _spin(self, done: Callable[[], bool], failure: str) -> None:
        """Spin until `done`; fail if no sample came for too long."""
        count, end = len(self.samples), time.monotonic() + self._patience
        while not done():
            if not self.plant.context.ok():
                raise RuntimeError('ROS was shut down during the test, e.g. by a signal')
            self._executor.spin_once(timeout_sec=0.1)
            if len(self.samples) > count:
                count, end = len(self.samples), time.monotonic() + self._patience
            elif time.monotonic() > end:
                raise TimeoutError(f'{failure} (after {count} samples, {self._patience:g} s)')


def as_parameters(spec: ValveSpec) -> dict[str, Any]:
    """Return a valve as the parameters of the plant node."""
    options = {'branch': spec.branch, 'model': spec.model}
    return {**spec.values, **options, 'effects': list(spec.effects) or ['']}
