# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Nodes under test on the real middleware, spun by the test itself."""

import time

import pytest
import rclpy
from rclpy.node import Node
from rclpy.parameter import Parameter
from std_msgs.msg import Float64

from valve_sim_ros.nodes.messages import LOSSLESS
from valve_sim_ros.nodes.spinning import new_executor
from valve_sim_ros.nodes.valve_plant import ValvePlant
from valve_sim_ros.testing import lockstep_valve

__all__ = ['lockstep_valve']


def overrides(**values):
    """Return values as rclpy takes them."""
    return [Parameter(name, value=value) for name, value in values.items()]


class Peer(Node):
    """Sends commands and keeps what the plant publishes."""

    def __init__(self, name='peer', **options):
        super().__init__(name, **options)
        self.u = self.create_publisher(Float64, 'u', LOSSLESS)
        self.heard = {name: [] for name in ('p1', 'p2', 'x')}
        for topic, values in self.heard.items():
            self.create_subscription(
                Float64, topic, lambda m, values=values: values.append(m.data), LOSSLESS
            )

    def send(self, value):
        self.u.publish(Float64(data=float(value)))


class Bench:
    """Spins the nodes of a test until something has happened."""

    def __init__(self):
        self.renew()

    def renew(self):
        """Begin again, in the context that rclpy has now."""
        self.executor = new_executor()
        self.nodes = []

    def add(self, node):
        self.nodes.append(node)
        self.executor.add_node(node)
        return node

    def until(self, condition, limit=20.0):
        end = time.monotonic() + limit
        while not condition():
            assert time.monotonic() < end, 'timed out'
            self.executor.spin_once(timeout_sec=0.05)

    def plant(self, namespace='', name='valve_plant', **parameters):
        """Add a plant."""
        given = {'diagnostics_period': 0.0, **parameters}
        # YAML says group.name, Python keywords cannot
        given = {key.replace('__', '.'): value for key, value in given.items()}
        return self.add(
            ValvePlant(name, namespace=namespace, parameter_overrides=overrides(**given))
        )

    def peer(self, plant, **options):
        """Add a peer and wait until it is connected to the plant."""
        peer = self.add(Peer(namespace=plant.get_namespace(), **options))
        names = ('p1', 'p2', 'x')
        self.until(
            lambda: (
                peer.u.get_subscription_count()
                and all(plant.outputs[name].get_subscription_count() for name in names)
            )
        )
        return peer

    def call(self, kind, service, **request):
        """Call a service and return its answer."""
        client = self.nodes[-1].create_client(kind, service)
        self.until(client.service_is_ready)
        answer = client.call_async(kind.Request(**request))
        self.until(answer.done, 60.0)
        return answer.result()

    def close(self):
        self.executor.shutdown()
        for node in self.nodes:
            node.destroy_node()


@pytest.fixture
def bench():
    """Return a started ROS with what adds and spins nodes."""
    rclpy.init()
    made = Bench()
    yield made
    made.close()
    rclpy.try_shutdown()
