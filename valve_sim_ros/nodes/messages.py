# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Labelled arrays, and the connections every node of the package makes."""

from collections.abc import Callable, Sequence
from copy import copy
from typing import Any

from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import (
    DurabilityPolicy,
    QoSPolicyKind,
    QoSProfile,
    ReliabilityPolicy,
)
from rclpy.qos_overriding_options import QoSOverridingOptions
from rclpy.subscription import Subscription
from std_msgs.msg import Float64MultiArray, MultiArrayDimension, MultiArrayLayout

LATCHED = QoSProfile(
    depth=1,
    reliability=ReliabilityPolicy.RELIABLE,
    durability=DurabilityPolicy.TRANSIENT_LOCAL,
)
"""For results: who comes late still gets the last one."""

OUTPUT = QoSProfile(depth=10, reliability=ReliabilityPolicy.RELIABLE)
"""Serves reliable and best-effort subscribers."""

INPUT = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)
"""Hears reliable and best-effort publishers."""

HISTORY = QoSProfile(depth=1000, reliability=ReliabilityPolicy.BEST_EFFORT)
"""Hears everybody, and keeps what comes while the node is busy."""

LOSSLESS = QoSProfile(depth=1000, reliability=ReliabilityPolicy.RELIABLE)
"""For lockstep, where a lost message would be a lost sample."""

LOSSLESS_LATCHED = QoSProfile(
    depth=1000,
    reliability=ReliabilityPolicy.RELIABLE,
    durability=DurabilityPolicy.TRANSIENT_LOCAL,
)
"""For lockstep outputs: a peer that connects a moment later still gets its first sample."""


def publisher(node: Node, kind: Any, topic: str, qos: QoSProfile) -> Publisher:
    """Make a publisher that `qos_overrides.<topic>.publisher.depth` and the like can change."""
    return node.create_publisher(kind, topic, copy(qos), qos_overriding_options=_overridable())


def subscription(
    node: Node, kind: Any, topic: str, hear: Callable[[Any], None], qos: QoSProfile
) -> Subscription:
    """Make a subscription that `qos_overrides.<topic>.subscription.depth` etc. can change."""
    options = _overridable()
    return node.create_subscription(kind, topic, hear, copy(qos), qos_overriding_options=options)


def _overridable() -> QoSOverridingOptions:
    kinds = QoSPolicyKind.HISTORY, QoSPolicyKind.DEPTH, QoSPolicyKind.RELIABILITY
    return QoSOverridingOptions([*kinds, QoSPolicyKind.DURABILITY])


def labelled(names: str, values: Sequence[float]) -> Float64MultiArray:
    """Return numbers whose comma-separated `names` are the label of their one dimension."""
    dimension = MultiArrayDimension(label=names, size=len(values), stride=len(values))
    return Float64MultiArray(layout=MultiArrayLayout(dim=[dimension]), data=list(values))
