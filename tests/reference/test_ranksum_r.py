"""The rank-sum test against R (`wilcox.test` and coin), whose script lies beside the numbers."""

import csv
from collections import defaultdict

import pytest
from tests.shared_files import SHARED, skip_without

from rigidimeter.analysis.statistics import RankSum, ranksum

UNIROOT_TOLERANCE = 1e-4
DATASETS = ("visc_like_78_23", "ties_27_12")


def rows(name: str) -> list[dict[str, str]]:
    path = SHARED / "reference" / "ranksum" / name
    if not path.is_file():
        skip_without()
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


@pytest.fixture(params=DATASETS)
def case(request: pytest.FixtureRequest) -> tuple[RankSum, dict[str, float]]:
    samples = defaultdict(list)
    for row in rows("data.csv"):
        if row["dataset"] == request.param:
            samples[row["condition"]].append(float(row["value"]))
    expected = {
        row["quantity"]: float(row["value"])
        for row in rows("r_reference.csv")
        if row["dataset"] == request.param
    }
    return ranksum(samples["OFF"], samples["DBS"]), expected


def test_statistic_and_p_agree_with_r(case: tuple[RankSum, dict[str, float]]) -> None:
    test, r = case
    assert test.u == r["W"]
    assert test.p == pytest.approx(r["p_cc"], rel=1e-12)
    assert test.p_uncorrected == pytest.approx(r["p_nocc"], rel=1e-12)
    assert test.p_uncorrected == pytest.approx(r["coin_p"], rel=1e-12)
    assert test.z_uncorrected == pytest.approx(r["z_nocc"], rel=1e-12)
    assert test.z_uncorrected == pytest.approx(r["coin_Z"], rel=1e-12)


def test_shift_is_the_median_difference_and_its_interval_is_r_s(
    case: tuple[RankSum, dict[str, float]],
) -> None:
    test, r = case
    assert test.shift == pytest.approx(r["HL_median_diffs"], abs=1e-15)
    assert test.shift == pytest.approx(r["HL_asym"], abs=UNIROOT_TOLERANCE)
    assert test.shift_low == pytest.approx(r["HL_lo"], abs=UNIROOT_TOLERANCE)
    assert test.shift_high == pytest.approx(r["HL_hi"], abs=UNIROOT_TOLERANCE)
