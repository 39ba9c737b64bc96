"""Everything that was computed from a set of epochs, as a table and in a notebook."""

from __future__ import annotations

import math
from collections.abc import Mapping
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
from rigidimeter.core.text import (
    html_table,
    interval_text,
    one_cell,
    one_line,
    plural,
    short_names,
    with_error,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    import pandas as pd
    from numpy.typing import NDArray

    from rigidimeter.core.drawing import Axes

_MAX_SHOWN = 20
"""Epochs shown one by one; of more only the first are."""

_READ = (
    "source",
    "epoch",
    "condition",
    *(p.name + ending for p in PARAMETERS for ending in ("", "_se")),
    "vaf_percent",
    "outcome",
)
"""The columns of a table that is read by people; what the checks found is the last."""


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

    def table(self, *, full: bool = False) -> pd.DataFrame:
        """Return a row for each fitted epoch, or for each score of an analysis of sinusoids alone.

        Parameters
        ----------
        full : bool
            All columns of ``rigidimeter estimate --csv``. Otherwise source, epoch and condition,
            J, B and K with their standard errors, the VAF in %, the outcome, and the names of the
            findings that are more than a note.

        Returns
        -------
        pandas.DataFrame
        """
        import pandas as pd

        if full or not self.fits:
            return pd.DataFrame(self.rows())
        rows = [
            {name: row[name] for name in _READ} | {"findings": ", ".join(fit.doubts)}
            for fit, row in zip(self.fits, self.rows(), strict=True)
        ]
        return pd.DataFrame(rows)

    def plot(self, *, axes: Sequence[Axes] | None = None) -> NDArray[Any]:
        """Draw J, B and K of every epoch in the order of recording, each with its 95 % interval.

        A hollow point does not count; a cross at the bottom is an epoch without numbers. The line
        and its band are the estimate of all epochs of a condition together. Of an analysis of
        sinusoids alone, impulse and work are drawn.

        Parameters
        ----------
        axes : three (of sinusoids two) matplotlib Axes, optional
            To draw on; without them a new figure is made.

        Returns
        -------
        array of matplotlib Axes, shape (3,) or (2,)

        Raises
        ------
        ValueError
            If there is no epoch.
        """
        from rigidimeter.core.drawing import plots

        return plots.plot_estimates(self, axes)

    def plot_torque(
        self,
        recording: Any,
        epoch: int = 0,
        *,
        span_s: float | None = 7.0,
        axes: Sequence[Axes] | None = None,
    ) -> NDArray[Any]:
        """Draw measured and modelled torque of one epoch, what the model leaves, and its terms.

        Parameters
        ----------
        recording : Recording
            The one that was estimated, since an analysis does not hold the signals.
        epoch : int
            Place in `fits`, as in the index of `table()`.
        span_s : float or None
            How much is drawn, in s from the first fitted sample; None for all of it.
        axes : five matplotlib Axes, optional
            To draw on; without them a new figure is made.

        Returns
        -------
        array of matplotlib Axes, shape (5,)

        Raises
        ------
        IndexError
            If there is no such epoch.
        ValueError
            If the epoch has no numbers, or is not in the recording.
        """
        from rigidimeter.core.drawing import plots

        return plots.plot_torque(self, recording, epoch, span_s, axes)

    def __repr__(self) -> str:
        """Return how many epochs there are, and what each condition gives, as one line."""
        included = sum(fit.outcome.included for fit in self.fits)
        fitted = f"{plural(len(self.fits), 'epoch')} by {self.method}, {included} included"
        scored = f"{plural(len(self.scores), 'sinusoid')} scored"
        several = len({fit.condition for fit in self.fits}) > 1
        pooled = [fit for fit in self.pooled if fit.condition or not several]
        of_each = [
            one_line(
                fit.condition,
                ", ".join(
                    f"{p.symbol} {with_error(value, se)} {p.unit}"
                    for p, value, se in zip(PARAMETERS, fit.value, fit.se, strict=True)
                ),
                joint=" ",
            )
            for fit in pooled
        ]
        found = dict.fromkeys(g.first.name for g in self.findings if g.first.level != "note")
        return one_line(
            fitted if self.fits else "",
            scored if self.scores else "",
            *of_each,
            f"findings: {', '.join(found)}" if found else "",
        )

    def _repr_html_(self) -> str:
        """Return J, B and K with their 95 % intervals, what the checks found, and the scores."""
        reason = f": {self.method_reason}" if self.method_reason else ""
        results: tuple[Fit | Score, ...] = (*self.fits, *self.scores)
        names = short_names(one.source for one in results)
        parts = [f"<p>{escape(f'Method {self.method}{reason}.')}</p>"]
        if self.fits:
            heading = ["epoch", "condition"]
            heading += [f"{p.symbol}, {p.unit}" for p in PARAMETERS]
            shown = [*self.fits[:_MAX_SHOWN], *self.pooled]
            heading += ["VAF, %", "outcome", "findings"]
            parts.append(html_table(heading, [_fit_row(fit, names) for fit in shown]))
            parts.append("<p>J, B and K ± one standard error; all epochs: 95\xa0% intervals.</p>")
        if len(self.fits) > _MAX_SHOWN:
            parts.append(f"<p>The first {_MAX_SHOWN} of {len(self.fits)} epochs.</p>")
        if self.findings:
            rows = []
            for first, fits in self.findings:
                where = "all together"
                if fits[0].epoch != "pooled":
                    where = f"{names[fits[0].source]}, {fits[0].epoch}"
                if len(fits) > 1:
                    where = f"{len(fits)}, first {where}"
                rows.append([first.level, where, first.text, first.remedy])
            parts.append("<p>What the checks found:</p>")
            parts.append(html_table(["level", "epochs", "finding in the first", "remedy"], rows))
        if self.scores:
            rows = [
                [
                    f"{names[s.source]}, {s.epoch}",
                    s.condition,
                    with_error(s.impulse_nm_s, 0.0),
                    with_error(s.work_j, 0.0),
                    f"{s.outcome.kind} {s.outcome.reason}",
                ]
                for s in self.scores[:_MAX_SHOWN]
            ]
            heading = ["epoch", "condition", "impulse, N·m·s", "work, J", "outcome"]
            parts.append(html_table(heading, rows))
        return "\n".join(parts)


def _in_a_cell(finding: Finding) -> str:
    return f"{finding.level}, {finding.name}: {finding.text}"


def _fit_row(fit: Fit, names: Mapping[str, str]) -> list[str]:
    pooled = fit.epoch == "pooled"
    numbers = [
        one_cell(with_error(value, se))
        + (f" ({one_cell(interval_text(low, high))})" if pooled else "")
        for value, se, low, high in zip(fit.value, fit.se, fit.low, fit.high, strict=True)
    ]
    name = "all epochs" if pooled else f"{names[fit.source]}, {fit.epoch}"
    outcome = f"{fit.outcome.kind} {fit.outcome.reason}"
    vaf = "–" if math.isnan(fit.vaf_percent) else f"{fit.vaf_percent:.1f}"
    return [name, fit.condition, *numbers, vaf, outcome, ", ".join(fit.doubts)]
