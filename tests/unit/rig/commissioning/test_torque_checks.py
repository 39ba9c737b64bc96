"""What a day's torque is compared with: the larger of a percentage and three standard errors."""

from __future__ import annotations

import math

import pytest

from rigidimeter.core.settings import parse_settings
from rigidimeter.rig.commissioning import KnownInertia, TorqueAnswer, delay_check, gain_check

SETTINGS = parse_settings(
    {
        "commissioning": {"inertia_tolerance_percent": 20.0, "delay_tolerance_s": 0.01},
        "rig": {"tick_rate_hz": 1000.0},
    }
)


def answer(inertia_kg_m2: float = 0.01, *, se: float = 0.0, delay_s: float = 0.0) -> TorqueAnswer:
    return TorqueAnswer(inertia_kg_m2, se, 0.0, 0.0, delay_s, 1.0)


@pytest.mark.parametrize(
    ("known_se", "se", "allowed"),
    [
        (0.0, 0.0, 0.002),  # 20 % of 0.01
        (3e-4, 4e-4, 0.002),  # three standard errors are 0.0015
        (6e-4, 8e-4, 0.003),  # three standard errors of the difference, 0.001 each
    ],
)
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_inertia_may_differ_by_the_larger_limit(
    known_se: float, se: float, allowed: float, sign: float
) -> None:
    known = KnownInertia(0.01, known_se, "as given")
    for part, passed in ((0.99, True), (1.01, False)):
        check = gain_check(answer(0.01 + sign * part * allowed, se=se), known, SETTINGS)
        assert check.passed == passed, part
        assert check.limit == f"0.01 ± {allowed:.2g} kg·m², as given"


@pytest.mark.parametrize("rate_hz", [1000.0, 50.0])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_torque_may_be_neither_later_nor_earlier(sign: float, rate_hz: float) -> None:
    """By 10 ms, or by a tick if that is longer."""
    rig = SETTINGS.rig.model_copy(update={"tick_rate_hz": rate_hz})
    settings = SETTINGS.model_copy(update={"rig": rig})
    allowed_s = max(0.01, 1.0 / rate_hz)
    for part, passed in ((0.99, True), (1.01, False)):
        found = answer(delay_s=0.03 + sign * part * allowed_s)
        assert delay_check(found, 0.03, settings).passed == passed, part


def test_a_torque_without_a_time_does_not_pass() -> None:
    assert not delay_check(answer(delay_s=math.nan), 0.03, SETTINGS).passed
    assert delay_check(answer(), None, SETTINGS).outcome == "not possible here"
