"""A button in the drive's inputs ends a session over true wires, as the emergency stop does."""

from __future__ import annotations

import pytest
from tests.faults import rigs
from tests.faults.rigs import CANOPEN, Wrong, bench
from tests.faults.trials import assert_stopped, run

from rigidimeter.rig.devices.base import DeviceError
from rigidimeter.rig.guard import Cause, Reaction

pytest.importorskip("canopen")


def test_the_button_cuts_the_power_in_a_motion(tmp_path, monkeypatch):
    monkeypatch.setitem(rigs.CANOPEN_DRIVE, "button_bit", 0)
    with bench(CANOPEN) as made:
        trial = run(made, tmp_path / "s", Wrong("drive", "press button"))
        # One tick for the frame of the SYNC after it, one for the answer to be read.
        assert_stopped(trial, Cause.EMERGENCY_STOP, 2.5 * trial.tick_s, reaction=Reaction.CUT)
        print(f"\nnamed after {1e3 * trial.detected_s:.1f} ms")
        assert made.line.opened_s - trial.fault_s < 3.5 * trial.tick_s + trial.slack_s
        with pytest.raises(DeviceError, match="hand-held stop"):
            made.rig.enable()
        made.behave()
        assert not made.powered  # its release starts nothing


def test_the_same_press_without_a_button_in_the_rig_file_is_no_stop(tmp_path):
    with bench(CANOPEN) as made:
        trial = run(made, tmp_path / "s", Wrong("drive", "press button"))
        assert trial.result.outcome == "success"
