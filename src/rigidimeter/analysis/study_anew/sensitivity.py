"""The same comparison by other estimators, and with the inertia held or fitted freely."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Literal, NamedTuple

import pandas as pd

from rigidimeter.analysis.estimation import METHODS
from rigidimeter.analysis.study_anew.compared import Compared
from rigidimeter.analysis.study_anew.families import LEVEL
from rigidimeter.analysis.study_anew.measures import CHECK, MEASURES
from rigidimeter.analysis.study_anew.rows import counting
from rigidimeter.analysis.study_anew.tests import FEWEST_FOR_TEST, Pair, by_units, by_values
from rigidimeter.core.records import Notice

_FITTED = tuple(one for one in MEASURES if one.origin == "fits")


class OfMethod(NamedTuple):
    """One measure by one method: tested by its epochs as independent values, and by days.

    `inertia` says whether J was held at its median (``fixed``) or fitted with B and K in each epoch
    (``free``); `chosen` whether the study concludes from it.
    """

    method: str
    inertia: Literal["free", "fixed"]
    chosen: bool
    by_values: Compared
    by_days: Compared

    @property
    def p(self) -> float:
        """That by days, or else over epochs."""
        return self.by_days.p if self.by_days.tested else self.by_values.p

    @property
    def difference(self) -> float:
        """The shift that the test of epochs found, other − reference; NaN without a test."""
        return self.by_values.difference if self.by_values.tested else math.nan

    def row(self) -> dict[str, Any]:
        """Return all numbers as documents and tables have them; shifts are reference − other."""
        test = self.by_values.statistic
        names = ("shift", "shift_low", "shift_high", "p", "r")
        n_reference, n_other = self.by_values.n
        return {
            **self.by_values.measure.names,
            "method": self.method,
            "inertia": self.inertia,
            "n_reference": n_reference,
            "n_other": n_other,
            **{name: getattr(test, name, math.nan) for name in names},
            "p_day": self.by_days.p,
            "chosen": self.chosen,
        }


def sensitivity_methods() -> tuple[str, ...]:
    """Return the estimators that a study is analysed with besides the chosen one."""
    return tuple(method.name for method in METHODS if method.in_sensitivity)


def sensitivity(rows: pd.DataFrame, pair: Pair) -> tuple[tuple[OfMethod, ...], tuple[Notice, ...]]:
    """Return each measure by each method, with J free and J held, and why a method is missing.

    Rows are in the order of measures, then of methods, with J free before J held.
    """
    fits = rows[(rows["scope"] == "epoch") & (rows["inertia"] != "")]
    there = [*map(str, fits["method"].drop_duplicates())]
    usable, notices = [], []
    for method in dict.fromkeys([*filter(there.__contains__, sensitivity_methods()), *there]):
        lacking = _lacking(fits[fits["method"] == method], pair)
        if lacking:
            text = f"the sensitivity analysis has no {method}: {lacking}"
            notices.append(Notice("warning", text))
        else:
            usable.append(method)
    stages: tuple[Literal["free", "fixed"], ...] = ("free", "fixed")
    found = []
    for measure in _FITTED:
        for method in usable:
            for inertia in stages[: 1 if measure.name == CHECK else 2]:
                own = fits[(fits["method"] == method) & (fits["inertia"] == inertia)]
                concluded = bool(own["chosen"].any())
                values = counting(own.assign(chosen=True), measure.name)
                tests = by_values(values, measure, pair), by_units(values, measure, pair)
                found.append(OfMethod(method, inertia, concluded, *tests))
    return tuple(found), tuple(notices)


def _lacking(fits: pd.DataFrame, pair: Pair) -> str:
    """Return why these fits give no test, else nothing; a failure says its own reason."""
    one_each = fits[(fits["inertia"] == "free") & (fits["measure"] == CHECK)]
    included = one_each[one_each["outcome"] == "included"]
    counts = {name: int((included["condition"] == name).sum()) for name in pair}
    if min(counts.values()) >= FEWEST_FOR_TEST:
        return ""
    left = " and ".join(
        f"{n} epochs in {name or 'a second condition'}" for name, n in counts.items()
    )
    failed = one_each.loc[one_each["outcome"] == "failed", "reason"]
    return f"it leaves {left}" + (f" ({failed.iloc[0]})" if len(failed) and failed.iloc[0] else "")


def method_caveats(found: Sequence[OfMethod]) -> dict[str, str]:
    """Return for each measure, by name, how its conclusion depends on the method; empty if not.

    A method shows a difference where p by days, or else p over epochs, is below the level.
    """
    signs: dict[str, set[int]] = {}
    for one in found:
        shown = int(math.copysign(1, one.difference)) if one.p < LEVEL and one.difference else 0
        signs.setdefault(one.by_values.measure.name, set()).add(shown)
    return {
        name: "the sign of the difference depends on the method" if {1, -1} <= of_all
        else "not every method shows a difference" if len(of_all) > 1 else ""
        for name, of_all in signs.items()
    }  # fmt: skip
