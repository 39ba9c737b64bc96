"""Faults 16 and 17: what a person can do to the rig, and the rig with the person."""

import math

import numpy as np
import pytest
from tests.faults.rigs import ASCII, RIGS, Wrong, bench
from tests.faults.trials import Desk, assert_stopped, run

from rigidimeter.model import JointDynamics
from rigidimeter.rig.acquisition import Command
from rigidimeter.rig.guard import Cause, Reaction


def push(made, torque_nm):
    return Wrong("arm", "push", torque_nm if made.virtual else lambda _: torque_nm)


@pytest.mark.parametrize(
    ("torque_nm", "cause", "reaction"),
    [(14.0, Cause.TORQUE_HIGH, Reaction.HOLD), (25.0, Cause.TORQUE_TOO_HIGH, Reaction.RAMP)],
)
@pytest.mark.parametrize("rig", RIGS)
def test_fault_16_spasm(rig, torque_nm, cause, reaction, tmp_path, measured):
    with bench(rig) as made:
        trial = run(made, tmp_path / "s", push(made, torque_nm), task="prbs")
        bound_s = 2 / made.rate_hz  # a tick, and the sample that was under way
        assert_stopped(trial, cause, bound_s, reaction=reaction)
        # The perturbation ends with the tick that saw it.
        assert not trial.samples["perturbation_nm"][trial.first + 1 :].any()
        measured(16, rig, f"{torque_nm:g} N·m, {cause.name}", trial, bound_s)


@pytest.mark.parametrize("rig", RIGS)
def test_fault_16_a_hold_waits_for_the_operator(rig, tmp_path):
    with bench(rig) as made:
        n = round(0.25 * made.rate_hz)
        held_s = 0.3
        relax = {0.25 + held_s / 2: lambda: made.misbehave(push(made, 0.0))}
        resume = round(made.rate_hz * (0.25 + held_s))
        desk = Desk({resume + k: Command.RESUME for k in range(3)}, attended=True)
        options = {"task": "prbs", "desk": desk, "then": relax, "epochs": 2}
        trial = run(made, tmp_path / "s", push(made, 14.0), **options)
        assert [e["outcome"] for e in trial.of("epoch_ended")] == ["fail", "success"]
        assert trial.result.outcome == "success", trial.result
        first, tick = trial.first, trial.samples["tick"]
        ramp = round(0.1 * made.rate_hz)
        released = np.searchsorted(tick, tick[0] + resume)
        held = trial.samples["velocity_command_rad_s"][first + ramp : released]
        assert held.size
        assert not held.any()
        assert tick[first] - tick[0] <= n + 3


def over_limit_s(trial):
    """Return when, after the fault, the record itself first passes a limit."""
    guard, samples = trial.bench.settings.guard, trial.samples
    torque_nm = np.abs(samples["torque_nm"])
    power_w = torque_nm * np.abs(samples["velocity_rad_s"])
    elapsed_s = np.diff(samples["tick"], prepend=samples["tick"][0] - 1) * trial.tick_s
    energy_j = np.zeros(len(power_w))
    for k in range(len(power_w)):  # E' = |P| − E/1 s
        before = energy_j[k - 1] if k else 0.0
        energy_j[k] = before + (power_w[k] - before) * elapsed_s[k]
    over = (
        (torque_nm > guard.torque_limit_nm)
        | (power_w > guard.power_limit_w)
        | (energy_j > guard.energy_limit_j)
    )
    if not over.any():  # the guard counts the energy by the angle too, which may be first
        over = energy_j > 0.95 * guard.energy_limit_j
    assert over.any(), (trial.result.cause, energy_j.max())
    return float(samples["time_s"][np.argmax(over)] - trial.fault_s)


@pytest.mark.parametrize("rig", RIGS)
def test_fault_16_tremor(rig, tmp_path, measured):
    """More is put to and fro within a second than is allowed, below every limit of the moment."""
    # At the speed that the serial drive is given, so much energy never flows.
    limit_j = 2.0 if rig == ASCII else 5.0
    with bench(rig, prbs={"duration_s": 3.0}, guard={"energy_limit_j": limit_j}) as made:
        if made.virtual:
            wrong = Wrong("arm", "tremor", (6.0, 4.0))
        else:
            wrong = Wrong("arm", "", lambda t: 6.0 * math.sin(2 * math.pi * 4.0 * t))
        trial = run(made, tmp_path / "s", wrong, task="prbs", at_s=0.1)
        bound_s = over_limit_s(trial) + 2 / made.rate_hz
        causes = (Cause.ENERGY_HIGH, Cause.POWER_HIGH, Cause.TORQUE_HIGH)
        assert_stopped(trial, causes, bound_s)
        measured(16, rig, f"tremor, {trial.result.cause.name}", trial, bound_s)


@pytest.mark.parametrize("rig", RIGS)
def test_fault_17_contact_oscillation(rig, tmp_path, measured):
    """An arm far heavier than the virtual mass, behind the loop's delay: unstable."""
    heavy = JointDynamics(1.0, 0.1, 30.0)
    with bench(rig, prbs={"duration_s": 3.0}) as made:

        def become_heavy():
            holder = made.rig.inner if made.virtual else made.arm
            holder.joint = heavy

        trial = run(made, tmp_path / "s", become_heavy, task="prbs")
        causes = (
            Cause.ENERGY_HIGH,
            Cause.POWER_HIGH,
            Cause.TORQUE_HIGH,
            Cause.TORQUE_TOO_HIGH,
        )
        bound_s = over_limit_s(trial) + 2 / made.rate_hz
        assert_stopped(trial, causes, bound_s)
        measured(17, rig, trial.result.cause.name, trial, bound_s)
