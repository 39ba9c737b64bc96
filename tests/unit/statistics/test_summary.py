import math

import pytest

from rigidimeter.statistics import Summary, summarise


def test_quartiles_are_those_of_r_type_7() -> None:
    # R: quantile(c(1, 2, 4, 8), c(.25, .5, .75)) is 1.75, 3, 5.
    assert summarise([8.0, 1.0, 4.0, 2.0]) == Summary(n=4, median=3.0, q1=1.75, q3=5.0)


def test_one_value_is_its_own_quartiles() -> None:
    assert summarise([0.3]) == Summary(n=1, median=0.3, q1=0.3, q3=0.3)


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
