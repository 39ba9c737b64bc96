"""Zero and noise without power, with the limits and the sentences of a run."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from rigidimeter.core.settings import Settings
from rigidimeter.rig.commissioning import Operator, Setup, ZeroFound, zero_check


@pytest.fixture
def zeroed(
    settings: Settings, fake_rig: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> Callable[..., ZeroFound]:
    def run(*, noise_sd_nm: float = 0.005, push_nm: float = 0.0, **faults: Any) -> ZeroFound:
        made = fake_rig((0.0045, 0.1368, 1.751), noise_sd_nm, True, faults)
        made.world.push_nm[0] = push_nm
        monkeypatch.delattr(type(made.rig), "enable")  # to give it power is an error
        return zero_check(Setup(made.rig, settings, made.timebase, Operator(lambda _: False)))

    return run


def test_a_quiet_sensor_is_within_the_limits(zeroed, settings):
    found = zeroed(noise_sd_nm=0.02)
    assert found.objection == ""
    assert abs(found.bias_nm) < 4 * 0.02 / 200**0.5
    assert found.noise_sd_nm == pytest.approx(0.02, rel=0.2)
    assert "bias 0.00 N·m (at most 1 N·m), noise (SD) 0.0" in found.words(settings)


@pytest.mark.parametrize(
    ("fault", "words"),
    [
        ({"push_nm": 1.5}, "zeroing.bias_limit_nm = 1 N·m"),
        ({"noise_sd_nm": 0.3}, "zeroing.noise_limit_nm = 0.1 N·m"),
        ({"no_answer": True}, "no answer; check the cable"),
    ],
)
def test_what_a_run_would_refuse_is_an_objection(zeroed, settings, fault, words):
    found = zeroed(**fault)
    assert words in found.objection
    assert found.words(settings).startswith("bias ")
