"""Everything that was computed from a set of epochs, as a table and in a notebook."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import PurePath
from typing import TYPE_CHECKING, Any, NamedTuple

from rigidimeter.core.findings import SERIOUS_FIRST, Finding, epochs_text
from rigidimeter.core.records.estimates import (
    FIT_NUMBERS,
    PARAMETERS,
    BandEstimate,
    Delay,
    Fit,
    Score,
)

if TYPE_CHECKING:
    import pandas as pd

_MAX_SHOWN = 20
"""Epochs shown one by one; of more only the first are."""

MOST_SOURCES = 3
"""The epochs of a finding are named where they are of at most so many recordings."""


WEIGHT_IN_STIFFNESS = (
    "K is the slope of all torque against the angle. Unless the axis is vertical it includes that "
    "of the weight, m g l cos θ with θ from hanging straight down"
)


class FindingGroup(NamedTuple):
    """What one check found, with one level, in one or more epochs.

    Attributes
    ----------
    finding : Finding
        The one that is furthest from its limit.
    fits : tuple of Fit
        All that carry it, in the order of reading: of epochs, and to all epochs together.
    where : str
        The epochs in words.
    """

    finding: Finding
    fits: tuple[Fit, ...]
    where: str

    @property
    def line(self) -> str:
        """Level, name, headline and epochs in one line."""
        one = self.finding
        return f"{one.level}  {one.name}  {one.headline}; {self.where}"


def grouped(fits: Sequence[Fit], pooled: Sequence[Fit]) -> tuple[FindingGroup, ...]:
    """Return what fits carry, once for each check and level, the most serious first.

    Parameters
    ----------
    fits : sequence of Fit
        Of epochs.
    pooled : sequence of Fit
        To all epochs of a condition, and of all of them.
    """
    carried: dict[tuple[str, str], list[tuple[Fit, Finding]]] = {}
    for fit in (*fits, *pooled):
        for finding in fit.findings:
            carried.setdefault((finding.name, finding.level), []).append((fit, finding))
    groups = []
    for members in carried.values():
        _, worst = max(members, key=lambda each: _beyond(each[1]))
        where = _where(members, worst, fits)
        groups.append(FindingGroup(worst, tuple(fit for fit, _ in members), where))
    return tuple(sorted(groups, key=lambda group: SERIOUS_FIRST.index(group.finding.level)))


def _beyond(finding: Finding) -> float:
    beyond = abs(finding.value - finding.limit)
    return beyond if math.isfinite(beyond) else -1.0


def _where(members: Sequence[tuple[Fit, Finding]], worst: Finding, fits: Sequence[Fit]) -> str:
    """Return which epochs show it, and which one most where they differ."""
    own = [(fit, finding) for fit, finding in members if fit.epoch != "pooled"]
    if not own:
        conditions = dict.fromkeys(fit.condition for fit, _ in members if fit.condition)
        return "all epochs together" + (f" in {' and '.join(conditions)}" if conditions else "")
    sources = list(dict.fromkeys(fit.source for fit in fits))

    def of(found: Iterable[Fit]) -> str:
        by_source: dict[str, list[str]] = {}
        for fit in found:
            by_source.setdefault(fit.source, []).append(fit.epoch)
        return "; ".join(
            epochs_text(labels) + (f" of {PurePath(source).name}" if len(sources) > 1 else "")
            for source, labels in by_source.items()
        )

    where = of(fit for fit, _ in own)
    if len(own) == len(fits) > 1:
        where = "both epochs" if len(fits) == 2 else f"all {len(fits)} epochs"
    elif len({fit.source for fit, _ in own}) > MOST_SOURCES:
        where = f"{len(own)} of {len(fits)} epochs"
    if len({finding.headline for _, finding in own}) > 1:
        most = [fit for fit, finding in own if finding == worst]
        where += f", most in {of(most[:1])}" if most else ""
    return where


@dataclass(frozen=True)
class Analysis:
    """What was computed from a set of epochs.

    `fits` and `fixed_inertia` run in parallel: one entry for each epoch that was fitted, in the
    order of reading. `inertia_kg_m2` is the median that the second stage held fixed (NaN if no
    epoch was included). `pooled` are the fits to all epochs of each condition together, and with
    several conditions to all epochs, whose condition is empty. `method_reason` says why a method
    was chosen where it was left open. `sensitivity` is what other bands give, where the
    perturbation was recorded.
    """

    method: str
    fits: tuple[Fit, ...]
    fixed_inertia: tuple[Fit, ...]
    inertia_kg_m2: float
    scores: tuple[Score, ...]
    pooled: tuple[Fit, ...] = ()
    delays: tuple[Delay, ...] = ()
    method_reason: str = ""
    sensitivity: tuple[BandEstimate, ...] = ()

    @property
    def findings(self) -> tuple[FindingGroup, ...]:
        """What the checks found: for each check and level the epochs, the most serious first."""
        return grouped(self.fits, self.pooled)

    @property
    def weight_in_stiffness(self) -> str:
        """What K holds of the limb's weight, as a sentence without its stop; empty without fits."""
        if not self.fits:
            return ""
        if any(group.finding.name == "gravity" for group in self.findings):
            return f"{WEIGHT_IN_STIFFNESS}; the note `gravity` of each epoch gives K without it"
        return f"{WEIGHT_IN_STIFFNESS}; set diagnostics.gravity_nm to have K without it too"

    def rows(self) -> list[dict[str, Any]]:
        """Return one row for each fitted epoch: the fit, and B and K at fixed inertia beside it.

        An analysis of sinusoids alone gives a row for each score.
        """
        rows = []
        together = {fit.condition: fit.findings for fit in self.pooled}
        for fit, fixed in zip(self.fits, self.fixed_inertia, strict=True):
            held = {f"fixed_inertia_{name}": getattr(fixed, name) for name in FIT_NUMBERS}
            for ending in ("_se", "_low", "_high", "_bound"):  # of a J that was held
                del held[f"fixed_inertia_{PARAMETERS[0].name}{ending}"]
            rows.append(
                fit.row()
                | {
                    "findings": " / ".join(map(_in_a_cell, fit.findings)),
                    "pooled_findings": " / ".join(map(_in_a_cell, together.get(fit.condition, ()))),
                    "band_low_hz": fit.band_hz[0],
                    "band_high_hz": fit.band_hz[1],
                }
                | held
            )
        return rows or [score.row() for score in self.scores]

    def table(self) -> pd.DataFrame:
        """Return `rows` as a table, with the columns of ``rigidimeter estimate --csv``."""
        import pandas as pd

        return pd.DataFrame(self.rows())

    def _repr_html_(self) -> str:
        """Return J, B and K with their 95 % intervals, what the checks found, and the scores."""
        reason = f": {self.method_reason}" if self.method_reason else ""
        parts = [f"<p>{escape(f'Method {self.method}{reason}.')}</p>"]
        if self.fits:
            heading = ["epoch", "condition"]
            heading += [f"{p.symbol} ({p.unit}) [95\xa0% interval]" for p in PARAMETERS]
            shown = [*self.fits[:_MAX_SHOWN], *self.pooled]
            heading += ["R²", "outcome", "caution"]
            parts.append(_table(heading, [_fit_row(fit) for fit in shown]))
        if len(self.fits) > _MAX_SHOWN:
            parts.append(f"<p>The first {_MAX_SHOWN} of {len(self.fits)} epochs.</p>")
        if self.findings:
            rows = [
                [one.level, one.name, one.headline, where, one.details, one.remedy]
                for one, _, where in self.findings
            ]
            heading = ["level", "finding", "", "epochs", "details", "remedy"]
            parts.append("<p>What the checks found:</p>")
            parts.append(_table(heading, rows))
        if self.scores:
            rows = [
                [
                    f"{s.source}, {s.epoch}",
                    s.condition,
                    _number(s.impulse_nm_s),
                    _number(s.work_j),
                    f"{s.outcome.kind} {s.outcome.reason}",
                ]
                for s in self.scores[:_MAX_SHOWN]
            ]
            heading = ["epoch", "condition", "impulse (N·m·s)", "work (J)", "outcome"]
            parts.append(_table(heading, rows))
        return "\n".join(parts)


def _in_a_cell(finding: Finding) -> str:
    return f"{finding.level}, {finding.name}: {finding.headline}"


def _fit_row(fit: Fit) -> list[str]:
    intervals = [
        f"{_number(value)} [{_number(low)}, {_number(high)}]" if math.isfinite(value) else "–"
        for value, low, high in zip(fit.value, fit.low, fit.high, strict=True)
    ]
    name = "all epochs" if fit.epoch == "pooled" else f"{fit.source}, {fit.epoch}"
    outcome = f"{fit.outcome.kind} {fit.outcome.reason}"
    cautions = ", ".join(fit.cautions)
    return [name, fit.condition, *intervals, _number(fit.r_squared), outcome, cautions]


def _number(value: float) -> str:
    return f"{value:.4g}" if math.isfinite(value) else "–"


def _table(heading: Iterable[str], rows: Iterable[Sequence[str]]) -> str:
    head = "".join(f"<th>{escape(cell)}</th>" for cell in heading)
    body = "".join(
        "<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in rows
    )
    return f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"
