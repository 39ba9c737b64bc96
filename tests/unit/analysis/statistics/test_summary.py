import math

import pytest

from rigidimeter.analysis.statistics import summarise


def test_quartiles_are_those_of_r_type_7() -> None:
    # R: quantile(c(1, 2, 4, 8), c(.25, .5, .75)) is 1.75, 3, 5.
    found = summarise([8.0, 1.0, 4.0, 2.0])
    assert (found.n, found.median, found.q1, found.q3) == (4, 3.0, 1.75, 5.0)


def test_the_scatter_is_in_per_cent_of_the_mean() -> None:
    # (8, 1, 4, 2): mean 3.75, sum of squares about it 28.75, so SD √(28.75/3) = 3.0957.
    assert summarise([8.0, 1.0, 4.0, 2.0]).sd_percent == pytest.approx(82.552, abs=1e-3)
    assert summarise([5.0, 5.0]).sd_percent == 0.0
    for unknown in ([5.0], [-1.0, 0.5]):
        assert math.isnan(summarise(unknown).sd_percent)


def test_one_value_is_its_own_quartiles() -> None:
    found = summarise([0.3])
    assert (found.n, found.median, found.q1, found.q3) == (1, 0.3, 0.3, 0.3)


def test_an_empty_sample_has_no_numbers() -> None:
    summary = summarise([])
    assert summary.n == 0
    assert all(math.isnan(value) for value in (summary.median, summary.q1, summary.q3))


@pytest.mark.parametrize(
    ("values", "message"), [([1.0, math.nan], "must be finite"), ([[1.0]], "one-dimensional")]
)
def test_bad_samples_are_refused(values: list[float], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        summarise(values)
