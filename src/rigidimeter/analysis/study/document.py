"""What a study concludes as tables and as one document: every number, unrounded.

A table of one name has the same rows and columns wherever it is written. Two analyses of the same
inputs give the same bytes: neither time nor place is written down.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, fields
from typing import TYPE_CHECKING, Any

from rigidimeter.analysis.statistics import DayDifference, RankSum, Summary, summarise
from rigidimeter.analysis.study.compared import Compared
from rigidimeter.analysis.study.comparisons import (
    OfMethod,
    method_caveats,
    precisions_of_each,
    without_deviating,
)
from rigidimeter.analysis.study.estimate_cells import estimate_cells, score_cells
from rigidimeter.analysis.study.measures import MEASURE_NAMES, RATING, Measure
from rigidimeter.analysis.study.rating_document import (
    rating_contrast,
    rating_offsets,
    rating_rows,
    ratings_document,
    relations,
)
from rigidimeter.analysis.study.rows import counting, measures_of, recorded
from rigidimeter.analysis.study.sentences import deviation_sentence, lead, statements
from rigidimeter.analysis.study.study import Ratings, Study
from rigidimeter.analysis.study.verdicts import reasons, traffic_light
from rigidimeter.core.files import csv_text, plain_values
from rigidimeter.core.records import Fit, Score
from rigidimeter.core.words import within

if TYPE_CHECKING:
    from rigidimeter.analysis.study.results import StudyResult

Rows = Sequence[Mapping[str, Any]]

TEST = "Wilcoxon rank-sum, two-sided, asymptotic, tie and continuity corrected"

COMPARISON_SCHEMA = "rigidimeter.comparison/3"

_IN_DOCUMENT = ("conditions", "sessions", "left_out", "conclusion", "days", "effect_differences",
                "deviations", "rating_relation", "sensitivity", "excluded_epochs")  # fmt: skip
_RANKS = tuple(one.name for one in fields(RankSum))
_SIZES = ("r_low", "r_high", "rank_biserial", "rank_biserial_low", "rank_biserial_high")
_SUMMARY = ("median", "q1", "q3", "sd_percent")
_EXCLUDED_BY = ("protocol", "check", "estimate", "operator")


def conclusion_rows(
    concluded: Iterable[Compared], methods: Sequence[OfMethod] = ()
) -> list[dict[str, Any]]:
    """Return what is concluded as rows of a document."""
    caveats = method_caveats(methods)
    return [
        {
            **one.measure.names,
            "reference": one.reference,
            "other": one.other,
            "verdict": one.verdict,
            **one.numbers(),
            "p_holm": one.p_adjusted,
            "role": one.role,
            "adjusted_for": one.family.tests,
            "level": one.family.level,
            "half_width": one.half_width,
            "wanted_percent": one.wanted_percent,
            "tested_by": one.by,
            "test": one.test,
            "reason": one.reason,
            "finding": "" if one.finding is None else one.finding.name,
            "caution": "" if one.caution is None else within(one.caution.headline),
            **_needed(one),
            "caveat": caveats.get(one.measure.name, ""),
            **_simulated(one),
        }
        for one in concluded
    ]


def _needed(one: Compared) -> dict[str, Any]:
    number, unit = one.needed or (None, "")
    of_days = number if unit == "day" else None
    return {"days_to_decide": of_days, "units_to_decide": number, "unit_to_decide": unit}


def _simulated(one: Compared) -> dict[str, float]:
    if one.simulated is None:
        return {}
    names = ("reference", "other", "difference", "difference_percent")
    cells = (*one.simulated, *one.simulated_difference)
    return {f"simulated_{name}": cell for name, cell in zip(names, cells, strict=True)}


def comparison_values(result: StudyResult) -> list[dict[str, Any]]:
    """Return each measure in each pair of conditions: summaries, rank-sum test, test by days."""
    days = _by_days(result)
    return [
        {
            **one.measure.names,
            "reference": one.reference,
            "other": one.other,
            "groups": {
                name: asdict(own) | {"excluded": excluded}
                for name, (own, excluded) in summaries_of(result.study, one.measure.name).items()
                if name in (one.reference, one.other)
            },
            "test": TEST,
            **_tested(result, one),
            "remark": one.remark,
            "days": days.get((one.measure, one.other)),
        }
        for one in result.values
    ]


def comparison_rows(result: StudyResult) -> list[dict[str, Any]]:
    """Return the same as a table, one row for each measure and pair."""
    rows = []
    for values in comparison_values(result):
        groups, days = values.pop("groups"), values.pop("days")
        del values["test"]
        row = {name: values.pop(name) for name in (*MEASURE_NAMES, "reference", "other")}
        for side in ("reference", "other"):
            own = groups.get(row[side], {})
            row |= {f"{name}_{side}": own.get(name) for name in ("n", "excluded", *_SUMMARY)}
        row |= values
        for name, value in (days or {}).items():
            cell = " + ".join(value) if name == "offsets" else value
            row[name if name.startswith("days_") else f"days_{name}"] = cell
        rows.append(row)
    return rows


def summaries_of(study: Study, measure: str) -> dict[str, tuple[Summary, int]]:
    """Return the summary of the values that count, and how many do not, by condition.

    The compared conditions come first.
    """
    every = recorded(study.rows, measure)
    compared = study.pair if study.other else (study.reference,)
    found = {}
    for name in dict.fromkeys([*compared, *every["condition"]]):
        own = every[every["condition"] == name]
        included = own["outcome"] == "included"
        summary = summarise(own.loc[included, "value"].to_numpy())
        found[name] = summary, int((~included).sum())
    return found


def _tested(result: StudyResult, one: Compared) -> dict[str, Any]:
    sizes = result.effects.get(one.measure.name) if one.other == result.study.other else None
    return {
        **{name: getattr(one.statistic, name, None) for name in _RANKS},
        "p_holm": one.p_adjusted,
        **{name: getattr(sizes, name, None) for name in _SIZES},
        "interval_method": getattr(sizes, "method", None),
    }


def _by_days(result: StudyResult) -> dict[tuple[Measure, str], dict[str, Any]]:
    """Return the tests by days, by measure and other condition."""
    found = {}
    for one in result.comparisons:
        if one.by == "days" and isinstance(one.statistic, DayDifference):
            row = asdict(one.statistic)
            del row["weights"]
            row["days_reference"], row["days_other"] = row.pop("n_days_x"), row.pop("n_days_y")
            row["days_both"] = row.pop("n_days_both")
            row["mean_reference"], row["mean_other"] = row.pop("mean_x"), row.pop("mean_y")
            found[one.measure, one.other] = row | {"p_holm": one.p_adjusted}
    return found


def condition_names(study: Study, recorded: Iterable[str] = ()) -> tuple[str, ...]:
    """Return all conditions in the order of the study or the protocol, then as recorded.

    `recorded` are those of epochs of which the rows may hold nothing.
    """
    order = [each.name for each in study.conditions]
    order = order or [block.condition for block in study.settings.protocol.blocks]
    of_epochs = study.rows[study.rows["scope"] != "all"]  # that of all epochs has no condition
    names = dict.fromkeys([*filter(None, study.pair), *recorded, *of_epochs["condition"].unique()])
    return tuple(sorted(names, key=lambda n: order.index(n) if n in order else len(order)))


def _summaries(result: StudyResult) -> Iterator[dict[str, Any]]:
    names = condition_names(result.study)
    for measure in measures_of(result.study.rows):
        of_each = summaries_of(result.study, measure.name)
        for name in filter(of_each.__contains__, names):
            summary, excluded = of_each[name]
            if summary.n or excluded:
                counts = {"condition": name, "n": summary.n, "excluded": excluded}
                yield measure.names | counts | asdict(summary)


def _days(result: StudyResult) -> Iterator[dict[str, Any]]:
    """Yield median and quartiles of every day of every subject and condition, ratings excepted."""
    if not any(one.by == "days" for one in result.comparisons):
        return
    for measure in measures_of(result.study.rows):
        rows = counting(result.study.rows, measure.name)
        if measure == RATING:
            continue
        key = ["subject", "day", "condition"]
        for labels, values in rows.groupby(key, sort=False)["value"]:
            summary = asdict(summarise(values.to_numpy()))
            numbers = {name: summary[name] for name in ("n", "median", "q1", "q3")}
            yield {"measure": measure.name} | dict(zip(key, labels, strict=True)) | numbers


def _effect_differences(result: StudyResult) -> Iterator[dict[str, Any]]:
    titles = {one.measure.name: one.measure.title for one in result.values}
    for pair in result.effect_pairs:
        yield {
            "first": pair.first,
            "second": pair.second,
            "first_title": titles[pair.first],
            "second_title": titles[pair.second],
            **asdict(pair.difference),
            "p_holm": pair.p_holm,
        }


def _precision(result: StudyResult) -> Iterator[dict[str, Any]]:
    """Yield the measures of the only condition, or of each of two without a test."""
    study = result.study
    if study.other and any(one.tested for one in result.comparisons if one.other == study.other):
        return
    yield from precisions_of_each(study.rows, dict.fromkeys(study.pair))


def _conditions(result: StudyResult) -> Iterator[dict[str, Any]]:
    """Yield each condition; a code without its stimulation, which would give it away."""
    for condition in result.study.conditions:
        mine = [each for each in result.study.sessions if each.condition == condition.name]
        about = asdict(condition)
        del about["simulated"]  # the conclusions have it beside each estimate
        if result.study.blinded:
            about = dict.fromkeys(about) | {"name": condition.name}
        days = len({(each.subject, each.day) for each in mine})
        yield about | {"days": days, "sessions": len(mine)}


def _account(result: StudyResult) -> Iterator[dict[str, Any]]:
    """Yield for each task and condition what was recorded, what counts, and who left out the rest.

    `unlisted` are epochs that neither count nor are among the exclusions.
    """
    study = result.study
    out = {(one.source, one.epoch): one.by for one in reversed(study.exclusions)}
    # A fit counts where it counts with J held, too.
    fits = study.analysis.fixed_inertia if study.sessions else ()
    scores = study.analysis.scores if study.sessions else ()
    tasks: tuple[tuple[str, Sequence[Fit | Score]], ...] = ("prbs", fits), ("sinusoid", scores)
    for task, of_task in tasks:
        for name in condition_names(study):
            own = {(o.source, o.epoch): o.outcome.included for o in of_task if o.condition == name}
            if own:
                by: list[str] = [out[key] for key in own if key in out]
                included = sum(counts and key not in out for key, counts in own.items())
                yield {
                    "task": task,
                    "condition": name,
                    "recorded": len(own),
                    "included": included,
                    **{f"by_{one}": by.count(one) for one in _EXCLUDED_BY},
                    "unlisted": len(own) - included - len(by),
                }


def _of_ratings(
    result: StudyResult, rows: Callable[[Ratings], Iterable[dict[str, Any]]]
) -> Iterable[dict[str, Any]]:
    return [] if result.study.ratings is None else rows(result.study.ratings)


TABLES: Mapping[str, Callable[[StudyResult], Iterable[Mapping[str, Any]]]] = {
    "conclusion": lambda result: conclusion_rows(result.comparisons, result.methods),
    "precision": _precision,
    "comparisons": comparison_rows,
    "summaries": _summaries,
    "days": _days,
    "effect_differences": _effect_differences,
    "ratings": lambda result: _of_ratings(result, rating_rows),
    "rating_offsets": lambda result: _of_ratings(result, rating_offsets),
    "rating_contrast": lambda result: _of_ratings(
        result, lambda found: rating_contrast(found, result.study.pair)
    ),
    "rating_relation": lambda result: [one.row() for one in relations(result.study.rows)],
    "sensitivity": lambda result: [one.row() for one in result.methods],
    "conditions": _conditions,
    "sessions": lambda result: [one._asdict() for one in result.study.sessions],
    "excluded_epochs": lambda result: [one._asdict() for one in result.study.exclusions],
    "left_out": lambda result: [one._asdict() for one in result.study.left_out],
    "deviations": lambda result: [one._asdict() for one in result.study.deviations],
    "without_deviating": lambda result: without_deviating(result.study, result.comparisons),
    "account": _account,
    "estimates": lambda result: estimate_cells(result.study),
    "scores": lambda result: score_cells(result.study),
}
"""The tables of conclusions by name, each made alone."""


def result_table(result: StudyResult, name: str) -> Rows:
    """Return one of the tables of conclusions; the others are not made."""
    return list(TABLES[name](result))


def table_csv(rows: Rows) -> str:
    """Return a table as CSV; a column is there if any row has it."""
    return csv_text(columns_of_rows(rows), rows)


def columns_of_rows(rows: Rows) -> list[str]:
    """Return the columns of a table, in their order."""
    return list(dict.fromkeys(name for row in rows for name in row))


def comparison_document(result: StudyResult, place: str = "") -> dict[str, Any]:
    """Return every conclusion as plain values; what does not exist is null.

    `place` is the study's folder as sentences name it; it is taken out of them.
    """
    study, analysis = result.study, result.study.analysis
    light = traffic_light(study, result.comparisons)
    again = result_table(result, "without_deviating")
    subjects = {session.subject for session in study.sessions}
    of_study = ("title", "source", "by", "reference", "other")
    tables = {name: result_table(result, name) for name in _IN_DOCUMENT}
    document = {
        "schema": COMPARISON_SCHEMA,
        **{name: getattr(study, name) for name in of_study},
        "seed": result.seed,
        "resamples": result.resamples,
        "blinded": study.blinded,
        "virtual": study.virtual,
        **{name: tables[name] for name in ("conditions", "sessions", "left_out")},
        "method": analysis.method,
        "method_reason": analysis.method_reason,
        "inertia_kg_m2": analysis.inertia_kg_m2,
        "inertia_by_subject": len(subjects) > 1,
        "lead": lead(study, result.comparisons),
        "statements": [
            {"reference": study.reference, "other": other, **one._asdict()}
            for other, one in statements(study, result.comparisons).items()
        ],
        "primary": study.primary.row(measures_of(study.rows)),
        "conclusion": tables["conclusion"],
        "reasons": [
            reason.row() | {"measures": measures}
            for reason, _, measures in reasons(result.comparisons)
        ],
        "quality": light,
        "comparisons": comparison_values(result),
        "days": tables["days"],
        "effect_differences": tables["effect_differences"],
        "plan": {
            "words": deviation_sentence(study, again),
            "deviations": tables["deviations"],
            "without_deviating": again,
        },
        "ratings": None if study.ratings is None else ratings_document(study.ratings, study.pair),
        "rating_relation": tables["rating_relation"],
        "sensitivity": tables["sensitivity"],
        "exclusions": tables["excluded_epochs"],
        "notices": [
            {"level": one.level, "text": one.text.replace(f"{place}/", "") if place else one.text}
            for one in result.notices
        ],
    }
    plain = plain_values(document)
    assert isinstance(plain, dict)
    return plain
