"""The operator is gone: zero within the ramp, no motion after it, whatever ran."""

import math

import pytest
from tests.faults.closed_pages import HOW, PHASES, RATE_HZ, SETTINGS, closed, moments

from rigidimeter.rig.acquisition import Phase
from rigidimeter.rig.console.page import AWAY_S, SILENT_S

RUNS = {
    "zeroing": Phase.ZEROING,
    "epoch": Phase.EPOCH,
    "return": Phase.RETURN,
    "rest": Phase.REST,
    "way back": Phase.RETURN,
}
TICK_S = 1.0 / RATE_HZ
RAMP_S = SETTINGS.guard.speed_limit_deg_s / SETTINGS.guard.acceleration_limit_deg_s2
BEAT_S = 0.05


@pytest.mark.parametrize("how", HOW)
@pytest.mark.parametrize(("phase", "at_s"), moments(len(PHASES), seed=2))
def test_nothing_moves_once_whoever_leads_the_session_is_gone(tmp_path, how, phase, at_s):
    found = closed(tmp_path, how, phase, at_s)
    assert found.phase_then == RUNS[phase]
    silent_s = SILENT_S if how == "page lost" else 0.0
    assert found.zero_s <= silent_s + RAMP_S + 3 * TICK_S
    assert found.motion_deg < 0.01
    longest_s = {"tab closed": AWAY_S + 2 * BEAT_S, "page lost": SILENT_S, "terminal closed": 0.0}
    assert found.end_s <= longest_s[how] + RAMP_S + 3 * TICK_S
    assert not math.isnan(found.motion_deg)
