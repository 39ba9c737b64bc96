"""Each measure in each condition, every included epoch a point."""

from __future__ import annotations

from rigidimeter.reporting.figures import condition_colours, distribution
from rigidimeter.reporting.measures import Measure, condition_name, conditions, measures
from rigidimeter.reporting.numbers import interval, number, p_and_r
from rigidimeter.reporting.pictures.stored_figure import Picture, drawn
from rigidimeter.statistics import summarise
from rigidimeter.study import Study

__all__ = ["distribution_pictures"]


def distribution_pictures(study: Study) -> list[Picture]:
    """Return a figure for each measure that has an included value."""
    colours = condition_colours(conditions(study))
    return [
        Picture(
            f"distribution_{measure.name}",
            drawn(
                study,
                distribution(
                    measure.label,
                    {condition_name(key): values for key, values in measure.values.items()},
                    {condition_name(key): colour for key, colour in colours.items()},
                    _test_remark(study, measure),
                    ends={
                        condition_name(key): [(e.low, e.high) for e in found]
                        for key, found in measure.estimates.items()
                    },
                    pooled={condition_name(key): e for key, e in measure.pooled.items()},
                ),
            ),
            f"{measure.title}, every included epoch a point. {_in_words(measure)}",
            f"{measure.title}.",
        )
        for measure in measures(study)
        if any(measure.values.values())
    ]


def _test_remark(study: Study, measure: Measure) -> str:
    tests = [c.test for c in study.comparisons if c.measure == measure.name]
    if len(tests) != 1 or tests[0] is None:
        return ""
    return p_and_r(tests[0].p, tests[0].r)


def _in_words(measure: Measure) -> str:
    parts = []
    for condition, values in measure.values.items():
        s = summarise(values)
        text = f"{condition_name(condition)}: n = {s.n}"
        if s.n:
            text += f", median {number(s.median)}, quartiles {number(s.q1)} to {number(s.q3)}"
        if condition in measure.pooled:
            pooled = measure.pooled[condition]
            text += f", all together {number(pooled.value)} {interval(pooled.low, pooled.high)}"
        parts.append(text)
    return f"{'; '.join(parts)} ({measure.unit})."
