"""The conclusions as one JSON document and as tables: every number, unrounded.

A table of one name has the same rows and columns wherever it is written. Two analyses of the same
inputs give the same bytes: neither time nor place is written down.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict
from typing import Any

from rigidimeter.analysis.reading import estimates_document
from rigidimeter.analysis.study.compared import comparison_rows, comparison_values, measure_names
from rigidimeter.analysis.study.conclusions import conclusion_rows, reasons
from rigidimeter.analysis.study.deviations import deviation_words, without_deviating
from rigidimeter.analysis.study.rating_relation import relations
from rigidimeter.analysis.study.ratings_found import (
    RatingsFound,
    rating_contrast,
    rating_offsets,
    rating_rows,
    ratings_document,
)
from rigidimeter.analysis.study.reached_precision import precision_rows
from rigidimeter.analysis.study.results import StudyResult
from rigidimeter.analysis.study.statements import lead, statements
from rigidimeter.analysis.study.traffic_light import traffic_light
from rigidimeter.core.files import csv_text, plain_values
from rigidimeter.core.records import AMPLITUDE

COMPARISON_SCHEMA = "rigidimeter.comparison/3"

Rows = Sequence[Mapping[str, Any]]

_BY = ("protocol", "check", "estimate", "operator")


def comparison_document(result: StudyResult, place: str = "") -> dict[str, Any]:
    """Return every conclusion as plain values; what does not exist is null.

    `place` is the study's folder as sentences name it; it is taken out of them.
    """
    analysis = result.analysis
    light = traffic_light(result)
    of_result = ("title", "source", "by", "reference", "other", "seed", "resamples", "blinded",
                 "virtual")  # fmt: skip
    document = {
        "schema": COMPARISON_SCHEMA,
        **{name: getattr(result, name) for name in of_result},
        **{name: result_table(result, name) for name in ("conditions", "sessions", "left_out")},
        "method": analysis.method,
        "method_reason": analysis.method_reason,
        "inertia_kg_m2": analysis.inertia_kg_m2,
        "inertia_by_subject": result.several_subjects,
        "lead": lead(result),
        "statements": [
            {"reference": pair.reference, "other": pair.other, **said._asdict()}
            for pair in (result, *result.further_pairs)
            if (said := statements(pair)) is not None
        ],
        "primary": result.primary.row(c.measure for c in result.comparisons),
        "conclusion": result_table(result, "conclusion"),
        "reasons": [
            reason.row() | {"measures": measures} for reason, _, measures in reasons(result)
        ],
        "quality": None if light is None else light.row(),
        "comparisons": [
            comparison_values(comparison) for comparison in (*result.comparisons, *result.further)
        ],
        "days": result_table(result, "days"),
        "effect_differences": result_table(result, "effect_differences"),
        "plan": {
            "words": deviation_words(result),
            "deviations": result_table(result, "deviations"),
            "without_deviating": result_table(result, "without_deviating"),
        },
        "ratings": None if result.ratings is None else ratings_document(result.ratings),
        "rating_relation": result_table(result, "rating_relation"),
        "sensitivity": result_table(result, "sensitivity"),
        "exclusions": result_table(result, "excluded_epochs"),
        "notices": [
            {"level": notice.level, "text": notice.text.replace(f"{place}/", "")}
            if place
            else asdict(notice)
            for notice in result.notices
        ],
    }
    plain = plain_values(document)
    assert isinstance(plain, dict)
    return plain


def result_table(result: StudyResult, name: str) -> Rows:
    """Return one of the tables of conclusions; the others are not made."""
    return TABLES[name](result)


def result_tables(result: StudyResult) -> dict[str, Rows]:
    """Return every table of conclusions by name; some have no rows."""
    return {name: make(result) for name, make in TABLES.items()}


def _days(result: StudyResult) -> Iterator[dict[str, Any]]:
    for c in result.comparisons:
        for day in c.day_medians:
            yield {"measure": c.measure.name} | asdict(day)


def _effect_differences(result: StudyResult) -> Iterator[dict[str, Any]]:
    titles = {c.measure.name: c.measure.title for c in result.comparisons}
    for pair in result.differences:
        yield {
            "first": pair.first,
            "second": pair.second,
            "first_title": titles[pair.first],
            "second_title": titles[pair.second],
            **asdict(pair.difference),
            "p_holm": pair.p_holm,
        }


def _of_ratings(
    result: StudyResult, rows: Callable[[RatingsFound], Iterable[dict[str, Any]]]
) -> list[dict[str, Any]]:
    return [] if result.ratings is None else list(rows(result.ratings))


def _sensitivity(result: StudyResult) -> Iterator[dict[str, Any]]:
    for row in result.sensitivity:
        yield measure_names(row.measure) | vars(row) | {"measure": row.measure.name}


def _summaries(result: StudyResult) -> Iterator[dict[str, Any]]:
    for c in result.comparisons:
        for name in (name for name in result.condition_names if name in c.summaries):
            summary = c.summaries[name]
            if summary.n or c.excluded[name]:
                counts = {"condition": name, "n": summary.n, "excluded": c.excluded[name]}
                yield measure_names(c.measure) | counts | asdict(summary)


def _conditions(result: StudyResult) -> Iterator[dict[str, Any]]:
    """Yield each condition; a code without its stimulation, which would give it away."""
    for condition in result.conditions:
        mine = [each for each in result.sessions if each.condition == condition.name]
        days = len({(each.subject, each.day) for each in mine})
        about = asdict(condition)
        del about["simulated"]  # the conclusions have it beside each estimate
        if result.blinded:
            about = dict.fromkeys(about) | {"name": condition.name}
        yield about | {"days": days, "sessions": len(mine)}


def _account(result: StudyResult) -> Iterator[dict[str, Any]]:
    """Yield for each task and condition what was recorded, what counts, and who left out the rest.

    `unlisted` are epochs that neither count nor are among the exclusions.
    """
    if not result.sessions:
        return
    analysis = result.analysis
    counted = {
        "prbs": {(f.source, f.epoch) for f in analysis.fixed_inertia if f.outcome.included},
        "sinusoid": {(s.source, s.epoch) for s in analysis.scores if s.outcome.included},
    }
    fitted = {(fit.source, fit.epoch) for fit in analysis.fits}
    out = {(e.source, e.epoch): e.by for e in reversed(result.exclusions)}
    for task, included in counted.items():
        for condition in result.condition_names:
            recorded = {
                key
                for epoch in result.epochs
                for key in [(epoch.source, epoch.label)]
                if epoch.condition == condition
                and (epoch.task or ("prbs" if key in fitted else "sinusoid")) == task
            }
            if not recorded:
                continue
            by: list[str] = [out[key] for key in recorded & out.keys()]
            counts = len(recorded & included - out.keys())
            yield {
                "task": task,
                "condition": condition,
                "recorded": len(recorded),
                "included": counts,
                **{f"by_{name}": by.count(name) for name in _BY},
                "unlisted": len(recorded) - counts - len(by),
            }


def _estimates(result: StudyResult) -> Iterator[dict[str, Any]]:
    """Yield each fit with subject and day, and the fit at fixed inertia beside it."""
    whose = _whose(result)
    estimates = estimates_document(result.analysis)
    fixed = estimates["fixed_inertia"]["epochs"]
    for fit, one, two in zip(result.analysis.fits, estimates["epochs"], fixed, strict=True):
        if fit.activity is not None:
            one |= plain_values(fit.activity.row())  # the stretches as a text
        low_hz, high_hz = one.pop("band_hz") or (None, None)
        findings = one.pop("findings")
        found = [finding["name"] for finding in findings]
        cautions = dict.fromkeys(f["name"] for f in findings if f["level"] != "note")
        # A number that does not exist is null.
        numbers = [name for name in two if isinstance(two[name], float | None)]
        same = ("band_hz", *AMPLITUDE)
        beside = {name: two[name] for name in ("outcome", "reason", *numbers) if name not in same}
        yield (
            whose.get(one["source"], {})
            | one
            | {"band_low_hz": low_hz, "band_high_hz": high_hz}
            | {"n_findings": len(found), "findings": ", ".join(found)}
            | {"cautions": ", ".join(cautions)}
            | {f"fixed_inertia_{name}": value for name, value in beside.items()}
        )


def _scores(result: StudyResult) -> Iterator[dict[str, Any]]:
    whose = _whose(result)
    for row in estimates_document(result.analysis)["scores"]:
        cells = {name: one for name, one in row.items() if not isinstance(one, (list, dict))}
        yield whose.get(row["source"], {}) | cells


def _whose(result: StudyResult) -> dict[str, dict[str, str]]:
    return {s.source: {"subject": s.subject, "day": s.day} for s in result.sessions}


TABLES: Mapping[str, Callable[[StudyResult], Rows]] = {
    "conclusion": conclusion_rows,
    "precision": precision_rows,
    "comparisons": lambda result: comparison_rows((*result.comparisons, *result.further)),
    "summaries": lambda result: list(_summaries(result)),
    "days": lambda result: list(_days(result)),
    "effect_differences": lambda result: list(_effect_differences(result)),
    "ratings": lambda result: _of_ratings(result, rating_rows),
    "rating_offsets": lambda result: _of_ratings(result, rating_offsets),
    "rating_contrast": lambda result: _of_ratings(result, rating_contrast),
    "rating_relation": lambda result: [one.row() for one in relations(result)],
    "sensitivity": lambda result: list(_sensitivity(result)),
    "conditions": lambda result: list(_conditions(result)),
    "sessions": lambda result: [asdict(session) for session in result.sessions],
    "excluded_epochs": lambda result: [asdict(exclusion) for exclusion in result.exclusions],
    "left_out": lambda result: [asdict(out) for out in result.left_out],
    "deviations": lambda result: [asdict(one) for one in result.deviations],
    "without_deviating": without_deviating,
    "account": lambda result: list(_account(result)),
    "estimates": lambda result: list(_estimates(result)),
    "scores": lambda result: list(_scores(result)),
}
"""The tables of conclusions by name, each made alone."""


def table_csv(rows: Rows) -> str:
    """Return a table as CSV; a column is there if any row has it."""
    return csv_text(columns_of_rows(rows), rows)


def columns_of_rows(rows: Rows) -> list[str]:
    """Return the columns of a table, in their order."""
    return list(dict.fromkeys(name for row in rows for name in row))
