"""Everything that was computed from a set of epochs, as a table and in a notebook."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from html import escape
from typing import TYPE_CHECKING, Any, NamedTuple

from rigidimeter.core.records.estimates import (
    FIT_NUMBERS,
    PARAMETERS,
    BandEstimate,
    Delay,
    Finding,
    Fit,
    Score,
)

if TYPE_CHECKING:
    import pandas as pd

_MAX_SHOWN = 20
"""Epochs shown one by one; of more only the first are."""


WEIGHT_IN_STIFFNESS = (
    "K is the slope of all torque against the angle. Unless the axis is vertical it includes that "
    "of the weight, m g l cos θ with θ from hanging straight down"
)


class FindingGroup(NamedTuple):
    """What one check found, in one or more epochs: the first finding, and the fits of all."""

    first: Finding
    fits: tuple[Fit, ...]


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
        """What the checks found: for each check and level the epochs, in the order of reading."""
        groups: dict[tuple[str, str], tuple[Finding, list[Fit]]] = {}
        for fit in (*self.fits, *self.pooled):
            for finding in fit.findings:
                _, fits = groups.setdefault((finding.name, finding.level), (finding, []))
                fits.append(fit)
        return tuple(FindingGroup(first, tuple(fits)) for first, fits in groups.values())

    @property
    def weight_in_stiffness(self) -> str:
        """What K holds of the limb's weight, as a sentence without its stop; empty without fits."""
        if not self.fits:
            return ""
        if any(group.first.name == "gravity" for group in self.findings):
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
            heading += ["R²", "outcome", "doubted by"]
            parts.append(_table(heading, [_fit_row(fit) for fit in shown]))
        if len(self.fits) > _MAX_SHOWN:
            parts.append(f"<p>The first {_MAX_SHOWN} of {len(self.fits)} epochs.</p>")
        if self.findings:
            rows = []
            for first, fits in self.findings:
                where = "all together"
                if fits[0].epoch != "pooled":
                    where = f"{fits[0].source}, {fits[0].epoch}"
                if len(fits) > 1:
                    where = f"{len(fits)}, first {where}"
                rows.append([first.level, where, first.text, first.remedy])
            parts.append("<p>What the checks found:</p>")
            parts.append(_table(["level", "epochs", "finding in the first", "remedy"], rows))
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
    return f"{finding.level}, {finding.name}: {finding.text}"


def _fit_row(fit: Fit) -> list[str]:
    intervals = [
        f"{_number(value)} [{_number(low)}, {_number(high)}]" if math.isfinite(value) else "–"
        for value, low, high in zip(fit.value, fit.low, fit.high, strict=True)
    ]
    name = "all epochs" if fit.epoch == "pooled" else f"{fit.source}, {fit.epoch}"
    outcome = f"{fit.outcome.kind} {fit.outcome.reason}"
    doubts = ", ".join(fit.doubts)
    return [name, fit.condition, *intervals, _number(fit.r_squared), outcome, doubts]


def _number(value: float) -> str:
    return f"{value:.4g}" if math.isfinite(value) else "–"


def _table(heading: Iterable[str], rows: Iterable[Sequence[str]]) -> str:
    head = "".join(f"<th>{escape(cell)}</th>" for cell in heading)
    body = "".join(
        "<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in rows
    )
    return f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"
