import math

import pytest

from rigidimeter.core.words import (
    Column,
    number,
    p_and_r,
    p_value,
    short_names,
    shown_below,
    shown_value,
)


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.13684, "0.1368"),
        (0.0009999999, "0.001000"),
        (1234.5678, "1235"),
        (99999.7, "100000"),
        (-0.25, "−0.2500"),
        (1e9, "1.000·10⁹"),
        (3.2e-6, "3.200·10⁻⁶"),
        (0.0, "0"),
        (-0.0, "0"),
        (math.nan, "–"),
        (-math.inf, "−∞"),
    ],
)
def test_numbers_have_four_significant_digits(value: float, text: str) -> None:
    assert number(value) == text


@pytest.mark.parametrize(
    ("p", "text"),
    [
        (1.0, "1"),
        (0.16512, "0.165"),
        (0.04961, "0.0496"),
        (0.0004, "0.0004"),
        (1e-4, "0.0001"),
        (1.23e-6, "1.2·10⁻⁶"),
        (5e-324, "< 10⁻³⁰⁰"),
        (0.0, "< 10⁻³⁰⁰"),
        (math.nan, "–"),
    ],
)
def test_p_is_never_printed_as_zero(p: float, text: str) -> None:
    assert p_value(p) == text


def test_p_and_r_do_not_break_over_lines() -> None:
    assert p_and_r(0.0, -0.5) == "p < 10⁻³⁰⁰, r\xa0=\xa0−0.50"


def test_a_small_value_and_its_interval_share_a_power_of_ten() -> None:
    column = Column("x", "X", ends=("low", "high"), digits=3)
    row = {"x": -5.9e-6, "low": -1.35e-4, "high": 1.23e-4}
    assert shown_value(row, column, {}) == "−5.90·10⁻⁶"
    assert shown_below(row, column, {}) == "[−135 to 123]·10⁻⁶"
    row = {"x": 0.00452, "low": 0.0044, "high": 0.0046}
    assert shown_value(row, column, {}) == "4.52·10⁻³"
    assert shown_below(row, column, {}) == "[4.40 to 4.60]·10⁻³"
    assert shown_below({"x": 1.0, "low": 0.001, "high": 2.0}, column, {}) == "[0.00100 to 2.00]"


def test_short_names_tell_sources_apart() -> None:
    assert short_names(["/a/b/x.csv", "/a/c/y.csv"]) == {
        "/a/b/x.csv": "x.csv",
        "/a/c/y.csv": "y.csv",
    }
    assert short_names(["/a/b/x.csv", "/a/c/x.csv", "/a/b/x.csv"]) == {
        "/a/b/x.csv": "b/x.csv",
        "/a/c/x.csv": "c/x.csv",
    }
    assert short_names(["x", "./x"]) == {"x": "x", "./x": "./x"}
    assert short_names([]) == {}
    assert short_names(["", "/"]) == {"": "", "/": "/"}
