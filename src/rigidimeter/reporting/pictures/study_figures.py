"""The figures of a study folder: effects, days, ratings, and what depends on the method."""

from __future__ import annotations

from rigidimeter.records import Fit, Score
from rigidimeter.reporting.figures import condition_colours, condition_markers
from rigidimeter.reporting.figures.day_points import DayStrip, days
from rigidimeter.reporting.figures.forest import Effect, forest
from rigidimeter.reporting.figures.method_sensitivity import Road, sensitivity
from rigidimeter.reporting.figures.rating_points import Mark, Mean, ratings
from rigidimeter.reporting.measures import condition_name, conditions
from rigidimeter.reporting.numbers import interval, number
from rigidimeter.reporting.pictures.stored_figure import Picture, drawn
from rigidimeter.reporting.test_tables import compared_pair, mean_interval, sorted_rows
from rigidimeter.statistics import largest_r
from rigidimeter.study import MEASURES, Study

__all__ = ["day_pictures", "effect_pictures", "rating_pictures", "sensitivity_pictures"]


def effect_pictures(study: Study) -> list[Picture]:
    """Return the effect sizes of all measures in one figure."""
    cohort = study.cohort
    if cohort is None or not cohort.effects:
        return []
    rows = [
        Effect(
            e.title,
            f"n = {e.effects.test.n_x} and {e.effects.test.n_y}",
            e.effects.r,
            e.effects.r_low,
            e.effects.r_high,
            largest_r(e.effects.test.n_x, e.effects.test.n_y),
            f"{number(e.effects.r, 2)} {interval(e.effects.r_low, e.effects.r_high, 2)}",
        )
        for e in cohort.effects
    ]
    percent = f"{100 * cohort.effects[0].effects.confidence:g} %"
    reference, other = compared_pair(study) or ("the reference", "the other")
    told = "; ".join(f"{e.title} {row.words}" for e, row in zip(cohort.effects, rows, strict=True))
    return [
        Picture(
            "effects",
            drawn(
                study,
                forest(rows, f"Effect size r; above zero: {reference} larger than {other}"),
            ),
            f"Effect sizes r with {percent} intervals. {told}.",
            f"Effect sizes r with {percent} intervals, whole days resampled. Dotted: what is "
            "called small (0.1), medium (0.3) and large (0.5). Grey ticks: the largest r that "
            "these group sizes allow, which differs between measures.",
        )
    ]


def day_pictures(study: Study) -> list[Picture]:
    """Return each measure day by day."""
    cohort = study.cohort
    if cohort is None:
        return []
    order = [condition_name(name) for name in conditions(study)]
    colours, markers = condition_colours(order), condition_markers(order)
    medians = {(d.measure, d.subject, d.day, d.condition): d for d in cohort.days}
    pictures = []
    for measure in MEASURES:
        strips: dict[tuple[str, str, str], list[float]] = {}
        results: list[Fit | Score] = list(measure.results(study.analysis))
        for session in cohort.sessions:
            strips.setdefault((session.subject, session.day, session.condition), []).extend(
                float(getattr(result, measure.name))
                for result in results
                if result.source == session.source
                and result.condition == session.condition
                and result.outcome.included
            )
        shown = [
            DayStrip(subject, day, condition_name(condition), values, m.median, m.q1, m.q3)
            for (subject, day, condition), values in strips.items()
            if (m := medians.get((measure.name, subject, day, condition))) and values
        ]
        if not shown:
            continue
        label = f"{measure.title}\n({measure.unit})"
        figure = days(label, shown, colours, markers)
        told = "; ".join(
            f"{s.subject} day {s.day} {s.condition}: median {number(s.median)}, n = {len(s.values)}"
            for s in shown
        )
        count = sum(len(s.values) for s in shown)
        pictures.append(
            Picture(
                f"days_{measure.name}",
                drawn(study, figure),
                f"{measure.title} by day. {told} ({measure.unit}).",
                f"{measure.title}: {count} included epochs of {len({s[:2] for s in shown})} days.",
            )
        )
    return pictures


def rating_pictures(study: Study) -> list[Picture]:
    """Return the examiners' scores with the means of the model."""
    if study.cohort is None or study.cohort.ratings is None:
        return []
    found = study.cohort.ratings
    marks = [
        Mark(condition_name(row[0]), row[1], row[4], value)
        for row, value in zip(found.rows, found.fit.corrected.tolist(), strict=True)
    ]
    means = {
        condition_name(name): Mean(*mean_interval(found, name)) for name in found.fit.conditions
    }
    order = [condition_name(name) for name in (*conditions(study), *found.fit.conditions)]
    told = "; ".join(
        f"{name} {number(mean.value, 3)} {interval(mean.low, mean.high, 3)}"
        for name, mean in means.items()
    )
    return [
        Picture(
            "ratings",
            drawn(study, ratings(marks, means, condition_colours(order), "95 % interval")),
            f"Examiners' scores as given and corrected. Means of the model: {told}.",
            f"All {len(marks)} scores, at the left as given and at the right less each examiner’s "
            "predicted offset; equal scores stand side by side. Bars: means of the model with 95 % "
            "intervals.",
        )
    ]


def sensitivity_pictures(study: Study) -> list[Picture]:
    """Return the shift of each measure by method and by how J was treated."""
    cohort = study.cohort
    if cohort is None or not cohort.sensitivity:
        return []
    roads: dict[str, list[Road]] = {}
    for row in sorted_rows(cohort.sensitivity):
        roads.setdefault(f"{row.title} ({row.unit})", []).append(
            Road(
                row.method,
                row.inertia == "fixed",
                row.shift,
                row.shift_low,
                row.shift_high,
                row.chosen,
            )
        )
    reference, other = compared_pair(study) or ("the reference", "the other")
    told = "; ".join(
        f"{row.title}, {row.method}, J {row.inertia}: {number(row.shift, 3)} "
        f"{interval(row.shift_low, row.shift_high, 3)} {row.unit}"
        for row in cohort.sensitivity
    )
    return [
        Picture(
            "sensitivity",
            drawn(study, sensitivity(roads, f"Shift, {reference} − {other}")),
            f"Shifts by method. {told}.",
            "The Hodges–Lehmann shift with its interval by each method, in the unit above the "
            "panel. Filled squares: J held at its median; open circles: J fitted in each epoch. "
            "Black: what this report uses.",
        )
    ]
