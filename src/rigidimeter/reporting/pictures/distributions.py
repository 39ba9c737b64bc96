"""Each measure in each condition, every included epoch a point."""

from __future__ import annotations

from rigidimeter.reporting.figures import condition_colours, distribution
from rigidimeter.reporting.measures import condition_name
from rigidimeter.reporting.numbers import interval, number, p_and_r
from rigidimeter.reporting.pictures.stored_figure import Picture, drawn
from rigidimeter.study import Comparison, StudyResult

__all__ = ["distribution_pictures"]


def distribution_pictures(study: StudyResult) -> list[Picture]:
    """Return a figure for each measure of the epochs that has an included value."""
    colours = condition_colours(study.condition_names)
    return [
        Picture(
            f"distribution_{c.measure.name}",
            drawn(
                study,
                distribution(
                    c.measure.label,
                    {condition_name(key): values for key, values in c.values.items()},
                    {condition_name(key): colour for key, colour in colours.items()},
                    p_and_r(c.test.p, c.test.r) if c.test is not None else "",
                    ends={
                        condition_name(key): [(e.low, e.high) for e in c.of(key)]
                        for key in c.summaries
                    },
                    pooled={
                        condition_name(key): (e.value, e.low, e.high) for key, e in c.pooled.items()
                    },
                ),
            ),
            f"{c.measure.title}, every included epoch a point. {_in_words(c)}",
            f"{c.measure.title}.",
        )
        for c in study.comparisons
        if c.observations and c.measure.origin != "ratings"
    ]


def _in_words(c: Comparison) -> str:
    parts = []
    for condition, s in c.summaries.items():
        text = f"{condition_name(condition)}: n = {s.n}"
        if s.n:
            text += f", median {number(s.median)}, quartiles {number(s.q1)} to {number(s.q3)}"
        if condition in c.pooled:
            pooled = c.pooled[condition]
            text += f", all together {number(pooled.value)} {interval(pooled.low, pooled.high)}"
        parts.append(text)
    return f"{'; '.join(parts)} ({c.measure.unit})."
