# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What an identification found, as text, as JSON and as parameters that the plant loads."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import datetime, timezone
import json
import math
import os
from pathlib import Path
from typing import Any

from ..model.files import write_text
from ..model.parameter_file import write_parameters
from ..model.pipeline import Array
from ..model.spec import ValveSpec
from ..recordings.recording import Recording
from .fitness import nrmse_fit
from .profiles import Profile
from .text import comments, lines
from .uncertainty import Assessment, Estimate

SCHEMA_VERSION = 2


@dataclass(frozen=True)
class Identification:
    """Fitted parameters with their fitness and verdicts.

    Attributes
    ----------
    spec : ValveSpec
        The fitted valve.
    estimates : mapping of str to Estimate
        Value, 95 % interval and verdict of each parameter and of a_1/a_2.
    eta_by_signal : mapping of str to float
        Fitness of eq. (11) of each fitted signal [%], on all data.
    eta_held_out : mapping of str to mapping
        For each part held out: 'fitted' and 'held_out' fitness by signal, of a fit to the rest.
    recordings : tuple of Recording
        The data.
    fitted : tuple of mapping
        For each recording the simulated p1, p2, x, aligned with its time [% of span].
    seed : int
        Seed of the search.
    version : str
        Version of this package.
    assessment : Assessment or None
        Correlations and visible combinations.
    remarks : tuple of str
        What must be said about the fit: over-fitted, drifting.
    profiles : tuple of Profile
        Profile likelihoods, if they were asked for.
    noise : mapping of str to float
        Standard deviation of each signal's noise [% of span], its weight in the fit.
    bounds : mapping of str to tuple
        Range that was searched, by unknown; that of f_d as a share of f_s.
    partial : bool
        Whether the work was stopped: then this is the best that was found until then.
    """

    spec: ValveSpec
    estimates: Mapping[str, Estimate]
    eta_by_signal: Mapping[str, float]
    eta_held_out: Mapping[str, Mapping[str, Mapping[str, float]]]
    recordings: tuple[Recording, ...]
    fitted: tuple[Mapping[str, Array], ...]
    seed: int
    version: str
    assessment: Assessment | None = None
    remarks: tuple[str, ...] = ()
    profiles: tuple[Profile, ...] = ()
    noise: Mapping[str, float] = field(default_factory=dict)
    bounds: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    partial: bool = False

    @property
    def signals(self) -> tuple[str, ...]:
        """The measured signals that were fitted."""
        return tuple(self.eta_by_signal)

    @property
    def eta(self) -> float:
        """Fitness of the last measured signal in the flow, x where it is measured [%]."""
        return self.eta_by_signal[self.signals[-1]]

    @property
    def nrmse(self) -> Mapping[str, float]:
        """What system identification tools call fit [%], by signal; norms without squares."""
        return {name: nrmse_fit(eta) for name, eta in self.eta_by_signal.items()}

    def lines(self) -> list[str]:
        """Return the result as text for a console or a report."""
        return lines(self)

    def as_json(self) -> dict[str, Any]:
        """Return the content of identify.json."""
        assessment = self.assessment
        return {
            'schema_version': SCHEMA_VERSION,
            'partial': self.partial,
            'model': self.spec.model,
            'eta': _number(self.eta),
            'eta_by_signal': _numbers(self.eta_by_signal),
            'nrmse_by_signal': _numbers(self.nrmse),
            'eta_held_out': {
                name: {part: _numbers(etas) for part, etas in parts.items()}
                for name, parts in self.eta_held_out.items()
            },
            'remarks': list(self.remarks),
            'parameters': {
                parameter.name: _estimate(self.estimates[parameter.name], parameter.unit)
                for parameter in self.spec.parameters
                if parameter.name in self.estimates
            },
            **{
                name: _estimate(estimate, '1/s')
                for name, estimate in self.estimates.items()
                if name == 'a_1/a_2'
            },
            'combinations': {
                name: _estimate(estimate)
                for name, estimate in (assessment.combinations if assessment else {}).items()
            },
            'correlation': {
                'names': list(assessment.names) if assessment else [],
                'matrix': assessment.correlation.tolist() if assessment else [],
            },
            'profiles': [_profile(each) for each in self.profiles],
            'noise': _numbers(self.noise),
            'searched': {name: list(bounds) for name, bounds in self.bounds.items()},
            'signals': list(self.signals),
            'seed': self.seed,
            'version': self.version,
            'data': {'recordings': [_recording(recording) for recording in self.recordings]},
        }

    def write(self, directory: str | os.PathLike[str]) -> None:
        """Write `fitted.yaml` and `identify.json`, each aside first and then renamed."""
        folder = Path(directory)
        folder.mkdir(parents=True, exist_ok=True)
        date = datetime.now(timezone.utc).isoformat(timespec='seconds')
        content = {**self.as_json(), 'date': date}
        told = json.dumps(content, indent=2, allow_nan=False)
        write_parameters(folder / 'fitted.yaml', self.spec, comments(self, date))
        write_text(folder / 'identify.json', told)


def _estimate(estimate: Estimate, unit: str = '') -> dict[str, Any]:
    """Return an estimate as JSON."""
    return {
        'value': estimate.value,
        'unit': estimate.unit or unit,
        'standard_error': _number(estimate.standard_error),
        'half_width_95': _number(estimate.half_width),
        'interval_95': [_number(estimate.lower), _number(estimate.upper)],
        'verdict': estimate.verdict,
    }


def _profile(profile: Profile) -> dict[str, Any]:
    """Return a profile as JSON."""
    return {
        'name': profile.name,
        'unit': profile.unit,
        'values': profile.values.tolist(),
        'rise': profile.rise.tolist(),
        'interval_95': [profile.lower, profile.upper],
    }


def _recording(recording: Recording) -> dict[str, Any]:
    """Return where a recording comes from and how good it is."""
    return {
        'paths': list(recording.provenance.paths),
        'sha256': dict(recording.provenance.digests),
        'topics': dict(recording.provenance.topics),
        'samples': len(recording),
        'duration': float(recording.time[-1]),
        'sample_time': recording.sample_time,
        'segments': len(recording.segments),
        'quality': recording.quality.lines(),
    }


def _numbers(values: Mapping[str, float]) -> dict[str, float | None]:
    """Return numbers that JSON can hold."""
    return {name: _number(value) for name, value in values.items()}


def _number(value: float) -> float | None:
    """Return a number that JSON can hold: null stands for not finite."""
    return float(value) if math.isfinite(value) else None
