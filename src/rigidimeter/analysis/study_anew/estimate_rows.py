"""From estimates to rows: what was fitted and scored, whose, when, in what condition.

One analysis is what the study concludes from; those by other methods are rows beside it.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import groupby
from typing import Any

import numpy as np
import pandas as pd
import scipy

from rigidimeter.analysis.study_anew.measures import MEASURES
from rigidimeter.analysis.study_anew.rows import as_rows
from rigidimeter.analysis.study_anew.study import Condition, SessionEntry
from rigidimeter.core.findings import Finding
from rigidimeter.core.records import PARAMETERS, Analysis, Epoch, Fit, Score

OF_SUBJECT = {"tremor", "voluntary_torque", "active_movement", "emg_activity", "loop_bias"}
"""Checks of the subject's own torque, which touches scores too, whatever it does to a fit."""

ALIKE_IN_BOTH = ("between_samples", "varying_between_epochs")
"""Checks that make no difference: of the rig, and of a scatter that is in the test."""

_SCORES = tuple(one.name for one in MEASURES if one.origin == "scores")
_NORMAL = 1e9
"""More degrees of freedom than this are those of a normal distribution."""


def estimate_rows(
    analyses: Mapping[str, Analysis],
    sessions: Mapping[str, SessionEntry] | None = None,
    epochs: Sequence[Epoch] = (),
    conditions: Iterable[Condition] = (),
) -> pd.DataFrame:
    """Return the rows of all estimates.

    Parameters
    ----------
    analyses : mapping of str to Analysis
        By method; the first is what the study concludes from.
    sessions : mapping of str to SessionEntry, optional
        By source. Without them days are not known, and each epoch is resampled by itself.
    epochs : sequence of Epoch, optional
        That were analysed, for task, block and time since the change of stimulation.
    conditions : iterable of Condition, optional
        With the stimulation.

    Returns
    -------
    pandas.DataFrame
        As `as_rows`.
    """
    place = _Place(sessions, epochs, conditions)
    records: list[dict[str, Any]] = []
    for number, (method, analysis) in enumerate(analyses.items()):
        made_by = {"method": method, "chosen": number == 0}
        for inertia, fits in (("free", analysis.fits), ("fixed", analysis.fixed_inertia)):
            stage = made_by | {"inertia": inertia, "chosen": number == 0 and inertia == "free"}
            for fit in fits:
                records += _of_fit(fit, place.of(fit, "prbs") | stage)
        if number == 0:
            records += _of_scores(analysis, place, made_by)
            records += _of_pooled(analysis, place, made_by | {"inertia": "free"})
    return as_rows(records)


class _Place:
    """Who, when and in what condition: the cells that an estimate does not hold itself."""

    def __init__(
        self,
        sessions: Mapping[str, SessionEntry] | None,
        epochs: Sequence[Epoch],
        conditions: Iterable[Condition],
    ) -> None:
        self._sessions = sessions
        self._epochs = {(epoch.source, epoch.label): epoch for epoch in epochs}
        self._blocks = blocks(epochs)
        self._doses = {one.name: one.dose for one in conditions}

    def of(self, result: Fit | Score, task: str) -> dict[str, Any]:
        key = (result.source, result.epoch)
        cells: dict[str, Any] = {
            "session": result.source,
            "epoch": result.epoch,
            "block": self._blocks.get(key, ""),
            "unit": f"{result.source}/{result.epoch}",
            "task": task,
            "outcome": result.outcome.kind,
            "reason": result.outcome.reason,
        }
        epoch = self._epochs.get(key)
        if epoch is not None and epoch.since_change_min is not None:
            cells["since_change_min"] = epoch.since_change_min
        if self._sessions is not None:
            entry = self._sessions[result.source]
            cells |= {"subject": entry.subject, "group": entry.group, "day": entry.day}
            cells["unit"] = f"{entry.subject}/{entry.day}"
        return cells | self.condition(result.condition)

    def condition(self, name: str) -> dict[str, Any]:
        return {"condition": name} | self._doses.get(name, {})


def blocks(epochs: Iterable[Epoch]) -> dict[tuple[str, str], str]:
    """Return the block of each epoch, by source and label.

    A block is an unbroken stretch of one condition, counted from 1 in each source in the order of
    time.
    """

    def begins_s(epoch: Epoch) -> float:
        stamps = [channel.time_s[0] for channel in epoch.channels.values() if len(channel)]
        return float(min(stamps, default=math.inf))

    found: dict[tuple[str, str], str] = {}
    ordered = sorted(epochs, key=lambda epoch: epoch.source)
    for _, of_source in groupby(ordered, key=lambda epoch: epoch.source):
        in_time = sorted(of_source, key=begins_s)
        for number, (_, block) in enumerate(groupby(in_time, key=lambda one: one.condition), 1):
            found |= {(epoch.source, epoch.label): str(number) for epoch in block}
    return found


def _of_fit(fit: Fit, cells: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
    degrees = _degrees(fit.high - fit.low, fit.se)
    findings = " ".join(one.name for one in fit.findings if one.level != "note")
    for k, parameter in enumerate(PARAMETERS):
        yield {
            **cells,
            "measure": parameter.name,
            "value": float(fit.value[k]),
            "se": float(fit.se[k]),
            "degrees": float(degrees[k]),
            "low": float(fit.low[k]),
            "high": float(fit.high[k]),
            "findings": findings,
        }


def _degrees(width: Any, se: Any) -> Any:
    """Return the degrees of freedom for which Student's t gives the intervals."""
    with np.errstate(invalid="ignore", divide="ignore"):
        degrees = scipy.special.stdtridf(0.975, width / 2.0 / se)
    return np.where(degrees > _NORMAL, np.inf, degrees)


def _of_scores(
    analysis: Analysis, place: _Place, made_by: Mapping[str, Any]
) -> Iterator[dict[str, Any]]:
    own_torque = {
        (fit.source, fit.epoch): [one.name for one in fit.findings if one.name in OF_SUBJECT]
        for fit in analysis.fits
    }
    for score in analysis.scores:
        findings = " ".join(own_torque.get((score.source, score.epoch), ()))
        cells = {**place.of(score, "sinusoid"), **made_by, "findings": findings}
        for name in _SCORES:
            yield cells | {"measure": name, "value": getattr(score, name)}


def _of_pooled(
    analysis: Analysis, place: _Place, made_by: Mapping[str, Any]
) -> Iterator[dict[str, Any]]:
    """Yield the fits to all epochs of each condition, and the one to all epochs.

    The latter has no condition, as recordings without a name for theirs have none: it comes last.
    """
    known = {fit.condition for fit in analysis.fits}
    seen: set[str] = set()
    for fit in analysis.pooled:
        of_one = fit.condition in known and fit.condition not in seen
        seen.add(fit.condition)
        cells = {
            **place.condition(fit.condition),
            **made_by,
            "scope": "condition" if of_one else "all",
            "session": fit.source,
            "epoch": fit.epoch,
            "task": "prbs",
            "outcome": fit.outcome.kind,
            "reason": fit.outcome.reason,
        }
        for row in _of_fit(fit, cells):
            yield row | {"bias": _bias(fit.findings, (row["high"] - row["low"]) / 2.0)}


def _bias(findings: Iterable[Finding], half: float) -> float:
    """Return the largest bias that findings allow, in the unit of half the interval.

    `loop_bias` is in % of half the interval of the one of J, B and K that it moves most; others do
    not say how far.
    """
    total = sum(
        one.value / 100.0 * half if one.name == "loop_bias" else math.inf
        for one in findings
        if one.level != "note" and one.name not in ALIKE_IN_BOTH
    )
    return total if math.isfinite(total) else math.inf
