"""The same comparison by other estimators, and with the inertia held or fitted freely."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, Literal

from rigidimeter.analysis.estimation import METHODS
from rigidimeter.analysis.study.comparison import FEWEST_FOR_TEST, day_test, observed, rank_test
from rigidimeter.analysis.study.measures import MEASURES, Measure
from rigidimeter.analysis.study.results import SensitivityRow, SessionEntry
from rigidimeter.analysis.study.tested import LEVEL
from rigidimeter.core.records import Analysis, Fit, Notice

_INERTIA, _DAMPING, _STIFFNESS = MEASURES[:3]
_TEST = ("shift", "shift_low", "shift_high", "p", "r")
_STAGES: Mapping[Measure, tuple[Literal["fixed", "free"], ...]] = {
    _INERTIA: ("free",),
    _DAMPING: ("free", "fixed"),
    _STIFFNESS: ("free", "fixed"),
}


def sensitivity_methods() -> tuple[str, ...]:
    """Return the estimators that a study is analysed with besides the chosen one."""
    return tuple(method.name for method in METHODS if method.in_sensitivity)


def sensitivity_rows(
    analyses: Mapping[str, Analysis],
    chosen: str,
    sessions: Mapping[str, SessionEntry],
    pair: tuple[str, str],
) -> tuple[list[SensitivityRow], list[Notice]]:
    """Return one row for each measure, method and stage; a method that cannot says why.

    Rows are in the order of measures, then of methods, with J free before J held at its median.

    Parameters
    ----------
    analyses : mapping of str to Analysis
        By method.
    chosen : str
        The method of the study's own conclusion, with J free.
    sessions : mapping of str to SessionEntry
        By source.
    pair : (str, str)
    """
    usable: dict[str, Analysis] = {}
    notices: list[Notice] = []
    for method, analysis in analyses.items():
        lacking = _lacking(analysis.fits, pair)
        if lacking:
            text = f"the sensitivity analysis has no {method}: {lacking}"
            notices.append(Notice("warning", text))
        else:
            usable[method] = analysis
    rows = []
    for measure, stages in _STAGES.items():
        for method, analysis in usable.items():
            for inertia in stages:
                fits = analysis.fixed_inertia if inertia == "fixed" else analysis.fits
                found = rank_test(observed(measure, fits, pair, sessions))
                test: dict[str, Any] = {name: getattr(found.test, name, math.nan) for name in _TEST}
                n_reference, n_other = (found.summaries[name].n for name in pair)
                rows.append(
                    SensitivityRow(
                        measure=measure,
                        method=method,
                        inertia=inertia,
                        n_reference=n_reference,
                        n_other=n_other,
                        **test,
                        p_day=day_test(found).p,
                        chosen=method == chosen and inertia == "free",
                    )
                )
    return rows, notices


def _lacking(fits: Sequence[Fit], pair: tuple[str, str]) -> str:
    """Return why these fits give no test, else nothing; a failure says its own reason."""
    counts = {
        name: sum(fit.outcome.included and fit.condition == name for fit in fits) for name in pair
    }
    if min(counts.values()) >= FEWEST_FOR_TEST:
        return ""
    told = " and ".join(
        f"{n} epochs in {name or 'a second condition'}" for name, n in counts.items()
    )
    failed = next((fit.outcome.reason for fit in fits if fit.outcome.kind == "failed"), "")
    return f"it leaves {told}" + (f" ({failed})" if failed else "")


def method_caveats(rows: Sequence[SensitivityRow]) -> dict[str, str]:
    """Return for each measure, by name, how its conclusion depends on the method; empty if not.

    A method shows a difference where p by days, or else p over epochs, is below the level.
    """
    signs: dict[str, set[int]] = {}
    for row in rows:
        p = row.p if math.isnan(row.p_day) else row.p_day
        shown = int(math.copysign(1, row.shift)) if p < LEVEL and row.shift else 0
        signs.setdefault(row.measure.name, set()).add(shown)
    return {
        name: "the sign of the difference depends on the method" if {1, -1} <= found
        else "not every method shows a difference" if len(found) > 1 else ""
        for name, found in signs.items()
    }  # fmt: skip
