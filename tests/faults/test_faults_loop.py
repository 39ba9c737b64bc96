"""Faults 18 and 20 to 23 as far as one process goes: operator, program, record."""

import errno
import math
import os
import signal

import numpy as np
import pytest
from tests.faults.rigs import ASCII, RIGS, Wrong, bench
from tests.faults.trials import AT_S, Desk, assert_came_to_rest, assert_stopped, assert_whole, run

from rigidimeter.core.units import rad_from_deg
from rigidimeter.rig.acquisition import Command, Order
from rigidimeter.rig.devices.base import DeviceError
from rigidimeter.rig.guard import Cause, Reaction


@pytest.mark.parametrize("rig", RIGS)
def test_fault_18_emergency_stop(rig, tmp_path, measured):
    with bench(rig) as made:
        n = round(AT_S * made.rate_hz)
        # Pressed for one tick, then released; and an operator who would go on at once.
        insists = {n + k: Order(c) for k in range(1, 9) for c in (Command.RESUME,)}
        desk = Desk(insists, {n: Cause.EMERGENCY_STOP}, attended=True)
        trial = run(made, tmp_path / "s", desk=desk)
        tick_s = 1.0 / made.rate_hz
        assert_stopped(trial, Cause.EMERGENCY_STOP, tick_s, reaction=Reaction.CUT)
        assert trial.disabled_s - trial.fault_s <= tick_s + trial.slack_s
        assert not trial.samples["velocity_command_rad_s"][trial.first :].any()
        if made.line is not None:
            assert made.line.opened_s - trial.fault_s <= tick_s + trial.slack_s
        power_s = trial.disabled_s - trial.fault_s
        measured(18, rig, trial=trial, bound_s=tick_s, power_off_s=power_s)


@pytest.mark.parametrize("rig", RIGS)
def test_fault_21_disk_full_in_one_process(rig, tmp_path, measured):
    """Without a recorder's process the record itself fails: the arm is brought to rest first."""
    with bench(rig) as made:
        full = []

        def sink(writer):
            take = writer.sample

            def sample(row):
                if full:
                    raise OSError(errno.ENOSPC, "No space left on device")
                take(row)

            writer.sample = sample
            return writer

        trial = run(made, tmp_path / "s", lambda: full.append(True), sink=sink)
        assert isinstance(trial.error, OSError)
        assert_ramped_unrecorded(trial)
        assert "No space left" in trial.events[-1]["reason"]
        measured(21, rig, "disk full", rest_s=trial.rest_s)


def assert_ramped_unrecorded(trial):
    """Assert a ramp, though nothing of it was recorded: by what the arm itself did."""
    guard = trial.bench.settings.guard
    speed = np.abs(trial.trace[:, 2])
    before = float(np.interp(trial.fault_s, trial.trace[:, 0], speed))
    ramp_s = before / math.radians(guard.acceleration_limit_deg_s2)
    ticks_s = 4 * trial.tick_s
    assert trial.rest_s <= ramp_s + ticks_s + guard.reaction_time_s + 2 * trial.slack_s
    assert not trial.powered
    assert trial.events[-1]["event"] == "session_ended"
    assert trial.events[-1]["outcome"] == "fail"
    assert trial.of("epoch_ended")[0]["outcome"] == "fail"
    # A ramp, not a cut: what was written says so even where no sample does.
    limit = math.radians(guard.acceleration_limit_deg_s2) * trial.tick_s
    assert trial.written[-1] == 0.0
    assert np.abs(np.diff(trial.written[-round(ramp_s / trial.tick_s) - 2 :])).max() <= limit * 1.01


@pytest.mark.parametrize("rig", RIGS)
def test_fault_20_exception_in_the_loop(rig, tmp_path, measured):
    with bench(rig) as made:

        def fail():
            raise RuntimeError("a fault of the program")

        trial = run(made, tmp_path / "s", fail)
        assert isinstance(trial.error, RuntimeError)
        assert "a fault of the program" in trial.events[-1]["reason"]
        assert_whole(trial)
        assert trial.disabled_s == trial.disabled_s
        assert trial.rest_s <= 0.1 + trial.slack_s
        assert not trial.powered
        measured(20, rig, "exception", rest_s=trial.rest_s)


@pytest.mark.parametrize("rig", RIGS)
def test_fault_20_exception_that_stays(rig, tmp_path, measured):
    """Every read fails from now on: the arm is still ramped to rest by writing alone."""
    with bench(rig) as made:
        true_read, failing = made.rig.read, []

        def read(elapsed_ticks=1):
            if failing:
                raise RuntimeError("a fault that stays")
            return true_read(elapsed_ticks)

        made.rig.read = read
        trial = run(made, tmp_path / "s", lambda: failing.append(True))
        assert isinstance(trial.error, RuntimeError)
        assert_ramped_unrecorded(trial)
        assert trial.disabled_s > trial.fault_s
        assert not trial.powered
        measured(20, rig, "every read fails", rest_s=trial.rest_s)


@pytest.mark.parametrize("rig", RIGS)
def test_fault_20_interrupt(rig, tmp_path, measured, request):
    # Whoever started the tests may have had it ignored; here it must raise in this process.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    request.addfinalizer(lambda: signal.signal(signal.SIGINT, before))
    with bench(rig) as made:
        trial = run(made, tmp_path / "s", lambda: os.kill(os.getpid(), signal.SIGINT))
        assert trial.error is None
        assert trial.result.outcome == "abort"
        assert trial.events[-1]["reason"] == "interrupted by the operator"
        assert trial.samples["velocity_command_rad_s"][-1] == 0.0
        assert trial.rest_s <= 0.15 + trial.slack_s
        assert not trial.powered
        measured(20, rig, "SIGINT", rest_s=trial.rest_s)


@pytest.mark.parametrize("rig", RIGS)
def test_fault_20_told_to_end(rig, tmp_path, measured):
    """What SIGTERM comes to in the loop: a flag on the shared_status, a cause for the guard."""
    with bench(rig) as made:
        desk = Desk(causes={round(AT_S * made.rate_hz): Cause.SIGNAL})
        trial = run(made, tmp_path / "s", desk=desk)
        assert_stopped(trial, Cause.SIGNAL, 1 / made.rate_hz)
        measured(20, rig, "signal to end", trial, 1 / made.rate_hz)


@pytest.mark.parametrize("rig", RIGS)
def test_fault_20_failure_half_way_through_enable(rig, tmp_path, measured):
    with bench(rig) as made:
        if rig == ASCII:
            made.misbehave(Wrong("drive", "power_lost"))
        else:
            made.misbehave(Wrong("drive", "refuse enable"))
        trial = run(made, tmp_path / "s")
        assert isinstance(trial.error, DeviceError)
        assert not trial.powered
        assert trial.disabled_s == trial.disabled_s
        assert np.abs(trial.trace[:, 1]).max(initial=0.0) < 1e-3
        assert trial.events[-1]["event"] == "session_ended"
        assert trial.events[-1]["outcome"] == "fail"
        if made.line is not None:
            assert not made.line.closed
        measured(20, rig, "refuses to be enabled: no motion")


@pytest.mark.parametrize("rig", RIGS)
def test_fault_22_parameters_changed_while_running(rig, tmp_path, measured):
    with bench(rig) as made:
        n = made.rate_hz
        damping = made.settings.controller.damping_nm_s_rad
        orders = [
            ("damping_nm_s_rad", 2 * damping),
            ("damping_nm_s_rad", 0.1 * damping),
            ("inertia_kg_m2", math.nan),
            ("perturbation_scale", 0.5),
            ("perturbation_scale", math.inf),
            ("position_limit_deg", 90.0),
        ]
        desk = Desk(
            {
                round((0.2 + 0.1 * k) * n): Order(Command.CHANGE, name, value)
                for k, (name, value) in enumerate(orders)
            },
            attended=True,
        )
        trial = run(made, tmp_path / "s", desk=desk, task="prbs")
        assert trial.result.outcome == "success", trial.result
        told = trial.of("order")
        assert ["refused" in event for event in told] == [False, True, True, False, True, True]
        assert told[0]["before"] == pytest.approx(damping)
        sent = trial.samples["velocity_command_rad_s"]
        limit = rad_from_deg(made.settings.guard.acceleration_limit_deg_s2) / n
        ticks = 3 if rig == ASCII else 1
        assert np.abs(np.diff(sent)).max() <= ticks * limit * 1.01 + 1e-3
        measured(22, rig, "bounded, without a bump, logged")


@pytest.mark.parametrize("rig", RIGS)
def test_fault_23_two_faults_at_once(rig, tmp_path, measured):
    """The sensor fails, then the drive while the arm is ramped: the sensor is what is named."""
    with bench(rig) as made:
        if made.virtual:
            first = Wrong("sensor", "torque is", math.nan)
            second = Wrong("drive", "reports", Cause.DRIVE_FAULT)
        else:
            first = Wrong("sensor", "serious_status")
            second = Wrong("drive", "fault", 3 if rig == ASCII else 0x2310)
        then = {AT_S + 2 / made.rate_hz: lambda: made.misbehave(second)}
        trial = run(made, tmp_path / "s", first, then=then)
        cause = Cause.TORQUE_NOT_FINITE if made.virtual else Cause.TORQUE_STATUS
        assert_named_first(trial, cause)
        measured(23, rig, "sensor, then drive", trial, 2 / made.rate_hz)


def assert_named_first(trial, cause):
    assert trial.result.cause is cause
    assert set(trial.samples["cause"][trial.first :]) == {int(cause)}
    assert cause.sentence in trial.events[-1]["reason"]
    assert trial.rest_s <= 0.2 + trial.slack_s
    assert not trial.powered
    assert_whole(trial)


@pytest.mark.parametrize("rig", RIGS)
def test_fault_23_emergency_stop_while_stopping(rig, tmp_path, measured):
    with bench(rig) as made:
        n = round(AT_S * made.rate_hz)
        desk = Desk(causes={n: Cause.SIGNAL, n + 1: Cause.EMERGENCY_STOP})
        trial = run(made, tmp_path / "s", desk=desk)
        assert_named_first(trial, Cause.SIGNAL)
        cut_s = trial.disabled_s - trial.fault_s
        assert cut_s <= 2 / made.rate_hz + trial.slack_s  # not after the ramp
        row = trial.first + 1
        assert not trial.samples["velocity_command_rad_s"][row:].any()
        measured(23, rig, "emergency stop while stopping", trial, power_off_s=cut_s)


@pytest.mark.parametrize("rig", RIGS)
def test_fault_23_a_stop_is_not_made_a_hold(rig, tmp_path):
    """The weaker cause comes later, and an operator would go on: it stays a stop."""
    with bench(rig) as made:
        n = round(AT_S * made.rate_hz)
        resume = {n + k: Command.RESUME for k in range(1, 20)}
        desk = Desk(resume, {n: Cause.DEADLINES_MISSED, n + 2: Cause.TORQUE_HIGH}, attended=True)
        trial = run(made, tmp_path / "s", desk=desk)
        assert_named_first(trial, Cause.DEADLINES_MISSED)
        assert_came_to_rest(trial)
