"""A first motion that the guard ended: the remedy names what it ended for."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from rigidimeter.core.settings import Settings
from rigidimeter.rig.commissioning import TrialResult
from rigidimeter.rig.commissioning import motion_tests as motion_tests
from rigidimeter.rig.guard import Cause


@pytest.mark.parametrize("scale", [0.1, 1.0])
@pytest.mark.parametrize(
    ("cause", "remedy"),
    [
        (Cause.STALLED, "remove the reason"),
        (Cause.TORQUE_STALE, "remove the reason"),
        (Cause.NOT_FOLLOWING, "sign, counts per turn"),
        (Cause.OVERSPEED, "sign, counts per turn"),
    ],
)
def test_only_a_motion_that_is_not_as_commanded_speaks_of_sign_and_counts(
    monkeypatch: pytest.MonkeyPatch, cause: Cause, remedy: str, scale: float
) -> None:
    monkeypatch.setattr(motion_tests, "following", lambda *_: SimpleNamespace(scale=scale))
    readings: Any = None
    result, settings = TrialResult(readings, cause), Settings()
    check = motion_tests.small_move_check(result, settings)
    assert check.outcome == "failed"
    assert check.remedy.startswith(remedy)
    assert motion_tests.small_move_check(TrialResult(readings, Cause.NONE), Settings()).passed == (
        scale == 1.0
    )
