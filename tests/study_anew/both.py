"""One study in both rooms, their answers in two columns.

    python -m tests.study_anew.both              200 random studies
    python -m tests.study_anew.both 1000 1500    those with these seeds

The result of the room that is replaced is taken apart into what was recorded (estimates, sessions,
ratings, what was declared); the new room begins there.
"""

from __future__ import annotations

import math
import sys
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, astuple, fields
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from tests.study_anew.designs import random_ratings, random_study, random_table

from rigidimeter.analysis import study as old
from rigidimeter.analysis import study_anew as new
from rigidimeter.analysis.reading import estimates_document
from rigidimeter.analysis.study.ratings_found import (
    rating_contrast,
    rating_offsets,
    ratings_document,
)
from rigidimeter.analysis.study.ratings_model import model_ratings
from rigidimeter.core.errors import UserError
from rigidimeter.core.records import Analysis

RESAMPLES = 199
"""Of the bootstrap in studies that are read from folders."""
CLOSE = 1e-12
"""Numbers agree to this share of the larger."""
CANCELLED = 1e-15
"""A difference (100 times that in per cent) may be as far off: of values that are almost
equal no more is known. Not p."""

Rows = Sequence[Mapping[str, Any]]


TABLES = ("precision", "comparisons", "summaries", "days", "effect_differences", "sensitivity",
          "conditions", "sessions", "excluded_epochs", "left_out", "account", "ratings",
          "rating_offsets", "rating_contrast", "rating_relation", "deviations",
          "without_deviating", "estimates", "scores")  # fmt: skip
"""Of a folder beside what is concluded."""


class Answers(NamedTuple):
    """What is concluded of a study, as documents and sentences have it."""

    conclusion: Rows
    statements: Rows
    lead: str
    values: Rows
    groups: Rows
    notices: Sequence[str] = ()
    tables: Mapping[str, Rows] = {}
    documents: Sequence[Any] = ()
    digests: Mapping[str, str] = {}
    plan: str = ""
    shown: Mapping[str, Any] = {}

    def cells(self) -> dict[str, Any]:
        """Return every answer by its name."""
        found: dict[str, Any] = {
            "lead": self.lead,
            "notices": list(self.notices),
            "plan": self.plan,
        }
        found |= {f"digest {name}": digest for name, digest in self.digests.items()}
        mine = {name: getattr(self, name) for name in ("conclusion", "statements", "values")}
        for table, rows in (mine | {"groups": self.groups} | {**self.tables}).items():
            for k, row in enumerate(rows):
                where = f"{table} {k} {row.get('measure', '')} {row.get('other', '')}"
                found |= {f"{where} {name}": cell for name, cell in row.items()}
                found[f"{where} columns"] = list(row)
        found |= {f"shown {name}": cell for name, cell in leaves(self.shown)}
        for k, document in enumerate(self.documents):
            found |= {f"document {k} {name}": cell for name, cell in leaves(document)}
        return found


NOTHING = Answers((), (), "", (), ())


def leaves(value: Any, name: str = "") -> Iterator[tuple[str, Any]]:
    """Yield what a document holds, by its path."""
    if isinstance(value, Mapping):
        for key, one in value.items():
            yield from leaves(one, f"{name}.{key}")
    elif isinstance(value, list | tuple):
        for k, one in enumerate(value):
            yield from leaves(one, f"{name}.{k}")
    else:
        yield name, value


def old_answers(result: old.StudyResult) -> Answers:
    """Return what the room that is replaced says."""
    pairs = (result, *result.further_pairs)
    tested = [c for c in (*result.comparisons, *result.further) if c.paired]
    return Answers(
        old.conclusion_rows(result),
        [
            {"other": pair.other, **said._asdict()}
            for pair in pairs
            if (said := old.statements(pair)) is not None
        ],
        old.lead(result),
        [
            {
                "measure": c.measure.name,
                "other": c.other,
                "p_holm": c.p_holm,
                **{name: getattr(c.test, name, None) for name in ("z", "p", "r", "shift")},
                **{name: getattr(c.test, name, None) for name in ("shift_low", "shift_high", "u")},
                "remark": c.remark,
            }
            for c in tested
        ],
        [
            {"measure": c.measure.name, "other": c.other, "groups": " ".join(c.groups)}
            for c in tested
        ],
        tables={
            "without": old.result_table(result, "without_deviating"),
            "quality": [] if (light := old.traffic_light(result)) is None else [light.row()],
        },
        documents=[
            [(one.finding.row(), one.where) for one in result.findings],
            None if (said := result.statements) is None else tuple(said),
        ],
        plan=old.deviation_words(result),
        shown={
            "differences": [old.difference_cells(pair) for pair in pairs if pair.other],
            **_shown(result),
        },
    )


def _shown(result: Any) -> dict[str, Any]:
    """Return what a terminal and a notebook show of a result of either room."""
    return {
        "repr": repr(result),
        "html": result._repr_html_(),
        "table": result.table().to_dict("list"),
        "full table": result.table(full=True).to_dict("list"),
        "conditions": result.condition_names,
        "resampled": result.resampled,
    }


def concluded_study(result: old.StudyResult) -> new.StudyResult:
    """Return what the new room concludes of what was recorded; effect sizes are as they were."""
    study, methods = new_study(result)
    sizes = {c.measure.name: c.effects for c in result.comparisons if c.effects is not None}
    return new.StudyResult(
        study,
        new.conclude(study, new.day_tests(study), methods),
        new.compare_values(study),
        sizes,
        methods=tuple(methods),
    )


def new_answers(result: new.StudyResult) -> Answers:
    """Return what the new room says."""
    study, concluded, methods = result.study, result.comparisons, result.methods
    said = new.statements(study, concluded)
    again = new.without_deviating(study, concluded)
    light = new.traffic_light(study, concluded)
    values = [one for one in result.values if one.other]
    return Answers(
        new.conclusion_rows(concluded, methods),
        [{"other": other, **one._asdict()} for other, one in said.items()],
        new.lead(study, concluded),
        [
            {
                "measure": one.measure.name,
                "other": one.other,
                "p_holm": one.p_adjusted,
                **{name: getattr(one.statistic, name, None) for name in ("z", "p", "r", "shift")},
                **{
                    name: getattr(one.statistic, name, None)
                    for name in ("shift_low", "shift_high", "u")
                },
                "remark": one.remark,
            }
            for one in values
        ],
        [
            {
                "measure": one.measure.name,
                "other": one.other,
                "groups": " ".join(
                    new.groups_of(new.counting(study.rows, one.measure.name), one.pair)
                ),
            }
            for one in values
        ],
        tables={
            "without": again,
            "quality": [] if light is None else [light],
        },
        documents=[
            [(one.finding.row(), one.where) for one in result.findings],
            None if (every := result.statements) is None else tuple(every),
        ],
        plan=new.deviation_sentence(study, again),
        shown={
            "differences": [new.difference_cells(result, other) for other in study.others],
            **_shown(result),
        },
    )


def of_folder(folder: Path, **options: Any) -> tuple[Answers | str, Answers | str]:
    """Return what both rooms say of a study folder, read and estimated by each, or refuse."""
    before: Answers | str
    now: Answers | str
    try:
        read = old.read_study(folder, **options)
    except UserError as error:
        before = str(error)
    else:
        result = old.analyse_study(read, resamples=RESAMPLES)
        before = old_answers(result)._replace(
            notices=[f"{one.level} {one.text}" for one in result.notices],
            tables={name: old.result_table(result, name) for name in TABLES},
            documents=[old.comparison_document(result, str(folder)), _agreement(result)],
            digests={**read.folder.digests, **read.gathered.digests},
        )
        estimates = old.estimate_study(read)[0]
        scatter = _scatter(old.day_scatter, read, estimates)
        more = {"estimates": estimates_document(estimates), "scatter": scatter}
        before = before._replace(shown={**before.shown, **more})
    try:
        loaded = new.load_study(folder, **options)
    except UserError as error:
        return before, str(error)
    found = new.conclude_study(new.analyse(loaded), resamples=RESAMPLES)
    ratings = found.study.ratings
    now = new_answers(found)._replace(
        notices=[f"{one.level} {one.text}" for one in found.notices],
        tables={name: new.result_table(found, name) for name in TABLES},
        documents=[
            new.comparison_document(found, str(folder)),
            None if ratings is None else tuple(new.agreement(ratings)),
        ],
        digests=found.study.digests,
    )
    estimates = new.estimate_study(loaded)[0]
    scatter = _scatter(new.day_scatter, loaded, estimates)
    more = {"estimates": estimates_document(estimates), "scatter": scatter}
    return before, now._replace(shown={**now.shown, **more})


def _scatter(day_scatter: Callable[..., Any], read: Any, estimates: Analysis) -> Any:
    """Return the scatter between days of one of the rooms, or why it is unknown."""
    try:
        found = day_scatter(read, estimates)
    except UserError as error:
        return str(error)
    return [one._asdict() if hasattr(one, "_asdict") else asdict(one) for one in found]


def _agreement(result: old.StudyResult) -> tuple[Any, ...] | None:
    return None if result.ratings is None else astuple(old.agreement(result.ratings))


def of_table(seed: int) -> tuple[Answers | str, Answers | str]:
    """Return what both rooms say of a random table, or why they refuse it."""
    table, options = random_table(seed)
    before: Answers | str
    now: Answers | str
    try:
        result = old.compare(table, resamples=0, **options)
    except UserError as error:
        before = str(error)
    else:
        before = old_answers(result)._replace(notices=[one.text for one in result.notices])
    try:
        found = new.compare(table, resamples=0, **options)
    except UserError as error:
        now = str(error)
    else:
        now = new_answers(found)._replace(notices=[one.text for one in found.notices])
    return before, now


def of_anything(x: Any, **options: Any) -> tuple[Answers | str, Answers | str]:
    """Return what `compare` of both rooms says, or why it refuses."""
    before: Answers | str
    try:
        result = old.compare(x, **options)
    except UserError as error:
        before = str(error)
    else:
        tables = {name: old.result_table(result, name) for name in TABLES}
        documents = [old.comparison_document(result)]
        before = old_answers(result)._replace(tables=tables, documents=documents)
    try:
        found = new.compare(x, **options)
    except UserError as error:
        return before, str(error)
    tables = {name: new.result_table(found, name) for name in TABLES}
    documents = [new.comparison_document(found)]
    return before, new_answers(found)._replace(tables=tables, documents=documents)


def of_ratings(seed: int) -> tuple[Answers | str, Answers | str]:
    """Return what both rooms say of the ratings of a random table, or why they refuse it."""
    table, columns, options = random_ratings(seed)
    before: Answers | str
    try:
        found = model_ratings(table, columns, **options)
    except UserError as error:
        before = str(error)
    else:
        rows = rating_offsets(found), rating_contrast(found)
        before = NOTHING._replace(documents=[ratings_document(found), *map(list, rows)])
    options["contrast"] = options.pop("pair")
    try:
        ratings, pair = new.table_ratings(table, columns, **options)
    except UserError as error:
        return before, str(error)
    document = new.ratings_document(ratings, pair)
    rows = new.rating_offsets(ratings), new.rating_contrast(ratings, pair)
    return before, NOTHING._replace(documents=[document, *map(list, rows)])


def new_study(result: old.StudyResult) -> tuple[new.Study, list[new.OfMethod]]:
    """Return what was recorded of a study, and what other methods gave."""
    sessions = {one.source: _as(new.SessionEntry, one) for one in result.sessions}
    conditions = tuple(_as(new.Condition, one) for one in result.conditions)
    method = result.analysis.method or "iv"
    parts = [
        new.estimate_rows({method: result.analysis}, sessions or None, result.epochs, conditions)
    ]
    ratings = None
    if result.ratings is not None:
        ratings = _ratings(result.ratings, result.sessions)
        parts.append(new.corrected(ratings))
    virtual = [epoch.virtual for epoch in result.epochs]
    study = new.Study(
        new.together(parts),
        result.reference,
        result.other,
        tuple(dict.fromkeys(c.other for c in result.further)),
        title=result.title,
        primary=_as(new.Primary, result.primary),
        settings=result.settings,
        conditions=conditions,
        sessions=tuple(sessions.values()),
        left_out=tuple(_as(new.LeftOut, one) for one in result.left_out),
        ratings=ratings,
        deviations=tuple(_deviation(one) for one in result.deviations),
        analysis=result.analysis,
        blinded=result.blinded,
        virtual=result.virtual,
        partly_virtual=any(virtual),
    )
    return study, [_of_method(row, result) for row in result.sensitivity]


def _deviation(one: Any) -> new.Deviation:
    return new.Deviation(*(getattr(one, name) for name in new.Deviation._fields))


def _as(kind: type, one: Any) -> Any:
    return kind(**{field.name: getattr(one, field.name) for field in fields(one)})


def _ratings(found: old.RatingsFound, sessions: Sequence[old.SessionEntry]) -> new.Ratings:
    groups = {one.subject: one.group for one in sessions}
    scores = new.as_rows(
        {
            **{name: getattr(row, name) for name in ("subject", "day", "condition")},
            "group": groups.get(row.subject, ""),
            "rater": row.examiner,
            "epoch": f"line {row.line}",
            "measure": new.SCORE,
            "chosen": False,
            "value": row.score,
        }
        for row in found.rows
    )
    random = tuple(found.fit.offsets)
    return new.ratings_of(found.source, scores, random)


def _of_method(row: old.SensitivityRow, result: old.StudyResult) -> new.OfMethod:
    measure = new.Measure(*(asdict(row.measure)[name] for name in new.Measure._fields))
    of = (measure, result.reference, result.other)
    counts = (row.n_reference, row.n_other)
    values = new.Compared(*of, "values", counts, p=row.p, difference=-row.shift)
    days = new.Compared(*of, "days", counts, p=row.p_day)
    return new.OfMethod(row.method, row.inertia, row.chosen, values, days)


class Apart(NamedTuple):
    """An answer that differs."""

    name: str
    old: Any
    new: Any

    def __str__(self) -> str:
        return f"{self.name}\n    old {self.old!r}\n    new {self.new!r}"


def apart(before: Answers | str, now: Answers | str, close: float = CLOSE) -> Iterator[Apart]:
    """Yield what differs; numbers by more than a share of the larger, words by anything."""
    if isinstance(before, str) or isinstance(now, str):
        if before != now:
            yield Apart("refusal", before, now)
        return
    one, two = before.cells(), now.cells()
    for name in {**one, **two}:
        first, second = one.get(name, "absent"), two.get(name, "absent")
        allowed = 0.0 if name.endswith((" p", " p_holm")) else CANCELLED
        allowed *= 100.0 if "percent" in name else 1.0
        if first != second and not _close(first, second, close, allowed):
            yield Apart(name, first, second)


def _close(first: Any, second: Any, close: float, allowed: float) -> bool:
    if not all(isinstance(one, float | np.floating) for one in (first, second)):
        return False
    if math.isnan(first) and math.isnan(second):
        return True
    return abs(first - second) <= max(close * max(abs(first), abs(second)), allowed)


def compare_seeds(seeds: range) -> int:
    """Print what differs in random studies; return how many differ."""
    seen: Counter[str] = Counter()
    differing = 0
    for seed in seeds:
        for known_days in (True, False):
            result = random_study(seed, known_days=known_days)
            before = old_answers(result)
            found = list(apart(before, new_answers(concluded_study(result))))
            differing += bool(found)
            seen["studies"] += 1
            seen.update(f"verdict {row['verdict']}" for row in before.conclusion)
            seen.update(f"reason {row['finding']}" for row in before.conclusion if row["finding"])
            for one in found[:5]:
                print(f"seed {seed}, days known: {known_days}: {one}")
        of_both = of_table(seed)
        found = list(apart(*of_both))
        differing += bool(found)
        seen["tables"] += 1
        seen["tables that are refused"] += isinstance(of_both[0], str)
        for one in found[:5]:
            print(f"table {seed}: {one}")
    for name, count in sorted(seen.items()):
        print(f"{count:7}  {name}")
    print(f"{differing:7}  studies differ")
    return differing


if __name__ == "__main__":
    ends = [int(word) for word in sys.argv[1:]] or [0, 100]
    sys.exit(bool(compare_seeds(range(*ends))))
