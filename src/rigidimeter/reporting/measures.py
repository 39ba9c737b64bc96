"""Names as people read them, and the one sentence that sums a result up."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import PurePath

from rigidimeter.reporting.numbers import number, p_and_r
from rigidimeter.study import Comparison, StudyResult, verdict

__all__ = ["condition_name", "epoch_verdict", "lower_first", "short_names"]


def condition_name(condition: str) -> str:
    """Return the condition as people read it."""
    return condition or "(no condition)"


def lower_first(title: str) -> str:
    """Return a title as it stands within a sentence."""
    return title[:1].lower() + title[1:]


def short_names(sources: Iterable[str]) -> dict[str, str]:
    """Return the last parts of each path: as few as distinguish the sources."""
    unique = list(dict.fromkeys(sources))
    parts = {source: PurePath(source).parts for source in unique}
    for depth in range(1, max(map(len, parts.values()), default=1) + 1):
        names = {source: "/".join(parts[source][-depth:]) or source for source in unique}
        if len(set(names.values())) == len(unique):
            return names
    return {source: source for source in unique}


def epoch_verdict(study: StudyResult) -> str:
    """Return in a line what the epochs show, each counted as an observation."""
    prefix = "Virtual subject. " if any(epoch.virtual for epoch in study.epochs) else ""
    found = verdict(study, days=False)
    if found is not None:
        groups = {
            "lower": found.lower,
            "higher": found.higher,
            "no difference shown in": found.undecided,
        }
        parts = [f"{heading} {_tested(members)}" for heading, members in groups.items() if members]
        reference, other = condition_name(study.reference), condition_name(study.other)
        return f"{prefix}{other} against {reference}: {'; '.join(parts)}."
    medians = [
        text for name in study.condition_names if (text := _medians(name, study.comparisons))
    ]
    if medians:
        return f"{prefix}No comparison of conditions. Medians, {'; '.join(medians)}."
    return f"{prefix}No epoch could be included; the reasons are listed under “Exclusions”."


def _tested(comparisons: Sequence[Comparison]) -> str:
    return ", ".join(
        f"{lower_first(c.measure.title)} ({p_and_r(c.test.p, c.test.r)})"
        for c in comparisons
        if c.test is not None
    )


def _medians(condition: str, comparisons: Sequence[Comparison]) -> str:
    medians = [
        f"{c.measure.title} {number(s.median)} {c.measure.unit} (n = {s.n})"
        for c in comparisons
        if (s := c.summaries.get(condition)) is not None and s.n
    ]
    return f"{condition_name(condition)}: {', '.join(medians)}" if medians else ""
