# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The outcomes of a study, a JSON line for each record, each with the version that made it."""

from collections.abc import Iterable
from dataclasses import asdict
import json
import os
from pathlib import Path
import subprocess
from typing import Any

from .outcomes import Outcome


def version(root: Path, package: str = 'valve_sim_ros') -> str:
    """Return the last commit that changed the package, marked if it was changed since."""

    def git(*words: str) -> str:
        found = subprocess.run(
            ('git', *words, '--', package), cwd=root, capture_output=True, text=True, check=True
        )
        return found.stdout.strip()

    try:
        commit = git('log', '-1', '--abbrev=7', '--format=%h')
        return commit + '-dirty' * bool(git('status', '--porcelain'))
    except (OSError, subprocess.CalledProcessError):
        return 'unknown'


def _line(about: dict[str, Any], outcome: Outcome) -> str:
    twins = [sorted(each) for each in outcome.twins]
    content = {**about, **asdict(outcome), 'twins': twins}
    closed = None if outcome.closed is None else round(outcome.closed, 5)
    return json.dumps({**content, 'seconds': round(outcome.seconds, 1), 'closed': closed})


def _outcome(content: dict[str, Any]) -> Outcome:
    return Outcome(
        record=content['record'],
        truth=tuple(content['truth']),
        verdict=content['verdict'],
        named=tuple(content['named']),
        twins=tuple(frozenset(each) for each in content['twins']),
        probabilities=tuple(content['probabilities']),
        seconds=content['seconds'],
        closed=content['closed'],
    )


def read(path: Path | None, about: dict[str, Any]) -> list[Outcome]:
    """Return the outcomes of a file whose lines say all that `about` does, in order of records.

    Parameters
    ----------
    path : Path or None
        The file; no outcomes if there is none.
    about : dict
        Set, signals, split, seed and version.
    """
    if path is None or not path.exists():
        return []
    lines = map(json.loads, path.read_text(encoding='utf-8').splitlines())
    those = (each for each in lines if about.items() <= each.items())
    return sorted(map(_outcome, those), key=lambda each: each.record)


def add(path: Path, about: dict[str, Any], outcomes: Iterable[Outcome]) -> None:
    """Append outcomes to a file; written aside, then put in place."""
    before = path.read_text(encoding='utf-8') if path.exists() else ''
    aside = path.with_name(f'.{path.name}.part')
    aside.write_text(
        before + ''.join(f'{_line(about, each)}\n' for each in outcomes), encoding='utf-8'
    )
    os.replace(aside, path)
