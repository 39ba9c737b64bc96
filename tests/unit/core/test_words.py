"""Numbers with their errors, lines and small tables as people read them."""

import doctest
import inspect
import math

import numpy as np
import pytest

from rigidimeter.core.words import html_table, number, one_line, with_error


@pytest.mark.parametrize("one", [number, with_error], ids=["numbers", "text"])
def test_the_examples_of_the_docstrings_hold(one) -> None:
    found = doctest.testmod(inspect.getmodule(one))
    assert found.attempted
    assert found.failed == 0


@pytest.mark.parametrize(
    ("value", "error", "shown"),
    [
        (1.7, 0.0996, "1.70 ± 0.10"),  # the error is rounded before its digits are counted
        (1.7, 0.00949, "1.7000 ± 0.0095"),
        (-0.5, 12.0, "0 ± 12"),
        (0.0, 0.02, "0.000 ± 0.020"),
        (-4.5e-3, 8.1e-6, "(−4.5000 ± 0.0081)·10⁻³"),
        (123456.0, 789.0, "(123.46 ± 0.79)·10³"),
        (np.float64(1.5), np.float64(math.nan), "1.5"),
        (1.5, 0.0, "1.5"),
        (-4.53712e-3, math.nan, "−4.537·10⁻³"),
        (0.0, math.nan, "0"),
        (1.5, math.inf, "1.5 ± inf"),
        (1.5, 1e-14, "1.5 ± 1·10⁻¹⁴"),
        (math.nan, 0.1, "–"),
    ],
)
def test_a_number_goes_to_the_place_of_the_second_digit_of_its_error(value, error, shown) -> None:
    assert with_error(value, error) == shown


LOWERED = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")


def test_what_is_written_reads_as_the_number_within_half_a_digit_of_its_error() -> None:
    rng = np.random.default_rng(3)
    for value, error in zip(
        rng.standard_normal(300) * 10.0 ** rng.uniform(-6, 8, 300),
        10.0 ** rng.uniform(-8, 8, 300),
        strict=True,
    ):
        if error < 1e-8 * abs(value):
            continue
        shown = with_error(value, error).replace("−", "-").translate(LOWERED)
        numbers, _, power = shown.strip("(").partition(")·10")
        found, of_error = (float(f"{one}e{power or 0}") for one in numbers.split(" ± "))
        assert of_error == pytest.approx(error, rel=0.051)
        assert abs(found - value) <= 0.051 * error


def test_names_of_files_neither_break_a_line_nor_a_table() -> None:
    assert one_line("day\n1", "", "\x1b[2J") == "day 1; \N{REPLACEMENT CHARACTER}[2J"
    assert "<th>a &lt; b</th>" in html_table(["a < b"], [["<i>"]])
    assert "<i>" not in html_table(["a < b"], [["<i>"]])
