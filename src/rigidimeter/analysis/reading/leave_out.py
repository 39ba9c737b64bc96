"""What the user leaves out of recordings: ``[NAME=]START:STOP [REASON]``."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from rigidimeter.core.errors import UserError
from rigidimeter.core.records import Epoch, LeftOut, Notice, Outcome

_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_SPAN = re.compile(rf"\s*({_NUMBER})\s*:\s*({_NUMBER})(?:\s+(.*?))?\s*", re.DOTALL)
_EXAMPLE = 'write START:STOP in s and a reason, for example --leave-out "12.3:14.0 cough"'

EDGE_S = 0.1
"""An epoch of which no more is kept at either end is left out whole."""


class Named(NamedTuple):
    """A stretch as the user wrote it; `name` is empty where no recording was named."""

    text: str
    name: str
    stretch: LeftOut


def parse_left_out(text: str) -> Named:
    """Read one stretch.

    Raises
    ------
    UserError
        If it has another form, or does not begin before it ends.
    """
    name, span = "", _SPAN.fullmatch(text)
    if span is None:
        name, _, rest = text.partition("=")
        span = _SPAN.fullmatch(rest) if name else None
    if span is None:
        raise UserError(f"--leave-out {text}: {_EXAMPLE}")
    start_s, stop_s = float(span[1]), float(span[2])
    if not -math.inf < start_s < stop_s < math.inf:
        raise UserError(
            f"--leave-out {text}: begins at {start_s:g} s and ends at {stop_s:g} s; it must begin "
            "before it ends"
        )
    return Named(text, name.strip(), LeftOut(start_s, stop_s, span[3] or ""))


def with_left_out(
    epochs: Sequence[Epoch], texts: Sequence[str]
) -> tuple[list[Epoch], list[Notice]]:
    """Return epochs with the stretches that were named, and a sentence on each.

    An epoch that is left out whole is excluded, as one in a study's list of exclusions: it may have
    numbers, which do not count.

    Times are on the clock of the recording. A recording is named by its path, its file name, or its
    file name without the ending; with a single recording no name is needed.

    Raises
    ------
    UserError
        If a stretch has another form, names no recording or several, or lies in no epoch.
    """
    found = list(epochs)
    notices = []
    for named in map(parse_left_out, texts):
        source = _source(named, list(dict.fromkeys(epoch.source for epoch in epochs)))
        stretch, hit = named.stretch, False
        for place, epoch in enumerate(found):
            first_s, last_s = _span(epoch)
            if epoch.source != source or stretch.start_s > last_s or stretch.stop_s < first_s:
                continue
            hit = True
            why = f": {stretch.reason}" if stretch.reason else ""
            if stretch.start_s <= first_s + EDGE_S and last_s - EDGE_S <= stretch.stop_s:
                reason = "; ".join(filter(None, (epoch.closed.reason, f"left out{why}")))
                found[place] = replace(epoch, closed=Outcome("excluded", reason))
                notices.append(Notice("warning", f"{epoch.name} is left out{why}"))
                continue
            found[place] = replace(epoch, left_out=(*epoch.left_out, stretch))
            text = f"{epoch.name}: {stretch.start_s:g} to {stretch.stop_s:g} s are left out{why}"
            notices.append(Notice("warning", text))
        if not hit:
            spans = [_span(epoch) for epoch in epochs if epoch.source == source]
            raise UserError(
                f"--leave-out {named.text}: lies in no epoch of {source}, which has epochs from "
                f"{min(first for first, _ in spans):.6g} to {max(last for _, last in spans):.6g} s"
            )
    return found, notices


def _source(named: Named, sources: Sequence[str]) -> str:
    """Return the recording that is meant."""
    if named.name:
        chosen = [s for s in sources if named.name in (s, Path(s).name, Path(s).stem)]
    else:
        chosen = list(sources)
    if len(chosen) == 1:
        return chosen[0]
    known = ", ".join(sources)
    if chosen:
        raise UserError(
            f"--leave-out {named.text}: may be any of {', '.join(chosen)}; say which, as in "
            f'--leave-out "{chosen[0]}={named.stretch.start_s:g}:{named.stretch.stop_s:g}"'
        )
    raise UserError(f"--leave-out {named.text}: no recording is called {named.name}; read: {known}")


def _span(epoch: Epoch) -> tuple[float, float]:
    channels = [channel for channel in epoch.channels.values() if len(channel)]
    if not channels:
        return math.inf, -math.inf
    return (
        min(float(channel.time_s[0]) for channel in channels),
        max(float(channel.time_s[-1]) for channel in channels),
    )
