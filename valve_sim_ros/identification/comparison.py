# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a comparison of models found, as text and as JSON."""

from dataclasses import dataclass
import json
import math
import os
from pathlib import Path
from typing import Any

from ..model.files import write_text
from ..model.rivals.declaration import Channel
from ..recordings.recording import Recording
from .result import Identification


@dataclass(frozen=True)
class Entry:
    """One model fitted to the data.

    Attributes
    ----------
    name, title : str
        Name, and authors with year.
    result : Identification
        The fit.
    seconds : float
        How long it took, beside the others.
    free : int
        How many parameters were fitted.
    eta, eta_held_out : float
        Fitness of x, eq. (11) [%]: on all data; and on the first and the last third together,
        each predicted by a fit that did not see it. NaN if x does not change there.
    information : float
        Bayes' information criterion of x, n ln(mean square error) + k ln n; less is better.
    remark : str
        That the model cannot answer the input, and why; or empty.
    """

    name: str
    title: str
    result: Identification
    seconds: float
    free: int
    eta: float
    eta_held_out: float
    information: float
    remark: str

    @property
    def parameters(self) -> dict[str, float]:
        """The fitted values by name."""
        return dict(self.result.spec.values)


@dataclass(frozen=True)
class Comparison:
    """Models fitted to the same recordings, the base valve first.

    Attributes
    ----------
    entries : tuple of Entry
        One per model.
    recordings : tuple of Recording
        The data.
    channel : {'u', 'p2'}
        What drove the rivals.
    """

    entries: tuple[Entry, ...]
    recordings: tuple[Recording, ...]
    channel: Channel

    def __getitem__(self, name: str) -> Entry:
        """Return the entry of a model."""
        return next(entry for entry in self.entries if entry.name == name)

    @property
    def ranked(self) -> list[Entry]:
        """The entries from the best fitness to the worst."""
        return sorted(self.entries, key=lambda entry: -entry.eta)

    def lines(self) -> list[str]:
        """Return the table as text."""
        least = min(entry.information for entry in self.entries)
        lines = [
            f'{"model":<17} {"eta fitted":>10} {"held out":>10} {"free":>5} {"BIC - best":>11} '
            f'{"seconds":>8}  parameters'
        ]
        for entry in self.ranked:
            shown = [
                f'{name} {entry.parameters[name]:.4g}'
                for name, estimate in entry.result.estimates.items()
                if name in entry.parameters and math.isfinite(estimate.half_width)
            ]
            lines.append(
                f'{entry.name:<17} {percent(entry.eta):>10} {percent(entry.eta_held_out):>10} '
                f'{entry.free:>5} {entry.information - least:>11.0f} {entry.seconds:>8.2f}  '
                + ', '.join(shown)
            )
        lines += [f'{entry.name}: {entry.remark}' for entry in self.entries if entry.remark]
        return lines

    def as_json(self) -> dict[str, Any]:
        """Return the content of compare.json; null stands for a number that is not there."""
        return {
            'schema_version': 1,
            'input': self.channel,
            'models': {
                entry.name: {
                    'eta': {'fitted': _number(entry.eta), 'held_out': _number(entry.eta_held_out)},
                    'parameters': entry.parameters,
                    'fitted_parameters': entry.free,
                    'bic': _number(entry.information),
                    'seconds': entry.seconds,
                    'remark': entry.remark,
                }
                for entry in self.entries
            },
            'data': [
                {
                    'paths': list(recording.provenance.paths),
                    'sha256': dict(recording.provenance.digests),
                    'samples': len(recording),
                }
                for recording in self.recordings
            ],
            'version': self.entries[0].result.version,
        }

    def write(self, directory: str | os.PathLike[str]) -> None:
        """Write `compare.json` and `compare.txt`, each aside first and then renamed."""
        folder = Path(directory)
        folder.mkdir(parents=True, exist_ok=True)
        contents = {
            'compare.json': json.dumps(self.as_json(), indent=2, allow_nan=False),
            'compare.txt': '\n'.join(self.lines()) + '\n',
        }
        for name, content in contents.items():
            write_text(folder / name, content)


def percent(value: float) -> str:
    """Return a fitness as text; a dash if there is none."""
    if not math.isfinite(value):
        return '–'
    return f'{value:.2f}' if value > -1000.0 else '< -1000'


def _number(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None
