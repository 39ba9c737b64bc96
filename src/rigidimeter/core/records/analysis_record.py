"""Everything that was computed from a set of epochs, as a table and in a notebook."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import PurePath
from typing import TYPE_CHECKING, Any, NamedTuple

import rigidimeter
from rigidimeter.core.findings import SERIOUS_FIRST, Finding
from rigidimeter.core.records.epochs import Axis
from rigidimeter.core.records.estimates import (
    FIT_NUMBERS,
    PARAMETERS,
    BandEstimate,
    Delay,
    Fit,
    Score,
    degrees,
)
from rigidimeter.core.words import (
    epochs_text,
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
    from matplotlib.axes import Axes
    from numpy.typing import NDArray

_MAX_SHOWN = 20
"""Epochs shown one by one; of more only the first are."""

_READ = (
    "source",
    "epoch",
    "condition",
    *(p.name + ending for p in PARAMETERS for ending in ("", "_se")),
    "angle_rms_rad",
    "vaf_percent",
    "outcome",
)
"""The columns of a table that is read by people; what the checks found is the last."""
MOST_SOURCES = 3
"""The epochs of a finding are named where they are of at most so many recordings."""


INCLUDES_WEIGHT = "includes the slope of the limb's weight"
WEIGHT: Mapping[Axis, str] = {
    "horizontal": f"{INCLUDES_WEIGHT} (not corrected)",
    "unknown": f"{INCLUDES_WEIGHT} unless the axis is vertical",
    "vertical": "",
}
"""What K includes of the limb's weight, by the axis of the joint; after "K"."""

NOT_STATED = "may include limb weight (set diagnostics.axis)"
"""That about an unknown axis, in half a line of a screen."""


def notes_text(names: Iterable[str]) -> str:
    """Return how many notes change nothing, as one line.

    Examples
    --------
    >>> notes_text(["tremor"]), notes_text(["coherence", "tremor"])
    ('1 note, which does not affect J, B, K', '2 notes, none affects J, B, K')
    """
    count = len(set(names))
    return f"{plural(count, 'note')}, " + (
        "which does not affect J, B, K" if count == 1 else "none affects J, B, K"
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

    def __repr__(self) -> str:
        return self.line


def grouped(
    fits: Sequence[Fit], pooled: Sequence[Fit], across: Sequence[Finding] = ()
) -> tuple[FindingGroup, ...]:
    """Return what fits carry, once for each check and level, the most serious first.

    Parameters
    ----------
    fits : sequence of Fit
        Of epochs.
    pooled : sequence of Fit
        To all epochs of a condition, and of all of them.
    across : sequence of Finding
        Of recordings, or of a subject, that no single fit carries.
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
    for finding in across:
        of_one = f" in {finding.condition}" if finding.condition else ""
        whose = f", subject {finding.facts['subject']}" if "subject" in finding.facts else ""
        groups.append(FindingGroup(finding, (), f"all epochs together{of_one}{whose}"))
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
    perturbation was recorded. `across` is what no fit of it carries: of recordings beside each
    other, and of all epochs of a subject where there are several. `axis` is how the joint's axis
    stands, on which depends whether K includes the limb's weight.
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
    across: tuple[Finding, ...] = ()
    axis: Axis = "unknown"

    @property
    def results(self) -> tuple[Fit | Score, ...]:
        """The fits, then the scores."""
        return *self.fits, *self.scores

    @property
    def findings(self) -> tuple[FindingGroup, ...]:
        """What the checks found: for each check and level the epochs, the most serious first."""
        return grouped(self.fits, self.pooled, self.across)

    @property
    def weight_in_stiffness(self) -> str:
        """What K includes of the limb's weight, after "K"; empty where that is nothing."""
        if not any(math.isfinite(fit.stiffness_nm_rad) for fit in self.fits):
            return ""
        if any(group.finding.name == "gravity" for group in self.findings):
            return f"{INCLUDES_WEIGHT} (K without it: note gravity)"
        return WEIGHT[self.axis]

    @property
    def stiffness_words(self) -> str:
        """Which K is given and at what motion, in few words after "K"; empty without a K.

        With several conditions the SD of the angle in each, and the largest range of all.
        """
        if not any(math.isfinite(fit.stiffness_nm_rad) for fit in self.fits):
            return ""
        pooled = [fit for fit in self.pooled if fit.condition] or self.pooled[-1:]
        names = " in {}" if len(pooled) > 1 else ""
        sds = [
            f"{rms}°{names.format(fit.condition)}"
            for fit in pooled
            if (rms := degrees(fit.angle_rms_rad))
        ]
        widest_rad = max(
            (fit.angle_range_rad for fit in self.fits if math.isfinite(fit.angle_range_rad)),
            default=math.nan,
        )
        widest = degrees(widest_rad)
        motion = one_line(
            f"measured at angle SD {', '.join(sds)}" if sds else "",
            f"range up to {widest}°" if widest else "",
            joint=", ",
        )
        weight = self.weight_in_stiffness
        short = NOT_STATED if weight == WEIGHT["unknown"] else weight
        return one_line(short, motion, joint="; ")

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
            J, B and K with their standard errors, the RMS of the angle, the VAF in %, the
            outcome, and the names of the findings that are more than a note.

        Returns
        -------
        pandas.DataFrame
        """
        import pandas as pd

        if full or not self.fits:
            return pd.DataFrame(self.rows())
        rows = [
            {name: row[name] for name in _READ} | {"findings": ", ".join(fit.cautions)}
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
        return rigidimeter.plot(self, axes=axes)

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
        options = {"recording": recording, "epoch": epoch, "span_s": span_s, "axes": axes}
        return rigidimeter.plot(self, "torque", **options)

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
        found = dict.fromkeys(g.finding.name for g in self.findings if g.finding.level != "note")
        return one_line(
            fitted if self.fits else "",
            scored if self.scores else "",
            *of_each,
            f"findings: {', '.join(found)}" if found else "",
        )

    def _repr_html_(self) -> str:
        """Return J, B and K with their 95 % intervals, what the checks found, and the scores."""
        reason = f": {self.method_reason}" if self.method_reason else ""
        results = self.results
        names = short_names(one.source for one in results)
        parts = [f"<p>{escape(f'Method {self.method}{reason}.')}</p>"]
        if self.fits:
            heading = ["epoch", "condition"]
            heading += [f"{p.symbol}, {p.unit}" for p in PARAMETERS]
            shown = [*self.fits[:_MAX_SHOWN], *self.pooled]
            heading += ["angle SD, °", "VAF, %", "outcome", "findings"]
            parts.append(html_table(heading, [_fit_row(fit, names) for fit in shown]))
            about = "J, B and K ± one standard error; all epochs: 95\xa0% intervals."
            which = f" K {escape(self.stiffness_words)}." if self.stiffness_words else ""
            parts.append(f"<p>{about}{which}</p>")
        if len(self.fits) > _MAX_SHOWN:
            parts.append(f"<p>The first {_MAX_SHOWN} of {len(self.fits)} epochs.</p>")
        if self.findings:
            told = [group for group in self.findings if not group.finding.harmless]
            rows = [
                [one.level, one.name, one.headline, where, one.details, one.remedy]
                for one, _, where in told
            ]
            if quiet := [g.finding.name for g in self.findings if g.finding.harmless]:
                rows.append(
                    ["note", "", notes_text(quiet), "", ", ".join(dict.fromkeys(quiet)), ""]
                )
            heading = ["level", "finding", "", "epochs", "details", "remedy"]
            parts.append("<p>What the checks found:</p>")
            parts.append(html_table(heading, rows))
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
    return f"{finding.level}, {finding.name}: {finding.headline}"


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
    angle = degrees(fit.angle_rms_rad) or "–"
    return [name, fit.condition, *numbers, angle, vaf, outcome, ", ".join(fit.cautions)]
