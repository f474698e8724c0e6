# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Node `valve_identifier`: bags in, fitted parameters and fitness on latched topics."""

from collections.abc import Sequence
import json
import sys
from typing import Any

from rcl_interfaces.msg import IntegerRange, ParameterDescriptor
from rclpy.node import Node
from rclpy.parameter import Parameter as RosParameter
from rclpy.utilities import remove_ros_args
from std_msgs.msg import Float64, Float64MultiArray, String

from ..identification.errors import IdentificationError
from ..identification.identify import identify
from ..identification.result import Identification
from ..identification.watch import Stop
from ..model.parameters import PAPER_SEVEN
from .diagnosing import DiagnoseService, Material
from .long_service import Job, LongService
from .messages import labelled, LATCHED
from .spinning import run
from .start import valve_identifier

ONCE = '--once'
USAGE = f'valve_identifier [{ONCE}] [BAG...] [--ros-args ...]'
SEEDS = IntegerRange(from_value=0, to_value=2**31 - 1, step=1)


class ValveIdentifier(Node):
    """Fits the valve to recordings, at the start and whenever `~/identify` is called.

    `~/diagnose` says what the model lacks; the answer comes on `~/diagnosis` (JSON) as well.

    Publishes, for late joiners too, `~/parameters` (Float64MultiArray, the names as label),
    `~/eta` (Float64, %) and `~/result` (String, the content of identify.json). A failed
    identification leaves the last good result on the topics and in the output folder.
    """

    def __init__(self, bags: Sequence[str] = (), once: bool = False, **options: Any) -> None:
        """Declare the parameters, connect, and identify if asked to.

        Parameters
        ----------
        bags : sequence of str
            Paths that take the place of the parameter `bags`.
        once : bool
            Identify now, whatever `identify_at_start` says, and fail without a bag.
        options
            Go to rclpy's Node.

        Raises
        ------
        ValueError
            If nothing can be identified from the bags given at the start.
        """
        super().__init__('valve_identifier', **options)
        self._declare_all()
        if bags:
            kind = RosParameter.Type.STRING_ARRAY
            self.set_parameters([RosParameter('bags', kind, list(bags))])
        self._latched = {
            'parameters': self.create_publisher(Float64MultiArray, '~/parameters', LATCHED),
            'eta': self.create_publisher(Float64, '~/eta', LATCHED),
            'result': self.create_publisher(String, '~/result', LATCHED),
        }
        LongService(self, '~/identify', self._prepare)
        DiagnoseService(self, self._material, self._folder)
        if once or (self._texts('bags') and self.get_parameter('identify_at_start').value):
            self.identify()

    def identify(self) -> Identification:
        """Fit the valve to the recordings in the parameter `bags`, write and publish the result.

        Raises
        ------
        RecordingError
            If a bag cannot be read.
        IdentificationError
            If there is no bag, nothing can be identified, or the result cannot be written.
        """
        result = identify(
            self._bags(),
            topics=self._topics(),
            seed=self.get_parameter('seed').value,
            hold_out=self.get_parameter('hold_out').value,
            progress=self._progress,
            interruptible=True,
        )
        self._write(result)
        if self.context.ok():
            self._publish(result)
        return result

    def _write(self, result: Identification) -> None:
        """Write fitted.yaml and identify.json where the parameters say, if anywhere."""
        folder = self._folder()
        if not folder:
            return
        try:
            result.write(folder)
        except OSError as error:
            raise IdentificationError(
                f'output_directory {folder}: cannot be written ({error.strerror}); choose a '
                'folder of your own'
            ) from None

    def _publish(self, result: Identification) -> None:
        """Put the result on the latched topics and in the log."""
        names = [parameter.name for parameter in PAPER_SEVEN]
        values = [float(result.spec.values[name]) for name in names]
        self._latched['parameters'].publish(labelled(','.join(names), values))
        self._latched['eta'].publish(Float64(data=float(result.eta)))
        text = json.dumps(result.as_json(), allow_nan=False)
        self._latched['result'].publish(String(data=text))
        for line in result.lines():
            self.get_logger().info(line)

    def _prepare(self) -> Job:
        """Begin the answer to `~/identify`; it comes when the fit is done."""
        return lambda: f'eta = {self.identify().eta:.4f} %'

    def _material(self) -> Material:
        """Return what `~/diagnose` works on."""
        seed = self.get_parameter('seed').value
        return self._bags(), {'topics': self._topics(), 'seed': seed}

    def _progress(self, share: float, text: str) -> None:
        """Say how far the fit is; once the node is told to end, the best so far must do."""
        if not self.context.ok():
            raise Stop
        self.get_logger().info(f'{100.0 * share:.0f} % {text}', throttle_duration_sec=1.0)

    def _declare_all(self) -> None:
        """Declare the node's parameters."""
        strings = RosParameter.Type.STRING_ARRAY
        for name, default, words, limits in (
            ('output_directory', '', 'Folder for fitted.yaml and identify.json; empty: none', []),
            ('seed', 0, 'Seed of the global search', [SEEDS]),
            ('hold_out', True, 'Also fit without the outer thirds, or each of several bags', []),
            ('identify_at_start', True, 'Identify at the start if there are bags', []),
        ):
            descriptor = ParameterDescriptor(description=words, integer_range=limits)
            self.declare_parameter(name, default, descriptor)
        for name, words in (
            ('bags', 'Bags or CSV files, fitted together'),
            ('topics', 'SIGNAL=TOPIC where the names differ, e.g. x=/valve_7/position'),
        ):
            # an empty list has no type of its own in ROS: [''] stands for none
            descriptor = ParameterDescriptor(description=words, type=strings.value)
            self.declare_parameter(name, [''], descriptor)

    def _texts(self, name: str) -> list[str]:
        """Return a list parameter without its empty entries."""
        return [text for text in self.get_parameter(name).value or [] if text]

    def _bags(self) -> list[str]:
        """Return the recordings, or raise an IdentificationError if there is none."""
        bags = self._texts('bags')
        if not bags:
            raise IdentificationError(
                'no bag to identify from: give the paths of one or more recordings as arguments '
                'or in the parameter bags'
            )
        return bags

    def _folder(self) -> str:
        """Return where results shall be written; '' is nowhere."""
        return str(self.get_parameter('output_directory').value)

    def _topics(self) -> dict[str, str]:
        """Return the topic by signal from the parameter `topics`."""
        topics = {}
        for text in self._texts('topics'):
            signal, equals, topic = text.partition('=')
            if not (equals and topic):
                raise IdentificationError(
                    f'topics: {text!r}: expected SIGNAL=TOPIC, as in x=/valve_7/position'
                )
            topics[signal] = topic
        return topics


def _node(words: Sequence[str]) -> ValveIdentifier:
    """Make the node from the plain command line."""
    for word in words:
        if word.startswith('-') and word != ONCE:
            raise IdentificationError(f'unknown option {word}: expected {USAGE}')
    return ValveIdentifier([word for word in words if word != ONCE], once=ONCE in words)


def main(args: Sequence[str] | None = None) -> None:
    """Run the node; recordings may be given as plain arguments, `--once` ends after the fit."""
    command = list(sys.argv) if args is None else ['valve_identifier', *args]
    words = remove_ros_args(command)[1:]
    sys.exit(run(lambda: _node(words), args, once=ONCE in words))


if __name__ == '__main__':
    valve_identifier()
