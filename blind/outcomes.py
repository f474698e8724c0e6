# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What was hidden in a record, and what the diagnosis said about it."""

from dataclasses import dataclass
from itertools import permutations
from pathlib import Path
from typing import Any

from .continuation import gap_closed
from .seal import digest, read_json

FAILED, ADEQUATE, MISSING, UNKNOWN = 'failed', 'adequate', 'missing_effect', 'unknown_effect'


@dataclass(frozen=True)
class Outcome:
    """One record.

    Attributes
    ----------
    record : str
        Its name.
    truth : tuple of str
        Ids of the hidden effects.
    verdict : str
        'adequate', 'missing_effect', 'unknown_effect', or 'failed' if there is none.
    named : tuple of str
        Ids of the effects that the diagnosis added, in its order.
    twins : tuple of frozenset of str
        For each of them, the ids it is said to be indistinguishable from.
    probabilities : tuple of float
        For each of them, the probability stated.
    seconds : float
        Time taken, scaled to 900 s at 5 Hz.
    closed : float or None
        Share of the explainable gap closed on the continuation; None if there is none to close.
    """

    record: str
    truth: tuple[str, ...]
    verdict: str
    named: tuple[str, ...] = ()
    twins: tuple[frozenset[str], ...] = ()
    probabilities: tuple[float, ...] = ()
    seconds: float = 0.0
    closed: float | None = None

    @property
    def exact(self) -> bool:
        """Tell whether all hidden effects and no others were named."""
        return self.verdict == MISSING and sorted(self.named) == sorted(self.truth)

    @property
    def within_twins(self) -> bool:
        """Tell whether each effect named is a hidden one, or says that it may be that one."""
        if self.verdict != MISSING or len(self.named) != len(self.truth):
            return False
        meant = [{name} | twins for name, twins in zip(self.named, self.twins, strict=True)]
        return any(
            all(name in each for name, each in zip(order, meant, strict=True))
            for order in permutations(self.truth)
        )

    @property
    def all_named(self) -> bool:
        """Tell whether all hidden effects were named, perhaps with others."""
        return self.verdict == MISSING and set(self.truth) <= set(self.named)

    @property
    def one_named(self) -> bool:
        """Tell whether at least one hidden effect was named."""
        return self.verdict == MISSING and bool(set(self.truth) & set(self.named))

    @property
    def said(self) -> str:
        """Return the verdict as the confusion matrix shows it."""
        return ' + '.join(sorted(self.named)) if self.verdict == MISSING else self.verdict


def read(folder: Path, verdicts: Path, record: str) -> Outcome:
    """Open the key of a record and set it against its verdict."""
    key = read_json(folder / 'keys' / f'{record}.json')
    truth = tuple(key['effects'])
    found = verdicts / record
    if not (found / 'seconds.json').exists():
        return Outcome(record, truth, FAILED)
    said: dict[str, Any] = read_json(found / 'diagnosis.json')
    samples = key['length'] / key['recorder']['period']
    return Outcome(
        record,
        truth,
        said['verdict'],
        tuple(each['id'] for each in said['effects']),
        tuple(frozenset(each['indistinguishable_from']) for each in said['effects']),
        tuple(float(each['probability']) for each in said['effects']),
        read_json(found / 'seconds.json') * 4500.0 / samples,
        gap_closed(folder, found, record, key) if truth else None,
    )


def tried(folder: Path, verdicts: Path) -> list[str]:
    """Return the records that have been diagnosed, or could not be."""
    names = sorted(path.stem for path in (folder / 'keys').glob('*.json'))
    ends = ('seconds.json', 'error.txt')
    return [name for name in names if any((verdicts / name / end).exists() for end in ends)]


def read_all(folder: Path, verdicts: Path) -> list[Outcome]:
    """Return the outcomes of all records that have been tried.

    Raises
    ------
    ValueError
        If there is no verdict, or if a key is not the one that was sealed.
    """
    if digest(folder / 'keys') != read_json(folder / 'set.json')['seal']:
        raise ValueError(f'{folder / "keys"}: not the sealed keys; generate the set again')
    done = tried(folder, verdicts)
    if not done:
        raise ValueError(f'{verdicts}: no verdicts on {folder}; run `python -m blind run` first')
    return [read(folder, verdicts, name) for name in done]
