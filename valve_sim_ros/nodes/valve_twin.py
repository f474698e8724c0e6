# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Node `valve_twin`: the identified model beside a running valve, and what differs."""

from array import array
from collections.abc import Mapping, Sequence
from functools import partial
import math
import sys
from typing import Any

from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from std_msgs.msg import Float64, Float64MultiArray

from ..model.declarations import Parameter
from ..model.parameters import SAMPLE_TIME
from ..model.spec import ValveSpec
from ..recordings.recording import OUTPUTS, Recording
from .assembly import Assembly
from .comparison import Comparison, Values
from .diagnosing import DiagnoseService
from .health import Health, Report
from .messages import HISTORY, labelled, OUTPUT, publisher, subscription
from .parameters import DIAGNOSTICS_PERIOD, Text, ValveParameters
from .spinning import ends_quietly, run
from .start import valve_twin

WINDOW = Parameter(
    'window', 'T_w', 's', 600.0, 1.0, 86400.0, 'log', 'How far back the rolling record reaches'
)
BAND = Parameter(
    'band', 'b', '%', 1.0, 0.0, 100.0, 'linear',
    'Residual that counts as agreement, beside three times the noise of the signal',
)  # fmt: skip
ALARM_TIME = Parameter(
    'alarm_time', 'T_a', 's', 10.0, 0.1, 3600.0, 'log',
    'Time over which a residual is averaged (root mean square) before it is judged',
)  # fmt: skip
ETA_PERIOD = 1.0
"""Wall seconds between two messages on ~/eta."""
OUTPUT_DIRECTORY = Text('output_directory', 'Folder for diagnoses; empty: none')
FIXED = (SAMPLE_TIME, WINDOW, DIAGNOSTICS_PERIOD)
LIVE = (BAND, ALARM_TIME, OUTPUT_DIRECTORY)


class ValveTwin(Node):
    """Hears u, p1, p2 and x (or the samples of `sample`), predicts, compares, remembers.

    Publishes `~/prediction` and `~/residual` with each sample, `~/eta` every second, all as
    labelled Float64MultiArray in per cent, and warns on /diagnostics.
    """

    def __init__(self, **options: Any) -> None:
        """Declare the parameters and connect; `options` go to rclpy's Node."""
        super().__init__('valve_twin', **options)
        self._valve_parameters = ValveParameters(self, self._apply, FIXED, LIVE)
        self._settings = self._valve_parameters.values
        self.sample_time = self._settings['sample_time']
        self.comparison = Comparison(
            self._valve_parameters.spec, self.sample_time, self._settings['window']
        )
        self._assembly = Assembly(self.sample_time, self._take, self.comparison.interrupt)
        self.samples, self._reported = 0, 0
        self._last_sample: float | None = None
        self._messages = {
            'prediction': labelled('t,u,p1,p2,x', [0.0] * 5),
            'residual': labelled('p1,p2,x', [0.0] * 3),
            'eta': labelled('p1,p2,x', [0.0] * 3),
        }
        self._topics = {
            name: publisher(self, Float64MultiArray, f'~/{name}', OUTPUT)
            for name in self._messages
        }
        self._connect()
        self._health = Health(self, self._settings['diagnostics_period'], self._report)
        DiagnoseService(self, self._material, lambda: self._settings['output_directory'])

    def _connect(self) -> None:
        """Hear the valve."""
        subscription(self, Float64, 'u', self._hear_command, HISTORY)
        for name in OUTPUTS:
            subscription(self, Float64, name, partial(self._hear, name), HISTORY)
        subscription(self, Float64MultiArray, 'sample', self._hear_sample, HISTORY)
        clock = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(ETA_PERIOD, self._publish_eta, clock=clock)

    def recording(self) -> Recording:
        """Return the rolling record; RecordingError if there is none yet."""
        return self.comparison.recording()

    def _apply(self, spec: ValveSpec) -> None:
        self.comparison.spec = spec

    def _hear_command(self, message: Float64) -> None:
        """Take note of a command, as the valve does."""
        if math.isfinite(message.data):
            self._assembly.command = min(max(message.data, 0.0), 100.0)

    @ends_quietly
    def _hear(self, name: str, message: Float64) -> None:
        """Take an output."""
        if self._last_sample is None:
            now = self.get_clock().now().nanoseconds * 1e-9
            self._assembly.hear(name, message.data, now)

    @ends_quietly
    def _hear_sample(self, message: Float64MultiArray) -> None:
        """Take a whole sample t,u,p1,p2,x; from the first one on the single topics are deaf."""
        if len(message.data) != 5:
            return
        time, u, p1, p2, x = message.data
        before, self._last_sample = self._last_sample, time
        if before is None or abs(time - before - self.sample_time) > 0.5 * self.sample_time:
            self.comparison.interrupt()
        self._take(u, (p1, p2, x))

    def _take(self, u: float, measured: Values) -> None:
        """Compare a sample and publish the comparison."""
        row = self.comparison.take(u, measured)
        self.samples += 1
        self._publish('prediction', (row.time, u, *row.predicted))
        self._publish('residual', row.residual)

    @ends_quietly
    def _publish_eta(self) -> None:
        """Say how well the model does over the record."""
        if self.samples:
            self._publish('eta', self.comparison.eta())

    def _publish(self, name: str, values: Sequence[float]) -> None:
        message = self._messages[name]
        message.data = array('d', values)
        self._topics[name].publish(message)

    def _report(self) -> Report:
        """Return what /diagnostics shall say."""
        new, self._reported = self.samples - self._reported, self.samples
        residual = self.comparison.residual(self._settings['alarm_time'])
        bands = [self._settings['band'] + 3.0 * noise for noise in self.comparison.noise()]
        troubles = [
            f'{name}: the model is off by {found:.3g} %, more than its band of {band:.3g} %'
            for name, found, band in zip(OUTPUTS, residual, bands, strict=True)
            if found > band
        ]
        if not new:
            troubles.append('no sample of the valve since the last report')
        eta = self.comparison.eta() if self.samples else (math.nan,) * 3
        figures: dict[str, Any] = {'model': self.comparison.spec.model, 'samples': self.samples}
        for k, name in enumerate(OUTPUTS):
            figures[f'residual of {name} [%]'] = f'{residual[k]:.4g}'
            figures[f'band of {name} [%]'] = f'{bands[k]:.4g}'
            figures[f'eta of {name} [%]'] = f'{eta[k]:.4g}'
        return troubles, figures

    def _material(self) -> tuple[Recording, Mapping[str, Any]]:
        """Return what `~/diagnose` works on."""
        return self.recording(), {'spec': self.comparison.spec}


def main(args: Sequence[str] | None = None) -> None:
    """Run the node until SIGINT or SIGTERM; exit code 1 if a parameter is refused."""
    sys.exit(run(ValveTwin, args))


if __name__ == '__main__':
    valve_twin()
