# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What an identification found, as text, as JSON and as parameters that the plant loads."""

from collections.abc import Mapping
from dataclasses import dataclass
import json
import math
import os
from pathlib import Path
from typing import Any

from ..model.parameter_file import write_parameters
from ..model.parameters import PAPER_SEVEN
from ..model.pipeline import Array
from ..model.spec import ValveSpec
from ..recordings.recording import Recording
from .uncertainty import Estimate


@dataclass(frozen=True)
class Identification:
    """Fitted parameters with their fitness and verdicts.

    Attributes
    ----------
    spec : ValveSpec
        The fitted valve.
    estimates : mapping of str to Estimate
        Value, half-width of the 95 % interval and verdict of each parameter and of a_1/a_2.
    eta_by_signal : mapping of str to float
        Fitness of eq. (11) of each measured signal [%], on all data.
    eta_held_out : mapping of str to mapping
        For each third held out: 'fitted' and 'held_out' fitness by signal, of a fit to the rest.
    recordings : tuple of Recording
        The data.
    fitted : tuple of mapping
        For each recording the simulated p1, p2, x, aligned with its time [% of span].
    seed : int
        Seed of the search.
    version : str
        Version of this package.
    """

    spec: ValveSpec
    estimates: Mapping[str, Estimate]
    eta_by_signal: Mapping[str, float]
    eta_held_out: Mapping[str, Mapping[str, Mapping[str, float]]]
    recordings: tuple[Recording, ...]
    fitted: tuple[Mapping[str, Array], ...]
    seed: int
    version: str

    @property
    def signals(self) -> tuple[str, ...]:
        """The measured signals that were fitted."""
        return tuple(self.eta_by_signal)

    @property
    def eta(self) -> float:
        """Fitness of the last measured signal in the flow, x where it is measured [%]."""
        return self.eta_by_signal[self.signals[-1]]

    def lines(self) -> list[str]:
        """Return the result as text for a console or a report."""
        lines = [f'{"parameter":<10} {"value":>12} {"± 95 %":>10} unit   verdict']
        units = {parameter.name: parameter.unit for parameter in PAPER_SEVEN}
        for name, estimate in self.estimates.items():
            half = f'{estimate.half_width:.3g}' if math.isfinite(estimate.half_width) else '-'
            lines.append(
                f'{name:<10} {estimate.value:>12.5g} {half:>10} {units.get(name, "1/s"):<6} '
                f'{estimate.verdict}'
            )
        lines.append('eta on all data: ' + _percent(self.eta_by_signal))
        for name, etas in self.eta_held_out.items():
            lines.append(
                f'{name} held out: fitted {_percent(etas["fitted"])}; '
                f'held out {_percent(etas["held_out"])}'
            )
        return lines

    def as_json(self) -> dict[str, Any]:
        """Return the content of identify.json."""
        return {
            'schema_version': 1,
            'eta': _number(self.eta),
            'eta_by_signal': {name: _number(eta) for name, eta in self.eta_by_signal.items()},
            'eta_held_out': {
                third: {
                    part: {name: _number(eta) for name, eta in values.items()}
                    for part, values in etas.items()
                }
                for third, etas in self.eta_held_out.items()
            },
            'parameters': {
                parameter.name: {
                    'value': self.spec.values[parameter.name],
                    'unit': parameter.unit,
                    'half_width_95': _number(self.estimates[parameter.name].half_width),
                    'verdict': self.estimates[parameter.name].verdict,
                }
                for parameter in PAPER_SEVEN
            },
            'a_1/a_2': {
                'value': self.estimates['a_1/a_2'].value,
                'unit': '1/s',
                'half_width_95': _number(self.estimates['a_1/a_2'].half_width),
                'verdict': self.estimates['a_1/a_2'].verdict,
            },
            'signals': list(self.signals),
            'seed': self.seed,
            'version': self.version,
            'data': {
                'recordings': [
                    {
                        'paths': list(recording.provenance.paths),
                        'sha256': dict(recording.provenance.digests),
                        'topics': dict(recording.provenance.topics),
                        'samples': len(recording),
                        'duration': float(recording.time[-1]),
                        'sample_time': recording.sample_time,
                        'segments': len(recording.segments),
                        'quality': recording.quality.lines(),
                    }
                    for recording in self.recordings
                ]
            },
        }

    def write(self, directory: str | os.PathLike[str]) -> None:
        """Write `fitted.yaml` and `identify.json`, each aside first and then renamed."""
        folder = Path(directory)
        folder.mkdir(parents=True, exist_ok=True)
        aside = folder / '.identify.json.part'
        aside.write_text(json.dumps(self.as_json(), indent=2, allow_nan=False), encoding='utf-8')
        write_parameters(folder / 'fitted.yaml', self.spec, self._comments())
        os.replace(aside, folder / 'identify.json')

    def _comments(self) -> list[str]:
        """Return the head of fitted.yaml: from what, by what, how well."""
        digests = [
            f'data: {path} sha256 {digest}'
            for recording in self.recordings
            for path, digest in recording.provenance.digests.items()
        ]
        return [
            f'Fitted by valve_sim_ros {self.version}, seed {self.seed}',
            *digests,
            *self.lines(),
        ]


def _percent(etas: Mapping[str, float]) -> str:
    """Return fitness by signal as text."""
    return ', '.join(f'{name} {eta:.2f} %' for name, eta in etas.items())


def _number(value: float) -> float | None:
    """Return a number that JSON can hold: null stands for not finite."""
    return float(value) if math.isfinite(value) else None
