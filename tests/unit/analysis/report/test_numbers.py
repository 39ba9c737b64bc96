import math

import pytest

from rigidimeter.core.words import number, p_and_r, p_value, short_names


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
