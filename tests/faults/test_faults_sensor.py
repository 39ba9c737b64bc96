"""Faults 1 to 6: what a torque sensor can do to a person's arm."""

import math

import numpy as np
import pytest
from tests.faults.rigs import ASCII, CANOPEN, RIGS, WIRES, Wrong, bench
from tests.faults.trials import AT_S, assert_stopped, run

from rigidimeter.core.errors import UserError
from rigidimeter.core.settings import parse_settings
from rigidimeter.rig.devices import AtiRdt
from rigidimeter.rig.devices.base import DeviceError
from rigidimeter.rig.guard import Cause

NOT_FINITE = {
    "torque NaN": (Wrong("", "torque is", math.nan), Cause.TORQUE_NOT_FINITE),
    "torque +Inf": (Wrong("", "torque is", math.inf), Cause.TORQUE_NOT_FINITE),
    "torque -Inf": (Wrong("", "torque is", -math.inf), Cause.TORQUE_NOT_FINITE),
    "angle NaN": (Wrong("", "angle is", math.nan), Cause.MOTION_NOT_FINITE),
    "velocity Inf": (Wrong("", "velocity is", math.inf), Cause.MOTION_NOT_FINITE),
}
"""Only where a reading is a float: RDT, CANopen and the serial drive send integers."""


@pytest.mark.parametrize(
    ("rig", "case"),
    [*(("virtual", case) for case in NOT_FINITE), *((rig, "perturbation NaN") for rig in RIGS)],
)
def test_fault_01_not_a_number(rig, case, tmp_path, monkeypatch, measured):
    with bench(rig) as made:
        tick_s = 1.0 / made.rate_hz
        if case in NOT_FINITE:
            wrong, cause = NOT_FINITE[case]
            trial = run(made, tmp_path / "s", wrong)
            spoiled = {"torque is": "torque_nm", "angle is": "angle_rad"}.get(wrong.name)
            if spoiled:  # recorded as it came, not made a zero
                assert not np.isfinite(trial.samples[spoiled][trial.first])
        else:
            perturbation = np.ones(round(made.rate_hz))
            perturbation[round(AT_S * made.rate_hz)] = math.nan
            monkeypatch.setattr(
                "rigidimeter.rig.acquisition.session_run.prbs_nm", lambda *_: perturbation
            )
            trial, cause = run(made, tmp_path / "s", task="prbs"), Cause.COMMAND_NOT_FINITE
            assert np.isnan(trial.samples["velocity_request_rad_s"][trial.first])
        assert_stopped(trial, cause, tick_s)
        sent = trial.samples["velocity_command_rad_s"]
        assert np.isfinite(sent).all()
        measured(1, rig, case, trial, tick_s)


@pytest.mark.parametrize("rig", WIRES)
def test_fault_01_a_drive_is_never_told_what_is_no_number(rig):
    with bench(rig) as made:
        made.rig.enable()
        for value in (math.nan, math.inf, -math.inf):
            sent = made.rig.write(value)
            assert abs(sent) <= 4.0  # at most the drive's own limit, never garbage
            if math.isnan(value):
                assert sent == 0.0


@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_fault_01_no_setting_takes_what_is_no_number(value):
    for table, name in (("controller", "damping_nm_s_rad"), ("guard", "speed_limit_deg_s")):
        with pytest.raises(UserError, match=name):
            parse_settings({table: {name: value}})


def stale_bound(made):
    return made.settings.guard.stale_s + 1.0 / made.rate_hz


@pytest.mark.parametrize("rig", RIGS)
def test_fault_02_sensor_packets_stop(rig, tmp_path, measured):
    with bench(rig) as made:
        wrong = Wrong("sensor", "torque stops" if made.virtual else "silent")
        trial = run(made, tmp_path / "s", wrong)
        assert_stopped(trial, Cause.TORQUE_STALE, stale_bound(made))
        measured(2, rig, trial=trial, bound_s=stale_bound(made))


@pytest.mark.parametrize(
    ("rig", "rate"), [(CANOPEN, 0.5), (CANOPEN, 0.2), (CANOPEN, None), (ASCII, 0.5)]
)
def test_fault_02_sensor_packets_come_late(rig, rate, tmp_path, measured):
    """Ever later without a gap, by a part of the time that passed, or all at once by 1 s."""
    with bench(rig) as made:
        wrong = Wrong("sensor", "delay") if rate is None else Wrong("sensor", "lag", rate)
        trial = run(made, tmp_path / "s", wrong)
        drift = 1e-6 * AtiRdt.Settings().clock_drift_ppm
        growth = 1.0 if rate is None else rate - drift
        bound_s = made.settings.guard.stale_s / growth + 1.0 / made.rate_hz
        # Records that come ever later are also fewer in a time: either law may be first.
        causes = (Cause.TORQUE_STALE, Cause.SELDOM_FRESH)
        assert_stopped(trial, causes, bound_s)
        case = "late by 1 s at once" if rate is None else f"later by {rate:g} s each second"
        measured(2, rig, case, trial, bound_s)


FROZEN = ("frozen_values", "frozen_record", "frozen_sequence", "frozen_ft_sequence")


@pytest.mark.parametrize(
    ("rig", "case"),
    [
        ("virtual", "reports"),
        *((CANOPEN, case) for case in FROZEN),
        (ASCII, "frozen_values"),  # the sensor's driver is the same: what differs is the tick
    ],
)
def test_fault_03_sensor_frozen(rig, case, tmp_path, measured):
    with bench(rig) as made:
        value = Cause.TORQUE_FROZEN if made.virtual else None
        trial = run(made, tmp_path / "s", Wrong("sensor", case, value))
        tick_s = 1.0 / made.rate_hz
        # So long without anything fresh, and a packet to tell by.
        bound_s = tick_s if made.virtual else AtiRdt.Settings().frozen_s + 0.002 + tick_s
        # A sample count that stands still makes the sample old as well: either law may be first.
        causes = (Cause.TORQUE_FROZEN, Cause.TORQUE_STALE)
        assert_stopped(
            trial, causes if "sequence" in case or "record" in case else causes[:1], bound_s
        )
        measured(3, rig, case, trial, bound_s)


@pytest.mark.parametrize(
    ("rig", "case", "cause"),
    [
        ("virtual", "reports", Cause.TORQUE_SATURATED),
        ("virtual", "reports", Cause.TORQUE_STATUS),
        *((rig, "saturated", Cause.TORQUE_SATURATED) for rig in WIRES),
        *((rig, "serious_status", Cause.TORQUE_STATUS) for rig in WIRES),
        (CANOPEN, "one_bad_status", Cause.TORQUE_STATUS),
    ],
)
def test_fault_04_saturation_or_serious_status(rig, case, cause, tmp_path, measured):
    with bench(rig) as made:
        trial = run(made, tmp_path / "s", Wrong("sensor", case, cause if made.virtual else None))
        bound_s = (1 if made.virtual else 2) / made.rate_hz  # and the next packet's millisecond
        assert_stopped(trial, cause, bound_s)
        if not made.virtual:
            assert trial.samples["torque_status"][trial.first] & 0x80000000
        measured(4, rig, f"{case}, {cause.name}", trial, bound_s)


@pytest.mark.parametrize(
    ("rig", "case"),
    [
        *((CANOPEN, case) for case in ("lose", "duplicate", "reorder", "short", "garbage")),
        (ASCII, "lose"),
    ],
)
def test_fault_05_bad_packets(rig, case, tmp_path, measured):
    with bench(rig) as made:
        trial = run(made, tmp_path / "s", Wrong("sensor", case, 10))
        bound_s = 6 * 0.010 + 0.002 + 1.0 / made.rate_hz  # the sixth in a second is one too many
        assert_stopped(trial, Cause.TORQUE_PACKETS, bound_s)
        counts = trial.of("epoch_ended")[0]["counts"]
        counted = {
            "lose": "torque_lost",
            "duplicate": "torque_repeated",
            "reorder": "torque_reordered",
            "short": "torque_short",
            "garbage": "torque_damaged",
        }[case]
        assert counts[counted] >= 3  # a reordered packet was lost first, and counts twice
        assert np.all(np.diff(trial.samples["torque_sequence"]) >= 0)
        measured(5, rig, case, trial, bound_s)


def test_fault_05_counters_that_start_again(tmp_path, measured):
    """The sensor restarts in a run: all that it sends is old by its counters."""
    with bench(CANOPEN) as made:
        trial = run(made, tmp_path / "s", Wrong("sensor", "restart"))
        bound_s = 6 * 0.001 + 0.002 + 1.0 / made.rate_hz  # the sixth in a second is one too many
        assert_stopped(trial, Cause.TORQUE_PACKETS, bound_s)
        measured(5, CANOPEN, "counters start again", trial, bound_s)


@pytest.mark.parametrize("rig", WIRES)
@pytest.mark.parametrize("case", ["changed_units", "changed_calibration", "changed_bias"])
def test_fault_06_sensor_changed_on_reconnect(rig, case):
    with bench(rig) as made:
        made.misbehave(Wrong("sensor", case))
        made.rig.connect()
        with pytest.raises(DeviceError, match="came back changed"):
            made.rig.configure()
        with pytest.raises(DeviceError):
            made.rig.enable() if rig == ASCII else made.rig.configure()
        made.rig.close()
        assert not made.powered


@pytest.mark.parametrize("rig", RIGS)
def test_fault_06_bias_under_load(rig, tmp_path, measured):
    with bench(rig, zeroing={"duration_s": 0.3}) as made:
        made.misbehave(
            Wrong("sensor", "push", 3.0) if made.virtual else Wrong("sensor", "bias", 3.0)
        )
        trial = run(made, tmp_path / "s", zero_first=True)
        assert trial.result.outcome == "fail"
        assert "zeroed under load" in trial.result.reason
        assert trial.events[-1]["reason"] == trial.result.reason
        assert not trial.of("epoch_started")
        assert not trial.samples["velocity_command_rad_s"].any()
        assert np.abs(trial.trace[:, 1]).max() < 1e-3  # the arm was not moved
        assert not trial.powered
        measured(6, rig, "no motion at all")
