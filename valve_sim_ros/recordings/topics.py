# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Which topic, and which field of its messages, carries which signal."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
import difflib
import re

from .errors import RecordingError
from .recording import OUTPUTS, SIGNALS

NUMBER = r'(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?'
SELECTION = re.compile(
    rf'(?P<path>[A-Za-z0-9_/~.\[\]]+?)(?:\*(?P<scale>[+-]?{NUMBER}))?(?P<offset>[+-]{NUMBER})?'
)


@dataclass(frozen=True)
class TopicSelection:
    """A numeric field of a topic (or a CSV column), with the way to per cent of span.

    Attributes
    ----------
    topic : str
        Topic name; it may still end in a field path, as ``/valve/state/position[2]``, until
        `resolve` has seen the topics there are.
    field : str
        Path of the number in the message, as ``state.position[2]``.
    scale, offset : float
        ``signal = scale * number + offset`` [% of span].
    """

    topic: str
    field: str = 'data'
    scale: float = 1.0
    offset: float = 0.0

    @classmethod
    def parse(cls, text: str) -> 'TopicSelection':
        """Read ``TOPIC[.FIELD][*SCALE][+OFFSET]``, as ``/valve/state.position[2]*6.25-25``.

        Raises
        ------
        RecordingError
            If `text` has another form.
        """
        match = SELECTION.fullmatch(text.strip())
        if match is None:
            raise RecordingError(
                f'topic {text!r}: expected TOPIC, TOPIC.FIELD or TOPIC/FIELD, then optionally '
                '*SCALE and +OFFSET, as in /valve/state.position[2]*6.25-25'
            )
        topic, dot, path = match['path'].partition('.')
        if '[' in topic and dot:  # /state/position[2].value: all of it is found by `resolve`
            topic, path = match['path'].replace('.', '/'), ''
        return cls(
            topic,
            path if dot and path else 'data',
            float(match['scale'] or 1.0),
            float(match['offset'] or 0.0),
        )

    def resolve(self, topics: Iterable[str]) -> 'TopicSelection':
        """Return the selection with its field path split from the longest topic there is.

        Raises
        ------
        RecordingError
            If no topic fits; the sentence lists those there are.
        """
        names = sorted(topics)
        wanted = self.topic if self.topic.startswith('/') else f'/{self.topic}'
        if wanted in names:
            return replace(self, topic=wanted)
        fitting = [name for name in names if wanted.startswith(f'{name}/')]
        if not fitting:
            raise RecordingError(f'no topic {wanted} in the bag; {listing(names, wanted)}')
        topic = max(fitting, key=len)
        rest = wanted[len(topic) + 1 :].replace('/', '.')
        return replace(
            self, topic=topic, field=rest if self.field == 'data' else f'{rest}.{self.field}'
        )

    def text(self) -> str:
        """Return the selection in the form that `parse` reads."""
        text = self.topic + ('' if self.field == 'data' else f'.{self.field}')
        if self.scale != 1.0:
            text += f'*{self.scale!r}'
        if self.offset != 0.0:
            text += f'{self.offset:+}'
        return text


Topics = Mapping[str, 'str | TopicSelection']


def listing(names: Iterable[str], wanted: str = '') -> str:
    """Return what topics there are, and the one that was probably meant."""
    names = sorted(names)
    if not names:
        return 'the bag has no topics at all'
    close = difflib.get_close_matches(wanted, names, n=1) if wanted else []
    hint = f'; did you mean {close[0]}?' if close else ''
    return f'it has {", ".join(names)}{hint}'


def chosen(topics: Topics | None) -> dict[str, TopicSelection]:
    """Return what the caller chose, parsed.

    Raises
    ------
    RecordingError
        For a signal that does not exist or a selection that cannot be read.
    """
    selections = {}
    for signal, selection in (topics or {}).items():
        if signal not in SIGNALS:
            raise RecordingError(
                f'topic for {signal!r}: expected one of the signals {", ".join(SIGNALS)}, as in '
                'x=/valve_7/position'
            )
        if isinstance(selection, str):
            selection = TopicSelection.parse(selection)
        selections[signal] = selection
    return selections


def select(
    topics: Topics | None, available: Mapping[str, int], require_outputs: bool = True
) -> dict[str, TopicSelection]:
    """Decide which topic carries which signal.

    Parameters
    ----------
    topics : mapping of str to str or TopicSelection, optional
        What the caller chose; the other signals are the topics called u, p1, p2, x.
    available : mapping of str to int
        Messages by topic.
    require_outputs : bool
        Whether at least one of p1, p2, x must be there.

    Returns
    -------
    dict of str to TopicSelection
        In the order u, p1, p2, x; outputs without a topic are left out.

    Raises
    ------
    RecordingError
        If a topic is missing, empty or ambiguous.
    """
    explicit = chosen(topics)
    names = {}
    for signal in SIGNALS:
        if signal in explicit:
            found = explicit[signal].resolve(available)
            _refuse_silent(signal, found.topic, available)
            names[signal] = found
        elif candidates := _called(signal, available, taken={s.topic for s in names.values()}):
            if signal == 'u':
                _refuse_silent(signal, candidates[0], available)
            if available[candidates[0]] or len(candidates) > 1:
                names[signal] = TopicSelection(_only(signal, candidates))
    if 'u' not in names:
        raise RecordingError(
            f'no topic for the command u in the bag: {listing(available, "/u")}; say which one '
            'with --topic u=/NAME'
        )
    if require_outputs and len(names) == 1:
        raise RecordingError(
            f'none of the outputs {", ".join(OUTPUTS)} has a topic with messages in the bag: '
            f'{listing(available)}; say which one with --topic x=/NAME'
        )
    return names


def _called(signal: str, available: Mapping[str, int], taken: set[str]) -> list[str]:
    """Return the topics whose last name is `signal`; those with messages first."""
    named = [t for t in sorted(available) if t.rsplit('/', 1)[-1] == signal and t not in taken]
    return [t for t in named if available[t]] or named[:1]


def _only(signal: str, candidates: list[str]) -> str:
    """Return the one candidate, or refuse to guess between several."""
    if len(candidates) > 1:
        raise RecordingError(
            f'{len(candidates)} topics are called {signal}: {", ".join(candidates)}; say which '
            f'valve you mean with --topic {signal}={candidates[0]}'
        )
    return candidates[0]


def _refuse_silent(signal: str, topic: str, available: Mapping[str, int]) -> None:
    """Raise a RecordingError for a topic without messages."""
    if not available[topic]:
        raise RecordingError(
            f'topic {topic} for {signal} is in the bag but holds no message: record it while '
            'the valve runs, or choose another topic'
        )
