"""What a comparison of two conditions shows of each measure, and what it does not.

A difference is shown where p of the test, adjusted in its family (`families`), is below the level,
and nothing that is known of the recordings can have made it (`caveats`). That none of the size that
is worth finding is shown is concluded where the test had a chance of one half to show it, and its
interval excludes it:

    half the interval at the level of the first test of the family ≤ size
    the 95 % interval lies within ± size

Otherwise it cannot be decided, and it is found how many days, subjects or values would decide it:
as many as show the smallest difference worth finding with a chance of 80 %, at the level of the
first test of the family. The SD of the difference is that of the test, and of J, B and K with few
days that which is assumed where no study is known (`rigidimeter.planning`), with the scatter
between epochs of these recordings.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd

from rigidimeter.analysis.study.caveats import (
    Case,
    hidden,
    negligible,
    objections,
    untested,
    wide,
)
from rigidimeter.analysis.study.compared import Compared, Needed, Verdict
from rigidimeter.analysis.study.comparisons import OfMethod
from rigidimeter.analysis.study.measures import CHECK, LEVEL, PValue, adjusted
from rigidimeter.analysis.study.rows import ALIKE_IN_BOTH, counting, grouped
from rigidimeter.analysis.study.study import Study
from rigidimeter.analysis.study.tests import half_width
from rigidimeter.core.findings import Finding, found_between
from rigidimeter.core.records import PARAMETERS, FindingGroup
from rigidimeter.core.words import series
from rigidimeter.planning import ASSUMED, day_difference_sd, pairs_needed

_MIN_DEGREES = 2
"""With fewer degrees of freedom within days the scatter of epochs is the assumed one."""

_FEW_DF = 3.0
"""With fewer degrees of freedom the SD of days is hardly known."""

GOOD_SHARE, POOR_SHARE = 0.9, 0.5
"""At least the first share of epochs is sound in good data; less than the second in poor data."""

_DAY = ("subject", "day", "session")


def conclude(
    study: Study, tests: Sequence[Compared], methods: Sequence[OfMethod] = ()
) -> tuple[Compared, ...]:
    """Return the tests with what is concluded from each, stiffness first in each pair.

    Parameters
    ----------
    study : Study
    tests : sequence of Compared
        Of every pair of conditions: p is adjusted for all of them together. Those of one condition
        alone are left out.
    methods : sequence of OfMethod
        The same by other methods.
    """
    tests = [one for one in tests if one.other]
    families = adjusted([PValue(one.measure, one.other, one.p) for one in tests], study.primary)
    adjusted_tests = [
        replace(
            one,
            p_adjusted=p,
            family=family,
            wanted_percent=study.primary.table.difference_percent,
            simulated=_simulated(study, one),
        )
        for one, (p, family) in zip(tests, families, strict=True)
    ]
    found: list[Compared] = []
    for other in dict.fromkeys(one.other for one in adjusted_tests):
        cases = [
            Case(one, counting(study.rows, one.measure.name), study, methods)
            for one in adjusted_tests
            if one.other == other
        ]
        found += sorted(_of_pair(cases), key=lambda one: one.measure.place)
    return tuple(found)


def _of_pair(cases: Sequence[Case]) -> list[Compared]:
    moved = (
        case
        for case in cases
        if case.test.measure.name == CHECK and case.test.p_adjusted < LEVEL and not negligible(case)
    )
    inertia = next(moved, None)
    found = _in_sequence([_concluded(case, inertia) for case in cases], cases[0].study)
    if inertia is None:
        return found
    why = next(one.finding for one in found if one.measure.name == CHECK)
    return [_beside(one, why) for one in found]


def _concluded(case: Case, inertia: Case | None) -> Compared:
    one, study = case.test, case.study
    scaled = one.ratio or one.measure.origin == "ratings"
    wanted = one.wanted_percent / 100.0 * abs(one.value_reference) if scaled else math.nan
    one = replace(one, half_width=half_width(case.rows, one, one.family.level))
    verdict: Verdict = "cannot be decided"
    why: Finding | None
    if not one.tested:
        why = untested(case)
    elif one.p_adjusted < LEVEL and (why := negligible(case)):
        verdict = "no difference shown"
    elif one.p_adjusted < LEVEL:
        why = next(objections(case, inertia), None)
        verdict = "not supported" if why else "lower" if one.sign < 0 else "higher"
    elif one.family.rule == "sequence" and one.p * one.family.first < LEVEL:
        why = _earlier(one, study)
    elif one.half_width <= wanted and max(abs(one.low), abs(one.high)) < wanted:
        why = hidden(case)
        verdict = "cannot be decided" if why else "no difference shown"
    else:
        why = hidden(case) or wide(one)
    more = needed(case.rows, one, wanted) if verdict == "cannot be decided" else None
    return replace(one, verdict=verdict, finding=why, needed=more)


def _in_sequence(found: list[Compared], study: Study) -> list[Compared]:
    """Return the rows; of a declared sequence none is claimed after one that is not."""
    ordered = [one for one in found if one.family.rule == "sequence"]
    ordered.sort(key=lambda one: one.family.order.index(one.measure.name))
    shown, withheld = True, []
    for one in ordered:
        claimed = one.verdict in ("lower", "higher")
        if claimed and not shown:
            withheld.append(one.measure)
        shown = shown and claimed
    return [
        replace(one, verdict="cannot be decided", finding=_earlier(one, study))
        if one.measure in withheld
        else one
        for one in found
    ]


def _earlier(one: Compared, study: Study) -> Finding:
    before = study.primary.before(one.measure)
    return found_between("earlier_in_sequence", {"before": before}, one.p)


def _beside(one: Compared, moved: Finding | None) -> Compared:
    """Return a row with the caution that the inertia differs, unless that is its reason."""
    same = moved is None or (one.finding is not None and one.finding.name == moved.name)
    of_joint = one.measure.origin == "fits" and one.measure.name != CHECK
    if same or not of_joint or one.verdict == "not supported":
        return one
    return replace(one, caution=moved)


def _simulated(study: Study, one: Compared) -> tuple[float, float] | None:
    """Return the medians that a virtual study simulated; None where none was simulated."""
    known = {each.name: each.simulated.get(one.measure.name) for each in study.conditions}
    first, second = (known.get(name) for name in one.pair)
    return None if first is None or second is None else (first, second)


def needed(rows: pd.DataFrame, test: Compared, size: float) -> Needed | None:
    """Return what would show a difference with a chance of 80 %; None where that is not known.

    Parameters
    ----------
    rows : pandas.DataFrame
        Those that were tested.
    test : Compared
        With its family.
    size : float
        The difference, in the unit of the measure.
    """
    unit = test.unit if test.tested else "day"
    own = [rows[rows["condition"] == name] for name in test.pair]
    few = test.by != "values" and unit != "subject" and test.df < _FEW_DF
    sd: float | None
    if not test.tested or few:
        sd = _assumed_sd(own[0], own[1], test)
        if sd is None and test.tested:
            sd = _tested_sd(test)
    elif test.by == "values":
        sd = math.hypot(*(float(np.std(one["value"], ddof=1)) for one in own))
    else:
        sd = _tested_sd(test)
    number = None
    if sd is not None and size > 0:
        number = pairs_needed(size, sd, alpha=test.family.level)
    if number is None or number <= (_count(test) if test.tested else 0.0):
        return None
    return Needed(number, unit)


def _count(test: Compared) -> float:
    """Return the number of units in each condition, their harmonic mean."""
    return 2 / sum(1 / count for count in test.units)


def _tested_sd(test: Compared) -> float:
    """Return the SD of the difference of one unit with both conditions."""
    return test.se * math.sqrt(_count(test))


def _assumed_sd(x: pd.DataFrame, y: pd.DataFrame, test: Compared) -> float | None:
    """Return the SD of the difference of one day, of J, B and K, with as many epochs as there are.

    None for other measures, and where a condition has no epoch.
    """
    title = {parameter.name: parameter.title for parameter in PARAMETERS}.get(test.measure.name)
    if title is None or test.measure.origin != "fits" or not (len(x) and len(y)):
        return None
    values = float(x["value"].mean()), float(y["value"].mean())
    if min(values) <= 0:
        return None
    first, second = (max(round(len(own) / _days(own)), 1) for own in (x, y))
    scatter = ASSUMED[title]
    within = [_within_days(own) for own in (x, y)]
    if all(degrees >= _MIN_DEGREES for _, degrees in within):
        percents = (100.0 * sd / value for (sd, _), value in zip(within, values, strict=True))
        scatter = replace(scatter, between_epochs_percent=max(percents))
    return day_difference_sd(scatter, values, (0.0, 0.0), (first, second))


def _days(rows: pd.DataFrame) -> int:
    return int(grouped(rows, *_DAY).ngroups)


def _within_days(rows: pd.DataFrame) -> tuple[float, int]:
    """Return the SD of epochs about the mean of their day, and its degrees of freedom."""
    days = grouped(rows, *_DAY)["value"]
    degrees = len(rows) - _days(rows)
    squares = float(((rows["value"] - days.transform("mean")) ** 2).sum())
    return (math.sqrt(squares / degrees) if degrees else math.nan), degrees


def reasons(concluded: Sequence[Compared]) -> tuple[FindingGroup, ...]:
    """Return the findings that verdicts follow from, each with its measures."""
    found: dict[Finding, list[str]] = {}
    for one in concluded:
        for why in (one.finding, one.caution):
            if why is not None:
                found.setdefault(why, []).append(one.measure.short)
    return tuple(
        FindingGroup(finding, (), series(list(dict.fromkeys(measures))))
        for finding, measures in found.items()
    )


def traffic_light(study: Study, concluded: Sequence[Compared]) -> dict[str, Any] | None:
    """Return the quality of the data; None where no epochs were recorded, as in a table.

    An epoch is sound if it counts without a caution. What concerns all epochs together counts too,
    but for checks that make no difference between conditions where two are compared.

    Returns
    -------
    dict or None
        `level` is ``good``, ``caution`` or ``poor``. `epochs` were recorded, of which `sound` are,
        `excluded` do not count, and `doubted` count in spite of a caution. `doubt` is the finding
        of most epochs, `doubt_epochs` of how many: 0 if only of all of them together; empty
        without a caution, or where the reason in `text` is no finding of epochs. `remedy` is what
        to do about it.
    """
    analysis = study.analysis
    recorded = {(one.source, one.epoch) for one in analysis.results}
    if not recorded:
        return None
    counting = {(one.source, one.epoch) for one in analysis.results if one.outcome.included}
    included = [fit for fit in analysis.fits if fit.outcome.included]
    flagged = {(fit.source, fit.epoch) for fit in included if fit.cautions}
    carried = [
        (len({(fit.source, fit.epoch) for fit in group.fits} & counting), group.finding)
        for group in analysis.findings
        if group.finding.level != "note"
    ]
    carried = [
        (epochs, finding)
        for epochs, finding in carried
        if epochs or not (study.other and finding.name in ALIKE_IN_BOTH)
    ]
    doubt_epochs, main = max(carried, key=lambda one: one[0], default=(0, None))
    doubt = "" if main is None else main.name
    of_pair = [one for one in concluded if one.other == study.other]
    unsupported = [one.reason for one in of_pair if one.verdict == "not supported"]
    text = main.headline if main is not None else (*unsupported, "")[0]
    if study.left_out and not text:
        count = len({out.path for out in study.left_out})
        text = f"{count} of the study's recordings could not be used"
    impossible = any(fit.inertia_kg_m2 <= 0 for fit in included)
    if impossible:
        text, doubt = "J is not greater than zero in some epochs, which is impossible", ""
    share = len(counting - flagged) / len(recorded)
    together = main is not None and not doubt_epochs
    level = "good"
    if share < POOR_SHARE or impossible:
        level = "poor"
    elif share < GOOD_SHARE or together or unsupported or study.left_out:
        level = "caution"
    return {
        "level": level,
        "epochs": len(recorded),
        "sound": len(counting - flagged),
        "excluded": len(recorded - counting),
        "doubted": len(flagged),
        "doubt": doubt,
        "doubt_epochs": doubt_epochs,
        "text": text,
        "remedy": "" if main is None else main.words.remedy,
    }
