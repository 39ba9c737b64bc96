"""What was measured, tested and concluded says what the numbers say, and no more.

All of it is in `answers.txt`, a part for each study here.
"""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from tests.unit.analysis.study.held import hold, said
from tests.unit.analysis.study.made import (
    JOINT,
    Design,
    alike,
    doubted,
    first,
    in_dbs,
    made,
    nothing,
)

from rigidimeter.analysis.study import (
    Columns,
    Compared,
    LeftOut,
    Primary,
    analysis_study,
    conclude,
    day_tests,
    lead,
    statement,
    table_study,
)
from rigidimeter.core.findings import Finding
from rigidimeter.core.records import Analysis, Fit, Outcome
from rigidimeter.core.study_files import PrimaryTable


def once(stiffness: float, percent: float = 0.2) -> dict[str, Any]:
    """Return one recording of each condition, six epochs long, of which no day is known.

    K of DBS is given; `percent` is half the interval of each epoch.
    """

    def change(fit: Fit) -> Fit | None:
        own = np.array([*JOINT[:2], stiffness if in_dbs(fit) else 1.751])
        value = own * (1 + 1e-4 * (int(fit.epoch[1:]) - 3.5))
        half = percent / 100 * value
        ends = {"se": half / 2, "low": value - half, "high": value + half}
        return first(replace(fit, outcome=Outcome(), value=value, **ends))

    design = Design(epochs=6, scores=0)
    return {"design": design, "fit": change, "score": nothing, "days_known": False}


def untested(one: Compared) -> Compared:
    """Return a test of work that the days do not allow."""
    missing = dict.fromkeys(("p", "low", "high", "se", "df"), math.nan)
    remark = {"remark": "one day in each condition", "test": "", "statistic": None}
    return replace(one, **missing, **remark) if one.measure.short == "work" else one


def turned(*names: str) -> Callable[[Compared], Compared]:
    """Return the change that gives differences the other sign; of all measures without names."""

    def change(one: Compared) -> Compared:
        sizes = {"difference": -one.difference, "low": -one.high, "high": -one.low}
        own = not names or one.measure.short in names
        return replace(one, sign=-one.sign, **sizes) if own else one

    return change


def weaker(one: Compared) -> Compared:
    """Return a p that one measure alone would bear."""
    return replace(one, p=0.03 if one.measure.short == "work" else 0.6)


def alone(*origins: str) -> Callable[[Compared], Compared | None]:
    return lambda one: one if one.measure.origin in origins else None


def declared(*measures: str, rule: str = "holm") -> dict[str, Primary]:
    table = PrimaryTable(measures=list(measures), rule=rule)
    return {"primary": Primary(table, "study.toml")}


TREMOR = Finding(
    "tremor", "caution", 2.0, 1.0, facts={"frequency_hz": 5.0, "amplitude_nm": 0.2, "stands_out": 9}
)
SHAKEN = {"fit": lambda one: replace(one, findings=(TREMOR,)) if in_dbs(one) else one}
VARYING = Fit("", "pooled", "OFF", "iv", Outcome(), JOINT, findings=(
    Finding("varying_between_epochs", "caution", 2.0, 1.0),))  # fmt: skip


def turned_inertia(one: Fit) -> Fit:
    return replace(one, value=-one.value) if one.epoch == "p03" else one


LOST = tuple(LeftOut(f"{k}.csv", "M1", "9", "DBS", "in degrees") for k in (1, 2))
SUBJECTS = {"design": Design(scores=0, day_scatter=0.01), "rated": False}
STUDIES: dict[str, tuple[dict[str, Any], Callable[[Compared], Compared | None] | None]] = {
    "a clear effect": ({}, None),
    "no effect": ({"design": Design(effect=0.0)}, None),
    "the other sign": ({}, turned()),
    "both signs": ({}, turned("B")),
    "scores and ratings alone": ({}, alone("scores", "ratings")),
    "the check alone": ({}, lambda one: one if one.measure.short == "J" else None),
    "a measure without a test": ({}, untested),
    "p of one measure alone": ({}, weaker),
    "what one condition has": ({"rated": False, "fit": lambda o: None if in_dbs(o) else o,
                                "score": lambda o: None if in_dbs(o) else o}, None),
    "one recording of each": (once(1.3), None),
    "one recording of each, higher and exact": (once(1.751 * 1.2576, 0.01), None),
    "one recording of each, inexact": (once(1.3, 3.0), None),
    "one recording of each, with scores": (
        {"fit": first, "score": first, "days_known": False}, None),
    "one recording of both": (
        {"fit": lambda o: first(o) and replace(o, source="x.csv"), "score": nothing,
         "days_known": False}, None),
    "two days": ({"design": Design(days=(2, 2), both_on_a_day=True)}, None),
    "two subjects": ({**SUBJECTS, "design": Design(scores=0, day_scatter=0.01,
                                                   subjects=("A", "B"))}, None),
    "three subjects": ({**SUBJECTS, "design": Design(scores=0, day_scatter=0.01,
                                                     subjects=("A", "B", "C"))}, None),
    "withheld": (SHAKEN, None),
    "a sequence": (declared("damping_nm_s_rad", "stiffness_nm_rad", rule="sequence"), None),
    "one declared measure": (declared("stiffness_nm_rad"), None),
    "a caution of the inertia": ({"fit": alike([1.04, 0.8, 0.8])}, None),
    # The quality of the data: poor, and what is in the scatter between epochs already.
    "most epochs doubted": ({"fit": doubted("tremor", bool), "score": nothing}, None),
    "an impossible inertia": ({"fit": turned_inertia}, None),
    "epochs that vary": ({"pooled": [VARYING]}, None),
    "one condition whose epochs vary": ({"pooled": [VARYING], "rated": False, "other": ""}, None),
    "virtual and blinded": ({"virtual": True, "blinded": True}, None),
    "one session left out": ({"left_out": LOST[:1]}, None),
    "two sessions left out": ({"left_out": LOST}, None),
}  # fmt: skip


def random(seed: int) -> dict[str, Any]:
    """Return a study that is unbalanced in every way."""
    rng = np.random.default_rng(seed)
    checks = ("tremor", "lack_of_fit", "between_samples", "emg_activity")
    often = float(rng.choice([0.0, 0.1, 0.6]))

    def fit(one: Fit) -> Fit | None:
        found = Finding(str(rng.choice(checks)), "caution", 2.0, 1.0)
        flagged = rng.random() < (often if in_dbs(one) else 0.05)
        kept = replace(one, findings=(found,)) if flagged else one
        return kept if rng.random() < 0.7 else None

    def entry(one: Any) -> Any:
        return one._replace(group=groups[one.subject])

    names = tuple(f"S{k}" for k in range(rng.integers(1, 5)))
    groups = dict(zip(names, rng.choice(["", "patients", "controls"], len(names)), strict=True))
    days = tuple(int(n) for n in rng.integers(1, 7, 2))
    design = Design(days, int(rng.integers(1, 6)), int(rng.integers(0, 4)), names,
                    float(rng.choice([-1.0, 0.0, 0.5, 1.5])),
                    float(rng.choice([0.001, 0.05, 0.2])), bool(rng.random() < 0.5))  # fmt: skip
    return {"design": design, "fit": fit, "entry": entry, "rated": bool(rng.random() < 0.5)}


STUDIES |= {f"random {seed:02d}": (random(seed), None) for seed in range(16)}


@pytest.mark.parametrize("name", STUDIES)
def test_all_that_is_said(name: str) -> None:
    given, change = STUDIES[name]
    study = made(**given)
    tests = [*filter(None, map(change or (lambda one: one), day_tests(study)))]
    hold(name, said(study, conclude(study, tests)))


def test_half_of_the_interval_of_recordings_alone() -> None:
    """0.2 % of each of 6 epochs: √(1.751² + 1.3²) · 0.2 %/√6; of exact ones 0.1 % of the mean."""
    study = made(**once(1.3))
    stiffness = conclude(study, day_tests(study))[0]
    half = 0.002 / math.sqrt(6) * math.hypot(1.751, 1.3)
    assert stiffness.measured_half == pytest.approx(half, rel=1e-6)


@pytest.mark.parametrize("name", ["DBS", ""])
def test_one_condition_has_its_values_and_no_statements(name: str) -> None:
    own = [replace(fit, condition=name) for fit in made().analysis.fits if in_dbs(fit)]
    lost = [Fit("a.csv", "1", "OFF", "iv", Outcome("failed", "no torque"))]
    for fits, words in ((own, "95 % intervals"), (lost, "No epoch could be included"), ([], "No")):
        analysis = Analysis("iv", tuple(fits), tuple(fits), 0.0045, ())
        study = analysis_study(analysis, (name, ""))
        assert statement(study, ()) is None
        assert words in lead(study, ())
        assert lead(study, ()).startswith(f"{name}: stiffness K " if name else "Stiffness K ") or (
            fits is not own
        )


def rows(reference: list[float], other: list[float]) -> pd.DataFrame:
    """Return values of days 1, 2, … in both conditions, two of each day."""
    return pd.DataFrame(
        {"subject": "S1", "day": day, "condition": condition, "k": value + end}
        for condition, own in (("OFF", reference), ("DBS", other))
        for day, value in enumerate(own, start=1)
        for end in (-1e-3, 1e-3)
    )


def many_measures() -> pd.DataFrame:
    """Return a table whose k is found alone and not after the adjustment for seven others."""
    table = rows([1.0] * 5, [0.93, 0.97, 0.91, 0.99, 0.95])
    table = table.assign(a=1 + 0.01 * np.sin(7 * table.index))
    table = table.assign(**{name: table["a"] + 0.003 * k for k, name in enumerate("bcdefg")})
    table["k"] += 0.02 * (table["day"] == 2) - 0.11 * (table["k"] - 1.0) ** 2
    table.loc[(table["day"] == 4) & (table["condition"] == "DBS"), "k"] += 0.01
    return table


def stepped() -> pd.DataFrame:
    """Return four conditions, two of which lower k."""
    levels = {"OFF": 1.75, "1 mA": 1.75, "2 mA": 1.4, "3 mA": 1.2}
    rng = np.random.default_rng(4)
    return pd.DataFrame(
        {"day": day, "condition": name, "k": value + 0.1 * rng.standard_normal()}
        for day in range(8)
        for name, value in levels.items()
    )


def values(first: Any, second: Any) -> pd.DataFrame:
    names = ["OFF"] * len(first) + ["DBS"] * len(second)
    return pd.DataFrame({"condition": names, "k": [*first, *second]})


def grouped(patients: float, controls: float) -> pd.DataFrame:
    """Return two values a day and condition, two days a subject; effects as shares of OFF."""
    return pd.DataFrame(
        {
            "subject": f"{group}{k}", "day": day, "condition": condition, "group": group,
            "k": 1.7 * (1 + 0.02 * ((3 * k + 5 * day) % 7 - 3))
            * (1 + (effect + 0.01 * (k % 3 - 1)) * (condition == "ON"))
            * (1 + 0.004 * (epoch - 0.5)),
        }
        for group, effect in (("patients", patients), ("controls", controls))
        for k in range(6)
        for day in range(2)
        for condition in ("OFF", "ON")
        for epoch in range(2)
    )  # fmt: skip


def two_days() -> pd.DataFrame:
    """Return epochs that scatter by 2 %, and nothing between days; b does not differ at all."""
    rng = np.random.default_rng(3)
    return pd.DataFrame(
        {"subject": "S1", "day": day, "condition": name, "k": level * (1 + 0.02 * x),
         "b": 1 + 0.1 * rng.standard_normal()}
        for day in (1, 2)
        for name, level in (("OFF", 1.75), ("DBS", 1.435))
        for x in rng.standard_normal(8)
    )  # fmt: skip


ALIKE = np.random.default_rng(1).normal(5.0, 1.0, (2, 80))
TEN = values(range(10), range(20, 30))
AROUND_ZERO = rows([-0.2, 0.1, 0.15, -0.05, 0.01], [0.1, -0.1, 0.2, -0.3, 0.05])
BOTH = grouped(-0.18, -0.18)
ONE_EACH = BOTH[(BOTH["group"] == "patients") == (BOTH["condition"] == "ON")]
SPLIT = {"side": ["left", "right"] * 48, "visit": [1, 1, 2, 2] * 24}
TABLES: dict[str, tuple[pd.DataFrame, dict[str, Any]]] = {
    "table: adjusted for eight": (many_measures(), {"columns": Columns([*"kabcdefg"])}),
    "table: values of both signs": (AROUND_ZERO, {}),
    "table: three against three": (values([1, 2, 3], [4, 5, 6]), {}),
    "table: ten against ten": (TEN, {}),
    "table: ten against ten, turned": (TEN, {"pair": ("DBS", "OFF")}),
    "table: four conditions": (stepped(), {}),
    "table: two of four conditions": (stepped(), {"pair": ("OFF", "2 mA")}),
    # Two days conclude no absence: there is still one degree of freedom.
    "table: two days": (two_days(), {"columns": Columns(["k", "b"])}),
    "table: many values that do not differ": (values(*ALIKE), {}),
    "table: few values that do not differ": (values(*ALIKE[:, :6]), {}),
    # A difference of one group alone is claimed of no group; opposite ones are not none.
    "groups: one differs": (grouped(-0.18, 0.0), {}),
    "groups: they differ in sign": (grouped(-0.18, 0.18), {}),
    "groups: each differs": (grouped(-0.18, -0.12), {}),
    "groups: the one that differs": (grouped(-0.18, 0.0), {"group": "patients"}),
    "groups: the other": (grouped(-0.18, 0.0), {"group": "controls"}),
    # Groups of one condition each cannot be told from it; under another heading they are none.
    "groups: one condition each": (ONE_EACH, {}),
    "groups: the conditions": (ONE_EACH.assign(group=ONE_EACH["condition"]), {}),
    "groups: other columns split": (BOTH.assign(**SPLIT), {}),
    "groups: other columns do not": (BOTH.assign(note="", mass_kg=range(96)), {}),
}


@pytest.mark.parametrize("name", TABLES)
def test_all_that_is_said_of_a_table(name: str) -> None:
    table, options = TABLES[name]
    study = table_study(table, **{"columns": Columns(["k"])} | options)
    hold(name, said(study, conclude(study, day_tests(study))))
