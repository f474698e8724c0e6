# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a diagnosis found, as text, as JSON, and as valves that the plant loads."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
import json
import math
import os
from pathlib import Path
from typing import Any

from .. import __version__
from ..model.effects import CATALOGUE
from ..model.files import write_text
from ..model.parameter_file import write_parameters
from ..model.spec import ValveSpec
from ..recordings.recording import Recording
from .bench import Bench
from .conditions import Place
from .decision import decisions, TestSignal
from .fitting import Valve
from .outcome import Ladder, Outcome
from .proof import Gap
from .rung import Rung
from .seats import ends_of, STOPS

SCHEMA_VERSION = 1
WORDS = {
    'adequate': 'adequate: the base valve explains these data down to the noise',
    'missing_effect': 'an effect is missing',
    'unknown_effect': 'something is missing, and it is none of the effects in the catalogue',
}

PARTIAL = 'Partial: stopped before the end; where not all was tried, an effect may be missing'


@dataclass(frozen=True)
class Named:
    """An effect that was added: the step of the ladder, its parameters and their intervals."""

    rung: Rung
    values: Mapping[str, float]
    intervals: Mapping[str, tuple[float, float]]


@dataclass(frozen=True)
class Diagnosis:
    """Where model and measurement disagree, what is missing, and how much of the gap it closes.

    Attributes
    ----------
    recordings : tuple of Recording
        The data.
    bench : Bench
        The data as they were compared.
    ladders : tuple of Ladder
        One per group of stages, in the order of the flow.
    effects : tuple of Named
        The missing effects in the order in which they were added.
    places : tuple of Place
        Where the base valve is off.
    gaps : mapping of str to Gap
        By signal, on fitted and held-out data.
    base, augmented : ValveSpec
        The valve without and with the effects, fitted to all data.
    base_valve, augmented_valve : Valve
        The same with their nuisances: phase and starting values.
    seed : int
        Of the searches.
    """

    recordings: tuple[Recording, ...]
    bench: Bench
    ladders: tuple[Ladder, ...]
    effects: tuple[Named, ...]
    places: tuple[Place, ...]
    gaps: Mapping[str, Gap]
    base: ValveSpec
    augmented: ValveSpec
    base_valve: Valve
    augmented_valve: Valve
    seed: int = 0

    @property
    def partial(self) -> bool:
        """Whether the diagnosis was stopped before everything was tried."""
        return not all(ladder.complete for ladder in self.ladders)

    @property
    def verdict(self) -> Outcome:
        """'adequate', 'missing_effect' or 'unknown_effect'."""
        outcomes = {ladder.outcome for ladder in self.ladders}
        if 'unknown_effect' in outcomes:
            return 'unknown_effect'
        return 'missing_effect' if 'missing_effect' in outcomes else 'adequate'

    @property
    def unknown(self) -> tuple[Ladder, ...]:
        """The groups of stages in which something unknown is missing."""
        return tuple(ladder for ladder in self.ladders if ladder.outcome == 'unknown_effect')

    @property
    def ends(self) -> str:
        """The ends of the stroke that hold the stem though nothing is named there, in words."""
        besides = {*self.augmented.effects} - {each.rung.effect for each in self.effects}
        ends = ends_of(self.augmented.values) if STOPS in besides else []
        where = ' and '.join(f'{end:g} %' for end in ends)
        return f'the stem is pressed against the end of its stroke at {where}' if ends else ''

    @property
    def test_signal(self) -> TestSignal:
        """The commands that would decide what these data cannot."""
        return TestSignal.of(self.recordings[0])

    def as_json(self) -> dict[str, Any]:
        """Return everything as plain objects, in the documented schema."""
        return {
            'schema_version': SCHEMA_VERSION,
            'version': __version__,
            'signals': list(self.bench.signals),
            'verdict': self.verdict,
            'partial': self.partial,
            'effects': [self._effect(named) for named in self.effects],
            'where': [
                {
                    'stage': place.stage,
                    'signal': place.signal,
                    'condition': place.condition,
                    'spans': [list(span) for span in place.spans],
                    'share_of_gap': place.share_of_gap,
                    'share_of_time': place.share_of_time,
                }
                for place in self.places
            ],
            'gap': {
                name: {
                    'noise_rms': _finite(gap.noise),
                    'before': _halves(gap.before),
                    'after': _halves(gap.after),
                    'closed': gap.closed,
                }
                for name, gap in self.gaps.items()
            },
            'eta': {
                'before': {name: _halves(gap.eta_before) for name, gap in self.gaps.items()},
                'after': {name: _halves(gap.eta_after) for name, gap in self.gaps.items()},
            },
            'stages': [
                {
                    'stages': list(ladder.group.stages),
                    'signal': ladder.group.signal,
                    'outcome': ladder.outcome,
                    'complete': ladder.complete,
                    'excess_before': ladder.before.excess,
                    'excess_after': ladder.after.excess,
                    'best_guess': ladder.best_guess.effect if ladder.best_guess else None,
                }
                for ladder in self.ladders
            ],
            'seed': self.seed,
        }

    def lines(self) -> list[str]:
        """Return the verdict as text."""
        found = [f'verdict: {WORDS[self.verdict]}']
        if self.partial:
            found.append(PARTIAL)
        for ladder in self.ladders:
            found.append(
                f'  {" and ".join(ladder.group.stages)}, seen in {ladder.group.signal}: '
                f'{ladder.told}; excess over the noise '
                f'{ladder.before.excess:.3g}, then {ladder.after.excess:.3g}'
            )
            if ladder.nearest:
                found.append(f'    {ladder.nearest}')
        for named in self.effects:
            found += self._effect_lines(named)
        if self.ends:
            found.append(f'{self.ends}: no effect, but augmented.yaml has it too (travel_stops)')
        for place in self.places:
            found.append(
                f'where: {place.signal} is off {place.condition} '
                f'({place.share_of_gap:.0%} of the gap in {place.share_of_time:.0%} of the time)'
            )
        for name, gap in self.gaps.items():
            closed = 'no gap' if gap.closed is None else f'{gap.closed:.1%} of the gap closed'
            found.append(
                f'{name}: held-out rms {gap.before.held_out:.3g} -> {gap.after.held_out:.3g} % '
                f'(noise {gap.noise:.2g} %, {closed}); eta {gap.eta_before.held_out:.2f} -> '
                f'{gap.eta_after.held_out:.2f} %'
            )
        return found

    def write(self, folder: str | os.PathLike[str]) -> list[Path]:
        """Write all but the page into a folder, each aside first and then renamed into place.

        Parameters
        ----------
        folder : path-like
            Made if it does not exist.

        Returns
        -------
        list of Path
            What was written.
        """
        folder = Path(folder)
        folder.mkdir(parents=True, exist_ok=True)
        paths = ', '.join(path for r in self.recordings for path in r.provenance.paths)
        head = [f'valve_sim diagnose {__version__} of {paths}', f'verdict: {self.verdict}']
        written = [folder / 'base.yaml', folder / 'augmented.yaml', folder / 'diagnosis.json']
        write_parameters(written[0], self.base, [*head, 'the base valve, refitted'])
        names = ', '.join(named.rung.effect for named in self.effects) or 'none'
        write_parameters(written[1], self.augmented, [*head, f'with the missing effects: {names}'])
        write_text(written[2], json.dumps(self.as_json(), indent=1) + '\n')
        if self.verdict != 'adequate':
            written.append(folder / 'decide_by.csv')
            write_text(written[-1], self.test_signal.csv())
        return written

    def _effect(self, named: Named) -> dict[str, Any]:
        rung = named.rung
        units = {p.name: p.unit for p in CATALOGUE[rung.effect].parameters}
        parameters = {}
        for name, value in named.values.items():
            short = name.partition('.')[2]
            parameters[short] = {
                'value': value,
                'interval': [_finite(bound) for bound in named.intervals[name]],
                'unit': units[short],
            }
        return {
            'id': rung.effect,
            'stage': rung.stage,
            'probability': rung.probability,
            'parameters': parameters,
            'indistinguishable_from': list(rung.twins),
            'runner_up': rung.runner_up,
            'closed': rung.closed,
            'evidence': rung.gains[rung.effect],
            'decide_by': '; '.join(decisions(rung, self.bench.signals)),
        }

    def _effect_lines(self, named: Named) -> list[str]:
        rung = named.rung
        effect = CATALOGUE[rung.effect]
        found = [f'missing: {rung.effect} ({effect.title}), probability {rung.probability:.2f}']
        for name, value in named.values.items():
            low, high = named.intervals[name]
            found.append(f'  {name} = {value:.4g} [{low:.4g}, {high:.4g}]')
        if rung.twins:
            found.append(f'  cannot be told from: {", ".join(rung.twins)}')
        if rung.runner_up:
            found.append(f'  runner-up: {rung.runner_up}')
        return [*found, *(f'  decide by: {each}' for each in decisions(rung, self.bench.signals))]


def _halves(halves: Any) -> dict[str, float | None]:
    """Return a pair as plain numbers."""
    return {name: _finite(value) for name, value in asdict(halves).items()}


def _finite(value: float) -> float | None:
    """Return a number that JSON knows."""
    return float(value) if math.isfinite(value) else None
