"""What else than the condition may have made a difference that a test found, or have hidden one.

Each is a finding; the most specific comes first. Most ask the same question: is the difference
there without some of the rows? Then the same test is made of the others.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from datetime import date
from typing import NamedTuple

import pandas as pd

from rigidimeter.analysis.estimation import method_named
from rigidimeter.analysis.study.compared import Compared, signed
from rigidimeter.analysis.study.comparisons import OfMethod
from rigidimeter.analysis.study.measures import LEVEL
from rigidimeter.analysis.study.ratings import one_sided, without_raters
from rigidimeter.analysis.study.rows import ALIKE_IN_BOTH, OF_SUBJECT, pooled
from rigidimeter.analysis.study.study import Study
from rigidimeter.analysis.study.tests import Pair, of_difference, tested
from rigidimeter.core.findings import Fact, Finding, found_between
from rigidimeter.core.words import condition_name, plural, series

CAUSES = {
    "tremor": "",
    "varying_with_time": "a joint that changes during the epoch",
    "varying_with_angle": "a joint that changes with the angle",
    "varying_with_phase": "a joint that changes with the imposed movement",
    "voluntary_torque": "torque of the subject's own",
    "active_movement": "torque of the subject's own",
    "emg_activity": "muscle activity",
    "implausible_parameters": "values that no joint has, as wrong units give",
}
"""Checks that say what is wrong, in the order in which they are named; of the others the one that
flags most epochs is named. A joint that changes leaves torque as a pushing subject does, but a
subject who pushes is hardly ever taken for a joint that changes."""

SHARE_THAT_HIDES = 10.0
"""In % of the epochs of a condition: so many with a caution can hide a difference."""

SHARE_OF_INERTIA = 0.5
"""Of a measure's relative difference: if that of the inertia is larger, the joint or the contact
was another one."""

DEGREES = 180.0 / math.pi
UNIT_WITHIN = 1.5
"""Factor by which a ratio of inertias may miss that of the units."""


class Case(NamedTuple):
    """A test, the rows of its measure that count, and the study and methods beside it."""

    test: Compared
    rows: pd.DataFrame
    study: Study
    methods: Sequence[OfMethod] = ()

    def again(self, rows: pd.DataFrame) -> Compared:
        """Return the same test of other rows."""
        return tested(rows, self.test.measure, self.test.pair, self.test.by)

    def of(self, condition: str) -> pd.DataFrame:
        """Return the rows of one condition."""
        return self.rows[self.rows["condition"] == condition]

    @property
    def flags(self) -> pd.Series:
        """What flags each row of the two conditions, as a list; rows without any are left out."""
        there = self.rows[self.rows["condition"].isin(self.test.pair)]
        names = there["findings"].map(_flags)
        return names[names.map(bool).astype(bool)]


def objections(case: Case, inertia: Case | None) -> Iterator[Finding]:
    """Yield what else may have made a difference that was found.

    Parameters
    ----------
    case : Case
    inertia : Case or None
        That of the inertia, where it is found to differ.
    """
    test = case.test
    groups = by_groups(case)
    if not all(again.agrees(test) for again in groups.values()):
        yield _of_groups(groups)
    if test.measure.origin == "ratings":
        yield from _of_raters(case)
    if test.measure.origin in ("fits", "scores"):
        if inertia is not None:
            yield from _of_degrees(inertia)
        yield from _of_epochs(case)
        yield from _of_conditions(case)
        if inertia is not None:
            yield from _of_inertia(case, inertia)
    if test.by == "recordings":
        yield found_between("unknown_days", {}, case.rows["session"].nunique())
    elif test.by == "days":
        yield from _in_order(case)


def hidden(case: Case) -> Finding | None:
    """Return what can hide a difference that was not found, the most specific; None without any."""
    groups = by_groups(case)
    if any(again.found for again in groups.values()):
        return _of_groups(groups)
    flags = case.flags
    if len(flags) and (share := _largest_share(case, flags)) >= SHARE_THAT_HIDES:
        facts = _carried(case, flags) | {"variant": "hides"}
        return found_between("flagged_epochs", facts, share, SHARE_THAT_HIDES)
    if case.test.measure.origin == "ratings" and (raters := one_sided(case.rows, case.test.pair)):
        return _of_examiners(raters, {"variant": "hides"})
    return None


def untested(case: Case) -> Finding:
    """Return why there is no test: where the recordings say so, that they could not be read."""
    read = {session.condition for session in case.study.sessions}
    for name in case.test.pair:
        lost = [out for out in case.study.left_out if out.condition == name]
        if lost and name not in read:
            which = "the recording" if len(lost) == 1 else f"all {len(lost)} recordings"
            facts = {"which": which, "lost": name, "reason": lost[0].reason}
            return found_between("unused_recordings", facts, len(lost))
    return found_between("no_test", {"remark": case.test.remark})


def negligible(case: Case) -> Finding | None:
    """Return that a difference is smaller than an error which no check finds; else None.

    How the joint moves between the samples is known to `max_between_samples_percent` alone.
    """
    allowed = case.study.settings.diagnostics.max_between_samples_percent
    if case.test.measure.origin != "fits" or (size := 100.0 * case.test.share) > allowed:
        return None
    return found_between("within_accuracy", {}, size, allowed)


def wide(test: Compared) -> Finding:
    """Return that a difference of the wanted size would be found in fewer than one study of two."""
    family, wanted = test.family, test.wanted_percent
    if test.by == "values" and math.isinf(test.half_width):
        n_x, n_y = test.n
        of = f" for {family.tests} measures" if family.tests > 1 else ""
        facts: dict[str, Fact] = {"variant": "values", "first": n_x, "second": n_y, "of": of}
        facts |= {"alpha": LEVEL, "exact": 2.0 / math.comb(n_x + n_y, n_x)}
        return found_between("wide_interval", facts, limit=wanted)
    size = 100.0 * test.half_width / abs(test.value_reference or math.nan)
    facts = {"tests": plural(family.first, "test")}
    if not test.ratio and test.measure.origin == "column":
        facts["variant"] = "negative"
    elif not test.value_reference:
        facts["variant"] = "zero"
    elif size <= wanted:
        facts["variant"] = "held"
    return found_between("wide_interval", facts, size, wanted)


def groups_of(rows: pd.DataFrame, pair: Pair) -> tuple[str, ...]:
    """Return the groups of subjects of two conditions; none where they are the conditions."""
    own = rows[rows["condition"].isin(pair) & (rows["group"] != "")]
    if (own["group"] == own["condition"]).all():
        return ()
    found = tuple(own["group"].drop_duplicates())
    return found if len(found) > 1 else ()


def by_groups(case: Case) -> dict[str, Compared]:
    """Return the test within each group of subjects; nothing where there are not two."""
    groups = groups_of(case.rows, case.test.pair)
    return {group: case.again(case.rows[case.rows["group"] == group]) for group in groups}


def _of_groups(groups: Mapping[str, Compared]) -> Finding:
    """Return that groups of subjects differ in what the condition does, and how."""
    each = [
        f"{name} {signed(again.percent(again.of_test), again.of_test).value} ({again.p_words})"
        for name, again in groups.items()
    ]
    return found_between("groups_differ", {"groups": ", ".join(each)}, len(groups))


def _of_raters(case: Case) -> Iterator[Finding]:
    """Yield that an examiner who rated one condition alone makes the difference."""
    test, ratings = case.test, case.study.ratings
    raters = one_sided(case.rows, test.pair)
    if ratings is not None and raters:
        found = without_raters(ratings, raters, test.pair)
        again = of_difference(case.rows, test.measure, test.pair, test.by, found)
        if not again.agrees(test):
            yield _of_examiners(raters, {"without": again.p_words})


def _of_examiners(raters: Sequence[str], facts: Mapping[str, Fact]) -> Finding:
    who = f"examiner{'s' * (len(raters) > 1)} {', '.join(raters)}"
    return found_between("examiners_of_one_condition", {**facts, "who": who}, len(raters))


def _of_degrees(inertia: Case) -> Iterator[Finding]:
    """Yield that inertias differ as degrees do from radians."""
    low, high = sorted(float(inertia.of(name)["value"].median()) for name in inertia.test.pair)
    if low > 0 and DEGREES / UNIT_WITHIN < high / low < DEGREES * UNIT_WITHIN:
        yield _differs(inertia.test, {"variant": "degrees"})


def _of_inertia(case: Case, inertia: Case) -> Iterator[Finding]:
    """Yield that the inertia differs, as far as that may have made the difference.

    What makes another inertia, such as a unit or torque of the subject, changes B and K in
    proportion.
    """
    itself = case.test.measure == inertia.test.measure
    if itself or inertia.test.share > SHARE_OF_INERTIA * case.test.share:
        flags = case.flags
        carried = {**_carried(case, flags), "variant": "flagged"} if len(flags) else {}
        yield _differs(inertia.test, carried)


def _differs(inertia: Compared, facts: Mapping[str, Fact]) -> Finding:
    of_each: dict[str, Fact] = {
        "reference": inertia.reference,
        "first": inertia.value_reference,
        "other": inertia.other,
        "second": inertia.value_other,
    }
    size = abs(100.0 * inertia.difference / inertia.value_reference)
    return found_between("inertia_of_conditions", {**facts, **of_each}, size)


def _of_epochs(case: Case) -> Iterator[Finding]:
    """Yield the checks that flag epochs, if the others do not show the difference."""
    flags = case.flags
    if not len(flags):
        return
    again = case.again(case.rows.drop(flags.index))
    own_torque = {name for names in flags for name in names} <= OF_SUBJECT
    if not (again.agrees(case.test) or (own_torque and _cleared(case))):
        facts = _carried(case, flags) | {"without": again.p_words}
        yield found_between("flagged_epochs", facts, _largest_share(case, flags))


def _of_conditions(case: Case) -> Iterator[Finding]:
    """Yield what a check finds in all epochs of a condition, unless it is too small for it."""
    test = case.test
    if test.measure.origin == "scores":
        return
    every = pooled(case.study.rows, test.measure.name)
    every = every[every["condition"].isin(test.pair)]
    names = every["findings"].map(_flags)
    every, names = every[names.map(bool).astype(bool)], [own for own in names if own]
    if not len(every) or abs(test.difference) - every["bias"].sum() > (test.high - test.low) / 2.0:
        return
    checks = list(dict.fromkeys(name for own in names for name in own))
    if {*checks} <= OF_SUBJECT and _cleared(case):
        return
    flags = case.flags
    where = series(list(dict.fromkeys(map(condition_name, every["condition"]))))
    counts = "; {cause} in {counts}".format_map(_carried(case, flags)) if len(flags) else ""
    facts = {"cause": _in_words(checks[0]), "where": where, "counts": counts}
    yield found_between("flagged_epochs", {**facts, "variant": "together"})


def _cleared(case: Case) -> bool:
    """Whether a method that the subject's own torque does not bias shows the difference too."""
    return any(
        one.by_values.measure == case.test.measure
        and method_named(one.method).uses_perturbation
        and one.p < LEVEL
        and one.difference * case.test.sign > 0
        for one in case.methods
    )


def _flags(findings: str) -> list[str]:
    return [name for name in findings.split() if name not in ALIKE_IN_BOTH]


def _largest_share(case: Case, flags: pd.Series) -> float:
    """Return the largest share of a condition's epochs that are flagged, in %."""
    of_each = [own for own in map(case.of, case.test.pair) if len(own)]
    shares = (float(own.index.isin(flags.index).mean()) for own in of_each)
    return 100.0 * max(shares, default=0.0)


def _carried(case: Case, flags: pd.Series) -> dict[str, Fact]:
    """Return which check flags epochs, and how many of each condition are flagged."""
    counts = Counter(name for names in flags for name in names)
    first = next((name for name in CAUSES if name in counts), counts.most_common(1)[0][0])
    parts: list[str] = []
    for condition in case.test.pair:
        of = case.of(condition)
        epochs = "" if parts else " epochs"
        carry = int(of.index.isin(flags.index).sum())
        parts.append(f"{carry} of {len(of)}{epochs} in {condition_name(condition)}")
    others = f" (or {plural(len(counts) - 1, 'other finding')})" if len(counts) > 1 else ""
    return {"cause": _in_words(first), "others": others, "counts": ", ".join(parts)}


def _in_words(check: str) -> str:
    """Return a check with what it finds, where its name does not say it."""
    return f"{CAUSES[check]} ({check})" if CAUSES.get(check) else check


def _in_order(case: Case) -> Iterator[Finding]:
    """Yield that all days of one condition came after all days of the other, in every subject."""
    pair = case.test.pair
    later: set[int | None] = set()
    n = [0, 0]
    for _, own in case.rows.groupby("subject", sort=False):
        days = [own.loc[own["condition"] == name, "day"].unique() for name in pair]
        n = [total + len(of_one) for total, of_one in zip(n, days, strict=True)]
        if all(map(len, days)):
            later.add(_later(*days))
    if len(later) == 1 and (last := later.pop()) is not None:
        facts = {"later": pair[last], "earlier": pair[1 - last]}
        yield found_between("order_of_conditions", facts, n[last])


def _later(x: Iterable[str], y: Iterable[str]) -> int | None:
    """Return which of two sets of days comes after all of the other; None if neither does."""
    order = _order([*x, *y])
    if order is None:
        return None
    first, second = ([order[day] for day in days] for days in (x, y))
    if max(first) < min(second):
        return 1
    return 0 if max(second) < min(first) else None


def _order(labels: Sequence[str]) -> dict[str, float] | None:
    """Return the place of each day in time, where labels are dates or numbers; else None."""
    try:
        return {label: float(date.fromisoformat(label).toordinal()) for label in labels}
    except ValueError:
        parts = [re.fullmatch(r"(\D*)(\d+)", label) for label in labels]
    if not all(parts) or len({part[1] for part in parts if part}) > 1:
        return None
    return {label: float(part[2]) for label, part in zip(labels, parts, strict=True) if part}
