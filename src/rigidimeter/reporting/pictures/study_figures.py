"""The figures of a study folder: effects, days, ratings, and what depends on the method."""

from __future__ import annotations

from rigidimeter.reporting.figures import condition_colours, condition_markers
from rigidimeter.reporting.figures.day_points import DayStrip, days
from rigidimeter.reporting.figures.forest import Effect, forest
from rigidimeter.reporting.figures.method_sensitivity import Road, sensitivity
from rigidimeter.reporting.figures.rating_points import Mark, Mean, ratings
from rigidimeter.reporting.measures import condition_name
from rigidimeter.reporting.numbers import interval, number
from rigidimeter.reporting.pictures.stored_figure import Picture, drawn
from rigidimeter.statistics import largest_r
from rigidimeter.study import StudyResult

__all__ = ["day_pictures", "effect_pictures", "rating_pictures", "sensitivity_pictures"]


def effect_pictures(study: StudyResult) -> list[Picture]:
    """Return the effect sizes of all measures of a study folder in one figure."""
    found = [(c.measure, e) for c in study.comparisons if (e := c.effects) is not None]
    if not study.sessions or not found:
        return []
    rows = [
        Effect(
            measure.title,
            f"n = {e.test.n_x} and {e.test.n_y}",
            e.r,
            e.r_low,
            e.r_high,
            largest_r(e.test.n_x, e.test.n_y),
            f"{number(e.r, 2)} {interval(e.r_low, e.r_high, 2)}",
        )
        for measure, e in found
    ]
    percent = f"{100 * found[0][1].confidence:g} %"
    told = "; ".join(f"{row.name} {row.words}" for row in rows)
    return [
        Picture(
            "effects",
            drawn(
                study,
                forest(
                    rows, f"Effect size r; above zero: {study.reference} larger than {study.other}"
                ),
            ),
            f"Effect sizes r with {percent} intervals. {told}.",
            f"Effect sizes r with {percent} intervals, whole days resampled. Dotted: what is "
            "called small (0.1), medium (0.3) and large (0.5). Grey ticks: the largest r that "
            "these group sizes allow, which differs between measures.",
        )
    ]


def day_pictures(study: StudyResult) -> list[Picture]:
    """Return each measure day by day, in the order of the sessions."""
    order = [condition_name(name) for name in study.condition_names]
    colours, markers = condition_colours(order), condition_markers(order)
    visits = dict.fromkeys((s.subject, s.day, s.condition) for s in study.sessions)
    pictures = []
    for c in study.comparisons:
        medians = {(d.subject, d.day, d.condition): d for d in c.day_medians}
        shown = [
            DayStrip(
                m.subject,
                m.day,
                condition_name(m.condition),
                [o.value for o in c.of(m.condition) if (o.subject, o.day) == (m.subject, m.day)],
                m.median,
                m.q1,
                m.q3,
            )
            for visit in visits
            if (m := medians.get(visit))
        ]
        if not shown:
            continue
        title, unit = c.measure.title, c.measure.unit
        told = "; ".join(
            f"{s.subject} day {s.day} {s.condition}: median {number(s.median)}, n = {len(s.values)}"
            for s in shown
        )
        count = sum(len(s.values) for s in shown)
        pictures.append(
            Picture(
                f"days_{c.measure.name}",
                drawn(study, days(f"{title}\n({unit})", shown, colours, markers)),
                f"{title} by day. {told} ({unit}).",
                f"{title}: {count} included epochs of {len({s[:2] for s in shown})} days.",
            )
        )
    return pictures


def rating_pictures(study: StudyResult) -> list[Picture]:
    """Return the examiners' scores with the means of the model."""
    found = study.ratings
    if found is None:
        return []
    marks = [
        Mark(condition_name(row[0]), row[1], row[4], value)
        for row, value in zip(found.rows, found.fit.corrected.tolist(), strict=True)
    ]
    means = {condition_name(m.condition): Mean(m.mean, m.low, m.high) for m in found.means}
    order = [condition_name(name) for name in (*study.condition_names, *found.fit.conditions)]
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


def sensitivity_pictures(study: StudyResult) -> list[Picture]:
    """Return the shift of each measure by method and by how J was treated."""
    if not study.sensitivity:
        return []
    roads: dict[str, list[Road]] = {}
    for row in study.sensitivity:
        roads.setdefault(row.measure.label, []).append(
            Road(
                row.method,
                row.inertia == "fixed",
                row.shift,
                row.shift_low,
                row.shift_high,
                row.chosen,
            )
        )
    told = "; ".join(
        f"{row.measure.title}, {row.method}, J {row.inertia}: {number(row.shift, 3)} "
        f"{interval(row.shift_low, row.shift_high, 3)} {row.measure.unit}"
        for row in study.sensitivity
    )
    return [
        Picture(
            "sensitivity",
            drawn(study, sensitivity(roads, f"Shift, {study.reference} − {study.other}")),
            f"Shifts by method. {told}.",
            "The Hodges–Lehmann shift with its interval by each method, in the unit above the "
            "panel. Filled squares: J held at its median; open circles: J fitted in each epoch. "
            "Black: what this report uses.",
        )
    ]
