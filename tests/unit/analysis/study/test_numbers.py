"""The numbers of the first screen: differences, quality of the data, precision, ratings."""

import csv
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose
from scipy.stats import spearmanr, ttest_ind
from scipy.stats import t as t_distribution
from tests.unit.analysis.study.made import (
    NAMES,
    Design,
    alike,
    concluded,
    doubted,
    in_dbs,
    made,
    score_rows,
)

from rigidimeter.analysis.statistics import day_difference
from rigidimeter.analysis.study import (
    MEASURES,
    Columns,
    Compared,
    OfMethod,
    Study,
    agreement,
    analysis_study,
    as_rows,
    by_units,
    compare_values,
    conclude,
    conclude_study,
    conclusion_rows,
    corrected,
    counting,
    day_tests,
    ratings_of,
    read_rows,
    relations,
    result_table,
    table_study,
    traffic_light,
    write_rows,
)
from rigidimeter.core.errors import UserError
from rigidimeter.core.findings import Finding
from rigidimeter.core.records import Fit, Outcome

J, B, K = (one.name for one in MEASURES[:3])
STIFFNESS = MEASURES[2]
REFERENCE = Path(__file__).parents[3] / "reference" / "mixed"


@pytest.fixture(scope="module")
def study() -> Study:
    return made()


class TestDifference:
    """Other − reference, in per cent of the reference."""

    ONE = Compared(
        STIFFNESS, *NAMES, "days", (9, 9), value_reference=2.0, value_other=1.5, difference=-0.5,
        low=-0.9, high=-0.1, p=0.01, measured_half=0.05,
    )  # fmt: skip

    def test_every_number_is_under_the_keys_of_the_document(self) -> None:
        found = self.ONE.numbers()
        sizes = (-0.5, -0.9, -0.1, -25, -45, -5, -0.55, -0.45, -27.5, -22.5)
        names = [name for name in found if name.startswith(("difference", "measured"))]
        assert [found[name] for name in names] == pytest.approx(sizes)
        ends = [f"{name}{end}" for name in ("difference", "difference_percent", "measured",
                "measured_percent") for end in ("", "_low", "_high")]  # fmt: skip
        assert names == [name for name in ends if name not in ("measured", "measured_percent")]
        assert [found[name] for name in found if name not in names] == ["mean", 2.0, 1.5, 0.01]

    @pytest.mark.parametrize(
        "odd", [{"value_reference": -2.0}, {"value_reference": 0.0}, {"ratio": False}]
    )
    def test_there_is_no_per_cent_where_it_has_no_meaning(self, odd) -> None:
        found = replace(self.ONE, **odd).numbers()
        assert all(math.isnan(found[name]) for name in found if "percent" in name)

    def test_means_and_interval_are_those_of_the_test_by_days(self, study: Study) -> None:
        """No day has both: Welch's test of the means of the days."""
        rows = counting(study.rows, K)
        means = rows.groupby(["condition", "day"], observed=True)["value"].mean()
        expected = ttest_ind(means["OFF"], means["DBS"], equal_var=False)
        found = concluded(study)[K]
        assert (found.value_reference, found.value_other) == pytest.approx(
            [means["OFF"].mean(), means["DBS"].mean()]
        )
        assert found.p == pytest.approx(expected.pvalue, rel=0.1)
        assert 0 < 2 * found.measured_half < 0.3 * (found.high - found.low)

    @pytest.mark.parametrize(
        ("by", "test"),
        [
            ("days", "Welch's t-test of 5 days of OFF and 4 days of DBS"),
            ("recordings", "Welch's t-test of 5 recordings of OFF and 4 recordings of DBS"),
            ("blocks", "Welch's t-test of 10 blocks of OFF and 8 blocks of DBS"),
        ],
    )
    def test_what_counts_as_one_is_tested(self, study: Study, by: str, test: str) -> None:
        rows = counting(study.rows, K)
        rows = rows.assign(block=np.where(rows["epoch"] < "p03", "1", "2"))
        one = by_units(rows, STIFFNESS, NAMES, by)
        assert one.test == test
        if by == "days":
            x, y = (rows[rows["condition"] == name] for name in NAMES)
            found = day_difference(x["value"], y["value"], [*x["day"]], [*y["day"]], names=NAMES)
            assert one.of_test == (-found.estimate, -found.high, -found.low)
            assert (one.p, one.df, one.se, one.units) == (found.p, found.df, found.se, (5, 4))

    def test_too_many_values_are_refused_alone_and_a_remark_beside_days(self) -> None:
        many = as_rows(
            {"day": day, "session": day, "unit": day, "condition": name, "method": "iv",
             "measure": K, "value": value}
            for day in "12" for name in NAMES for value in np.linspace(1.0, 2.0, 3600)
        )  # fmt: skip
        (one,) = compare_values(Study(many, *NAMES))
        assert "make 5.2e+07 pairs" in one.remark
        with pytest.raises(UserError, match=r"make 5\.2e\+07 pairs"):
            day_tests(Study(many.assign(day="", method=""), *NAMES))

    def test_one_condition_alone_is_not_concluded(self, study: Study) -> None:
        alone = replace(study, other="", ratings=None)
        tests = day_tests(alone)
        assert {one.remark for one in tests} == {"only one condition was recorded"}
        assert conclude(alone, tests) == ()

    @pytest.mark.parametrize("ending", [".parquet", ".csv"])
    def test_rows_of_a_file_are_concluded_alike(self, tmp_path: Path, ending: str) -> None:
        study = made(fit=doubted("tremor"), rated=False)
        write_rows(tmp_path / f"rows{ending}", study.rows)
        again = replace(study, rows=read_rows(tmp_path / f"rows{ending}"))
        found, expected = (conclusion_rows(concluded(one).values()) for one in (again, study))
        assert str(found) == str(expected)
        assert found[0]["finding"] == "flagged_epochs"

    @pytest.mark.parametrize("design", [Design(), Design(effect=0.0), Design(both_on_a_day=True)])
    def test_the_interval_excludes_zero_where_p_is_below_the_level(self, design: Design) -> None:
        for one in concluded(made(design)).values():
            assert (one.p < 0.05) == (one.low > 0 or one.high < 0)
            assert one.difference == pytest.approx(one.value_other - one.value_reference, rel=1e-9)
            assert one.low < one.difference < one.high

    def test_values_of_a_table_have_medians_and_the_shift(self) -> None:
        values = [*range(1, 11), *range(21, 31)]
        table = pd.DataFrame({"condition": ["a"] * 10 + ["b"] * 10, "k": values})
        found = concluded(table_study(table, Columns(["k"])))["k"]
        assert (found.numbers()["centre"], found.value_reference, found.value_other) == (
            *("median", 5.5, 25.5),
        )
        assert found.difference == 20.0
        assert 0 < found.low < 20.0 < found.high
        assert math.isnan(found.measured_half)


def compared(*days: tuple[str, str, list[float], list[float]], measure=STIFFNESS) -> Compared:
    """Return the difference of (condition, day, values, halves of their intervals)."""
    return by_units(as_rows(
        {"subject": "M1", "day": day, "session": f"{day}-{name}", "unit": day, "condition": name,
         "method": "iv", "measure": measure.name, "value": value, "low": value - half,
         "high": value + half}
        for name, day, values, halves in days
        for value, half in zip(values, halves, strict=True)
    ).astype({"day": str, "session": str, "condition": str}), measure, NAMES)  # fmt: skip


class TestMeasured:
    """half = √(Σ w²h²) over the epochs of both conditions, with the weights of the test."""

    def test_days_of_unequal_numbers_of_epochs_and_a_day_with_one_condition(self) -> None:
        """Days 1 to 3 have both, day 4 OFF alone, so OFF weighs them as least squares does.

        At a correlation of ½ of 3 pairs and 1 of OFF alone (1 + 4)α' − 2β' = 1 and −2α' + 4β' = −1
        give α' = 1/8 for the day of OFF alone, so (1 − 1/8)/3 = 7/24 for each of the pairs; those
        of DBS have 1/3. An epoch has the weight of its day over the number of its epochs.
        """
        found = compared(
            ("OFF", "1", [2.0, 2.2], [0.1, 0.2]),
            ("OFF", "2", [1.9], [0.3]),
            ("OFF", "3", [2.1, 2.2, 2.3], [0.1, 0.1, 0.1]),
            ("OFF", "4", [1.6, 1.8], [0.2, 0.2]),
            ("DBS", "1", [1.5], [0.1]),
            ("DBS", "2", [1.4, 1.6], [0.2, 0.1]),
            ("DBS", "3", [1.3], [0.3]),
        )
        pair, alone, dbs = 7 / 24, 1 / 8, 1 / 3
        first = pair * (2.1 + 1.9 + 2.2) + alone * 1.7
        assert found.value_reference == pytest.approx(first, rel=1e-12)
        assert found.value_other == pytest.approx((1.5 + 1.5 + 1.3) / 3, rel=1e-12)
        squares = [
            (pair / 2) ** 2 * (0.1**2 + 0.2**2),
            pair**2 * 0.3**2,
            (pair / 3) ** 2 * 3 * 0.1**2,
            (alone / 2) ** 2 * 2 * 0.2**2,
            dbs**2 * 0.1**2,
            (dbs / 2) ** 2 * (0.2**2 + 0.1**2),
            dbs**2 * 0.3**2,
        ]
        assert found.measured_half == pytest.approx(math.sqrt(sum(squares)), rel=1e-12)
        assert found.measured_half == pytest.approx(0.147702, abs=1e-6)

    @pytest.mark.parametrize(
        ("off", "halves", "of_dbs", "expected"),
        [
            # Without a test days count alike.
            ([2.0, 2.2, 2.4], [0.1, 0.2, 0.3], 0.1, math.sqrt((0.01 + 0.04 + 0.09) / 9 + 0.01)),
            # Never narrower than what the instrument is accurate to: 0.1 % of the mean of both.
            ([2.0, 2.0], [1e-6] * 2, 1e-6, 0.001 * (2.0 + 1.5) / 2),
            ([2.0, 2.0], [1e-3] * 2, 2e-3, math.sqrt(1e-6 / 2 + 4e-6)),
            # An epoch without an interval leaves it unknown.
            ([2.0, 2.0], [0.1, math.nan], 0.1, math.nan),
        ],
    )
    def test_one_day_in_each_condition(self, off, halves, of_dbs, expected) -> None:
        found = compared(("OFF", "1", off, halves), ("DBS", "1", [1.5], [of_dbs]))
        assert math.isnan(found.p)
        assert found.difference == pytest.approx(1.5 - np.mean(off))
        assert_allclose(found.measured_half, expected, rtol=1e-9)

    def test_scores_and_ratings_have_none(self, study: Study) -> None:
        found = concluded(study)
        for measure in ("impulse_nm_s", "work_j", "rating"):
            assert math.isnan(found[measure].measured_half)


def pooled(name: str) -> Fit:
    finding = Finding(name, "caution", 2.0, 1.0)
    return replace(made().analysis.fits[-1], epoch="pooled", condition="OFF", findings=(finding,))


def test_a_table_of_numbers_has_no_quality() -> None:
    table = pd.DataFrame({"condition": ["a"] * 4 + ["b"] * 4, "k": range(8)})
    assert traffic_light(table_study(table, Columns(["k"])), ()) is None


class TestPrecision:
    def test_epochs_for_five_per_cent(self) -> None:
        """A standard error of 10 % from one epoch: (1.96 · 10 / 5)² = 15.4 epochs."""
        analysis = made().analysis
        fit = next(one for one in analysis.fits if one.outcome.included)
        ends = {"low": 0.8 * fit.value, "high": 1.2 * fit.value}
        wide = replace(fit, condition="OFF", se=0.1 * fit.value, **ends)
        alone = analysis_study(replace(analysis, fits=(wide,), fixed_inertia=(wide,)), ("OFF", ""))
        found = result_table(conclude_study(alone, resamples=0), "precision")
        assert [one["measure"] for one in found[:3]] == [K, B, J]
        for one in found[:3]:
            assert (one["epochs"], one["epochs_for_5_percent"]) == (1, 16)
            assert one["half_width_percent"] == pytest.approx(20.0)
        own = [score.work_j for score in analysis.scores if score.condition == "OFF"]
        (work,) = (one for one in found if one["measure"] == "work_j")
        half = t_distribution.ppf(0.975, len(own) - 1) * np.std(own, ddof=1) / math.sqrt(len(own))
        assert (work["epochs"], work["value"]) == (len(own), pytest.approx(np.mean(own)))
        assert (work["low"], work["high"]) == pytest.approx(
            (work["value"] - half, work["value"] + half)
        )

    def test_two_conditions_have_it_where_nothing_could_be_tested(self, study: Study) -> None:
        """What the epochs of a single day give is shown, for each condition."""
        assert result_table(conclude_study(study, resamples=0), "precision") == []
        one_day = made(
            Design(days=(1, 1), both_on_a_day=True),
            rated=False,
            entry=lambda one: one._replace(day="1"),
        )
        found = result_table(conclude_study(one_day, resamples=0), "precision")
        values = counting(one_day.rows, K).groupby("condition")["value"]
        stiffness = {one["condition"]: one for one in found if one["measure"] == K}
        for name in NAMES:
            own = values.get_group(name)
            assert (stiffness[name]["epochs"], stiffness[name]["value"]) == (
                len(own),
                pytest.approx(own.mean()),
            )

    def test_a_condition_without_an_epoch_has_not_those_of_the_other(self) -> None:
        """The only fit to epochs together is then that of the other condition."""
        lost = Outcome("excluded", "the arm touched the position limit")
        study = made(
            fit=lambda one: replace(one, outcome=lost) if in_dbs(one) else one,
            score=lambda one: one if in_dbs(one) and one.epoch == "s01" else None,
            pooled=[replace(pooled("tremor"), findings=())],
            rated=False,
        )
        found = result_table(conclude_study(study, resamples=0), "precision")
        of_each = {name: [o for o in found if o["condition"] == name] for name in NAMES}
        assert of_each["OFF"][0]["value"] == study.analysis.pooled[0].stiffness_nm_rad
        assert [one["measure"] for one in of_each["DBS"]] == ["impulse_nm_s", "work_j"]


class TestMethods:
    """How a conclusion depends on the method."""

    @pytest.mark.parametrize(
        ("effects", "caveat"),
        [
            ((0.3, 0.3), ""),
            ((0.0, 0.0), ""),
            ((0.3, 0.0), "not every method shows a difference"),
            ((0.3, -0.3), "the sign of the difference depends on the method"),
        ],
    )
    def test_it_is_named_beside_the_verdict(self, effects, caveat: str) -> None:
        study = made(fit=alike([1.0, 1.0, 1.0]), rated=False)
        measure = MEASURES[1]
        rows = counting(study.rows, measure.name)
        found = []
        for method, effect in zip(("published", "iv"), effects, strict=True):
            changed = rows["value"].where(rows["condition"] != "DBS", rows["value"] * (1 - effect))
            by_days = by_units(rows.assign(value=changed), measure, NAMES)
            values = replace(by_days, by="values", statistic=None)
            found.append(OfMethod(method, "fixed", False, values, by_days))
        result = replace(conclude_study(study, resamples=0), methods=tuple(found))
        table = {row["measure"]: row["caveat"] for row in result_table(result, "conclusion")}
        assert table[measure.name] == caveat
        assert table[K] == ""

    def test_each_is_a_row_with_j_free_and_held(self, study: Study) -> None:
        found = result_table(conclude_study(study, resamples=0), "sensitivity")
        assert len(found) == 15
        assert {row["inertia"] for row in found if row["measure"] == J} == {"free"}
        assert [row["method"] for row in found if row["chosen"]] == ["iv"] * 3
        shifts = [row["shift"] for row in found if row["measure"] == K]
        assert np.all(np.array(shifts) > 0)


class TestRatings:
    def test_the_contrast_by_days_is_that_of_r(self) -> None:
        """lme4 and pbkrtest, of examiners and days."""
        with (REFERENCE / "scores.csv").open() as file:
            rows = [row for row in csv.DictReader(file) if row["dataset"] == "days"]
        with (REFERENCE / "r_reference.csv").open() as file:
            r = {o["quantity"]: float(o["value"]) for o in csv.DictReader(file)
                 if o["dataset"] == "days"}  # fmt: skip
        records = [(row["condition"], row["examiner"], "M1", row["day"], float(row["score"]))
                   for row in rows]  # fmt: skip
        found = ratings_of("scores.csv", score_rows(records), ["examiner"])
        first, second = dict.fromkeys(record[0] for record in records)
        (test,) = day_tests(Study(corrected(found), first, second, ratings=found))
        key = f"{first}-{second}" if f"estimate_{first}-{second}" in r else f"{second}-{first}"
        assert test.p == pytest.approx(r[f"p_kenward_roger_{key}"], rel=1e-4)
        assert abs(test.difference) == pytest.approx(abs(r[f"estimate_{key}"]), rel=1e-5)
        assert test.df == pytest.approx(r[f"df_kenward_roger_{key}"], rel=1e-4)

    def test_a_point_of_the_relation_is_a_day_in_a_condition(self, study: Study) -> None:
        found = result_table(conclude_study(study, resamples=0), "rating_relation")
        assert [one["measure"] for one in found] == [K, B, "work_j"]
        means = [
            counting(study.rows, name).groupby(["subject", "day", "condition"])["value"].mean()
            for name in (K, "rating")
        ]
        both = pd.concat(means, axis=1, keys=["k", "rating"]).dropna()
        assert len(both) == 9
        rho = spearmanr(both["k"], both["rating"]).statistic
        assert rho in [pytest.approx(one) for one in found[0].values() if isinstance(one, float)]
        none = conclude_study(made(rated=False), resamples=0)
        assert result_table(none, "rating_relation") == []

    def test_pairs_of_examiners_of_one_day_and_condition(self) -> None:
        records = (
            ("OFF", "A", "M", "1", 2.0),
            ("OFF", "B", "M", "1", 2.0),
            ("OFF", "C", "M", "1", 3.0),
            ("DBS", "A", "M", "1", 1.0),
            ("DBS", "A", "M", "2", 1.0),
            ("DBS", "B", "M", "2", 1.5),
            ("OFF", "A", "M", "2", 2.0),
            ("OFF", "B", "M", "2", 2.5),
        )
        found = agreement(ratings_of("ratings.csv", score_rows(records), ["examiner"]))
        assert (found.pairs, found.equal) == (5, 1)
        assert found.mean_difference == pytest.approx((0 + 1 + 1 + 0.5 + 0.5) / 5)

    def test_visits_with_the_same_scores_tie_in_whatever_order_they_come(self) -> None:
        scores = {"1": (0.1, 0.2, 0.3), "2": (0.3, 0.2, 0.1), "3": (2.0, 2.0, 2.0)}
        given = [("rating", day, score) for day, own in scores.items() for score in own]
        rows = as_rows(
            {"subject": "M", "day": day, "condition": "OFF", "method": "one", "measure": name}
            | {"value": value}
            for name, day, value in [*given, *((K, day, float(day)) for day in scores)]
        )
        (found,) = relations(rows)
        assert found.ratings[0] == found.ratings[1]
