"""Figures and results that need the recordings of the animal, drawn from the virtual study.

The recordings were never published, so the verdict of these rows is that they cannot be computed.
They show the same figure, with the same axes, of data whose origin stands in the figure itself.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from rigidimeter.analysis.estimation import Signals, epoch_signals, scoring_cycles, zero_phase_band
from rigidimeter.analysis.figures import (
    condition_colours,
    distribution_size,
    draw_distribution,
    draw_loops,
    drawn,
    loop_limits,
)
from rigidimeter.analysis.report import Figure
from rigidimeter.analysis.statistics import RankSum, difference, summarise
from rigidimeter.analysis.study import Compared, counting, fit_scores
from rigidimeter.analysis.traces import analysed_epoch, representative_scores, representatives
from rigidimeter.core.words import number, p_value
from rigidimeter.model import Array, ClosedLoopMotion, JointDynamics, closed_loop_motion
from rigidimeter.paper.comparison_table import Claim
from rigidimeter.paper.context import Context
from rigidimeter.paper.paper_figures import torque_traces
from rigidimeter.paper.printed_effects import contrast_of, virtual_ratings

_COLOURS = condition_colours(("OFF", "DBS"))
_MISSING = "The recordings of the animal were not published; "
_VIRTUAL_STUDY = f"{_MISSING}a virtual study of the same design "
_WINDOW_S = (2.0, 12.0)

_PARTS = {
    "fig-4b": ("torque", "measured, estimated and simulated torque"),
    "fig-4c": ("stiffness", "the part of the stiffness, Kθ"),
    "fig-4d": ("damping", "the part of the damping, Bθ′"),
}
"""What of the torque each figure shows."""


def torque_figure(name: str, context: Context) -> Claim:
    """Compare measured, estimated and simulated torque of an OFF epoch, or one part of it.

    Estimated is J, B and K times the measured motion; simulated is the motion that the perturbation
    alone causes in the closed loop, and its torque. All go through one band.
    """
    part, shows = _PARTS[name]
    study = context.study.study
    held = study.analysis.fixed_inertia
    (fit,) = representatives(["OFF"], held, lambda one: one.stiffness_nm_rad)
    joint = JointDynamics(fit.inertia_kg_m2, fit.damping_nm_s_rad, fit.stiffness_nm_rad)
    epoch = analysed_epoch(context.prepared, fit)
    assert epoch is not None  # a fit of the study is of one of its epochs
    measured = epoch_signals(epoch, study.settings, "bandlimited")
    perturbation = epoch.channels["perturbation_nm"]
    motion = closed_loop_motion(perturbation.values, study.settings, joint)

    def as_measured(values: Array) -> Array:
        rate_hz = study.settings.rig.tick_rate_hz
        filtered = zero_phase_band(values, rate_hz, measured.band_hz)
        return np.asarray(np.interp(measured.time_s, perturbation.time_s, filtered))

    estimated = _torque(joint, part, measured)
    simulated = as_measured(_torque(joint, part, motion))
    drawn = {"estimated": estimated, "simulated": simulated}
    text = f"simulated misses estimated by {_missed_percent(simulated, estimated)} % (SD)"
    if part == "torque":
        drawn = {"measured": measured.torque_nm, **drawn}
        missed = _missed_percent(estimated, measured.torque_nm)
        text = f"estimated misses measured by {missed} % (SD), {text}"
    time_s = measured.time_s - float(perturbation.time_s[0])  # the session has begun earlier
    inside = (time_s >= _WINDOW_S[0]) & (time_s <= _WINDOW_S[1])
    shown = f"{_place(name)} from virtual data: {shows}"
    return Claim(
        ours="virtual OFF epoch with the median stiffness "
        f"(J {number(joint.inertia_kg_m2)}, held at the median of all epochs, "
        f"B {number(joint.damping_nm_s_rad)}, K {number(joint.stiffness_nm_rad)}): {text}",
        reading='The paper does not say of which epochs its "median values" are; ours are those '
        "of the epoch that is drawn. Estimated: parameters times measured motion; simulated: the "
        "motion by integration of the perturbation alone; all in one band.",
        unpublished=f"{_MISSING}an epoch of the virtual study stands in.",
        figures=(
            Figure(
                name,
                shown,
                f"{shown} over ten seconds.",
                partial(
                    torque_traces,
                    time_s[inside],
                    {name: values[inside] for name, values in drawn.items()},
                    float(np.max(np.abs(measured.torque_nm[inside]))),  # one scale for all three
                    "OFF",
                ),
            ),
        ),
        virtual=True,
    )


def _torque(joint: JointDynamics, part: str, motion: Signals | ClosedLoopMotion) -> Array:
    if part == "stiffness":
        return joint.stiffness_nm_rad * motion.angle_rad
    if part == "damping":
        return joint.damping_nm_s_rad * motion.velocity_rad_s
    return joint.torque_nm(motion.angle_rad, motion.velocity_rad_s, motion.acceleration_rad_s2)


def _place(name: str) -> str:
    """Return ``Fig. 4(b)`` of ``fig-4b``."""
    return f"Fig. {name[-2]}({name[-1]})"


def _missed_percent(values: Array, wanted: Array) -> str:
    return number(100.0 * float(np.std(wanted - values) / np.std(wanted)), 3)


def measure_figure(name: str, measure: str, context: Context) -> Claim:
    """Compare one measure in OFF and DBS."""
    compared = _comparison(context, measure)
    p, r, by_day = _tests(context, compared)
    medians = " and ".join(
        f"{number(summary.median)} ({condition}, n = {summary.n})"
        for condition, summary in context.study.summaries(measure).items()
    )
    rows = counting(context.study.study.rows, measure)
    values = {name: rows.loc[rows["condition"] == name, "value"].tolist() for name in compared.pair}
    label = f"{compared.measure.title} ({compared.measure.unit})"
    return Claim(
        ours=f"virtual study: medians {medians} {compared.measure.unit}; p = {p}, "
        f"r = {r}; when days count, not epochs, p = {by_day}",
        reading="Two-sided rank-sum test with tie and continuity correction; every epoch a point. "
        f"Beside it, by days: {compared.test}.",
        unpublished=f"{_VIRTUAL_STUDY}stands in for them, with a subject that we chose.",
        figures=(
            Figure(
                name,
                f"{_place(name)} from virtual data: epochs, median and quartiles.",
                f"{label} of every virtual epoch in OFF and DBS, with median and quartiles.",
                partial(
                    drawn,
                    distribution_size(2),
                    draw_distribution,
                    label,
                    values,
                    _COLOURS,
                    f"p = {p} (epochs), {by_day} (days)",
                ),
                "small",
            ),
        ),
        virtual=True,
    )  # fmt: skip


def _comparison(context: Context, measure: str) -> Compared:
    compared = context.study.comparison(measure)
    assert compared is not None  # every virtual study has both tasks
    return compared


def _tests(context: Context, compared: Compared) -> tuple[str, str, str]:
    """Return p and r of the rank-sum test and p by days in words; dashes for too few epochs."""
    ranked = context.study.value_test(compared.measure.name)
    if ranked is None or not isinstance(ranked.statistic, RankSum):
        return "–", "–", p_value(compared.p)
    r = f"{ranked.statistic.r:.2f}".replace("-", "−")
    return p_value(ranked.statistic.p), r, p_value(compared.p)


def figure_5a(context: Context) -> Claim:
    """Compare the ratings, corrected for the examiners."""
    ratings = virtual_ratings(context)
    fit, contrast = ratings.fit, contrast_of(ratings)
    conditions = list(ratings.rows["condition"])
    with_days = fit_scores(ratings.rows, ["examiner", "day"])
    p_days = p_value(difference(with_days, "OFF", "DBS").p_kenward_roger)
    corrected = list(zip(conditions, fit.corrected.tolist(), strict=True))
    values = {
        name: [score for condition, score in corrected if condition == name] for name in _COLOURS
    }
    medians = " and ".join(
        f"{number(summarise(v).median, 3)} ({name}, n = {len(v)})" for name, v in values.items()
    )
    offsets = ", ".join(f"{name} {b:+.2f}" for name, b in fit.offsets["examiner"].items())
    p_paper = p_value(contrast.p_residual)
    return Claim(
        ours=f"virtual ratings: medians {medians}; offsets of the examiners "
        f"{offsets.replace('-', '−')}; contrast DBS − OFF {number(contrast.estimate, 3)}, "
        f"p = {p_paper}; with an offset for every day p = {p_days}",
        unpublished="The ratings were not published; virtual ones of the same number stand in.",
        figures=(
            Figure(
                "fig-5a",
                "Fig. 5(a) from virtual ratings: each rating, median and quartiles.",
                "Corrected virtual ratings in OFF and DBS, with median and quartiles.",
                partial(
                    drawn,
                    distribution_size(2),
                    draw_distribution,
                    "Corrected mUPDRS score",
                    values,
                    _COLOURS,
                    f"p = {p_paper} (paper's model), {p_days} (days)",
                ),
                "small",
            ),
        ),
        virtual=True,
    )


def figure_7(context: Context) -> Claim:
    """Compare torque against angle in the epoch of median work of each condition."""
    study = context.study.study
    chosen = representative_scores(study.analysis, context.study.condition_names)
    epochs = [e for score in chosen if (e := analysed_epoch(context.prepared, score)) is not None]
    cycles = [scoring_cycles(epoch, study.settings.scores) for epoch in epochs]
    works = " and ".join(f"{number(s.work_j, 3)} J ({s.condition})" for s in chosen)
    return Claim(
        ours=f"virtual epochs of median work: {works}; symmetric, since the virtual arm is linear",
        unpublished=f"{_VIRTUAL_STUDY}has no asymmetry: Eq. 3 is linear.",
        figures=tuple(
            Figure(
                f"fig-7-{score.condition.lower()}",
                f"Fig. 7 from virtual data, {score.condition}: the epoch of median work, eight "
                f"cycles, {number(score.work_j, 3)} J a cycle.",
                f"Torque against angle in {score.condition}: eight loops of a virtual epoch.",
                partial(
                    drawn, (3.4, 3.0), draw_loops, [("", one, _COLOURS[score.condition])],
                    loop_limits(cycles), score.condition,
                ),
                "small",
            )
            for score, one in zip(chosen, cycles, strict=True)
        ),
        virtual=True,
    )  # fmt: skip


def median_inertia(context: Context) -> Claim:
    """Show the two stages on the virtual study: J at the median of all epochs, then B and K."""
    analysis = context.study.study.analysis
    counted = [fit for fit in analysis.fixed_inertia if fit.outcome.included]
    damping = float(np.median([fit.damping_nm_s_rad for fit in counted]))
    stiffness = float(np.median([fit.stiffness_nm_rad for fit in counted]))
    return Claim(
        ours=f"median J of {len(analysis.fits)} virtual epochs {number(analysis.inertia_kg_m2)} "
        f"kg·m²; with it held, all epochs together give B {number(damping)} N·m·s/rad and "
        f"K {number(stiffness)} N·m/rad (medians)",
        unpublished=f"{_MISSING}the virtual arm was given the printed inertia, so that its median "
        "confirms nothing.",
        virtual=True,
    )


def table_2(context: Context) -> Claim:
    """Compare the tests of Table 2 with those of the virtual study."""
    parts = [f"mUPDRS p = {p_value(contrast_of(virtual_ratings(context)).p_residual)} (contrast)"]
    for measure in (
        "impulse_nm_s", "work_j", "inertia_kg_m2", "damping_nm_s_rad", "stiffness_nm_rad"
    ):  # fmt: skip
        compared = _comparison(context, measure)
        p, r, by_day = _tests(context, compared)
        parts.append(f"{compared.measure.title} p = {p}, r = {r} ({by_day})")
    return Claim(
        ours="virtual study, in parentheses p when days count: " + "; ".join(parts),
        unpublished=f"{_VIRTUAL_STUDY}shows that the chain from epochs to tests runs, not what DBS "
        "does.",
        virtual=True,
    )
