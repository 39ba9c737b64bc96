"""The rule by which a number of the paper and ours agree or differ."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from rigidimeter.paper import (
    AGREES,
    DIFFERS,
    UNPUBLISHED,
    Bound,
    Claim,
    bounded,
    near,
    rounded,
    within_percent,
)


def row_with(*checks: Bound, **changes: object) -> Claim:
    return replace(Claim("o", (near("x", "m", 1.0, 1.0, 0.1),)), checks=checks, **changes)


def test_a_verdict_follows_from_the_numbers() -> None:
    inside = within_percent("x", "m", 4.0, 4.6, 50.0)
    assert (inside.low, inside.high) == (2.0, 6.0)
    outside = replace(inside, ours=6.1)
    assert row_with(inside).verdict == AGREES
    assert row_with(outside).verdict == DIFFERS
    assert row_with(inside, outside).verdict == DIFFERS
    assert row_with(replace(inside, ours=math.nan)).verdict == DIFFERS
    assert row_with(inside, unpublished="no data").verdict == UNPUBLISHED


def test_the_reason_goes_with_the_verdict() -> None:
    check = near("x", "m", 1.0, 1.05, 0.1)
    row = row_with(check, agrees="Alike.")
    assert row.reason == "Alike."
    turned = replace(row, checks=(replace(check, ours=2.0),))
    assert turned.verdict == DIFFERS
    assert turned.reason == "x: 2.000 m is outside what would agree (0.9000 to 1.100)."


def test_rounding_allows_half_of_the_last_digit() -> None:
    assert rounded("r", "1", 0.35, 0.3549, 0.01).within
    assert rounded("r", "1", 0.35, 0.355, 0.01).within
    assert not rounded("r", "1", 0.35, 0.3551, 0.01).within
    assert bounded("y", "%", -3.0, high=-0.5).within
    assert not bounded("y", "%", 0.0, high=-0.5).within


def test_a_row_needs_something_that_decides() -> None:
    with pytest.raises(ValueError, match="neither a check"):
        Claim("o")
