"""The compiled epoch against the loop on the virtual rig: every column, to the bit."""

import dataclasses
import math
import tomllib
from pathlib import Path

import numpy as np
import pytest

from rigidimeter.core.session import Sample, read_session
from rigidimeter.core.settings import Settings, SubjectSettings, parse_settings
from rigidimeter.model import BiquadState, DriveState
from rigidimeter.planning import prbs_nm
from rigidimeter.rig.acquisition import ControlLoop, SimulatedClock, perturb
from rigidimeter.rig.devices import SimulatedRig
from rigidimeter.rig.guard import Cause, Limited, guard_state
from rigidimeter.virtual.batch import batch_epoch as plain
from rigidimeter.virtual.batch import (
    bench,
    draw_inputs,
    epoch_generator,
    simulate_epochs,
    simulate_inputs,
)

PAPER = tomllib.loads(
    (Path(__file__).parents[4] / "examples/settings/paper-rates.toml").read_text(encoding="utf-8")
)
SHORT = {"duration_s": 2.0}
RESTLESS = {"voluntary_sd_nm": 0.4, "tremor_amplitude_nm": 0.3, "damping_cv_percent": 20.0}
SLACK = {"inertia_kg_m2": 0.002, "damping_nm_s_rad": 0.01, "stiffness_nm_rad": 0.1}
COLUMNS = (
    *("perturbation_nm", "torque_nm", "torque_time_s", "angle_rad", "velocity_rad_s"),
    *("motion_time_s", "velocity_request_rad_s", "velocity_command_rad_s", "limited"),
)


def by_the_loop(settings, rng, subject=None, perturbation_nm=None, spoil=lambda rig, loop: None):
    """Run one epoch on a new rig in the interpreter: samples, result and the joint."""
    rig = SimulatedRig(settings.rig, subject or next(iter(settings.subject.values())), rng)
    samples = []
    loop = ControlLoop(settings, rig, SimulatedClock(), samples.append)
    spoil(rig, loop)
    rig.enable()
    if perturbation_nm is None:
        perturbation_nm = prbs_nm(settings.prbs, settings.rig.tick_rate_hz)
    result = perturb(loop, 1, perturbation_nm.tolist())
    return samples, result, rig.joint


def bits(values):
    values = np.asarray(values)
    return values.view(np.uint64) if values.dtype == np.float64 else values


def assert_same_bits(batch, i, samples, result):
    n = int(batch.ticks[i])
    assert n == len(samples)
    for name in COLUMNS:
        expected = np.array([getattr(sample, name) for sample in samples])
        np.testing.assert_array_equal(
            bits(getattr(batch, name)[i, :n].astype(expected.dtype)), bits(expected), err_msg=name
        )
    np.testing.assert_array_equal(bits(batch.time_s[:n]), bits([s.time_s for s in samples]))
    assert batch.cause[i] == result.cause
    assert batch.limited_ticks[i] == result.limited_ticks
    np.testing.assert_array_equal(batch.limit_time_s[i], result.limit_time_s)
    for name in COLUMNS[1:]:
        rest = getattr(batch, name)[i, n:]
        assert (rest == 0).all() if name == "limited" else np.isnan(rest).all()


CASES = {
    "default": {},
    "paper's rates": {"rig": PAPER["rig"]},
    "both jitter": {
        "rig": {
            "torque": {"rate_hz": 411.0, "jitter_s": 0.002, "latency_s": 0.0037},
            "motion": {"rate_hz": 97.0, "jitter_s": 0.01, "stamp_latency_s": 0.004},
        },
        "guard": {"reaction_time_s": 0.05},
    },
    "odd rates between the ticks": {
        "rig": {
            "tick_rate_hz": 733.0,
            "torque": {"rate_hz": 411.0, "latency_s": 0.0},
            "motion": {"rate_hz": 333.0, "latency_s": 0.0043, "stamp_latency_s": 0.0043},
        }
    },
    "latency of half a tick": {
        "rig": {"torque": {"latency_s": 0.0005}, "motion": {"latency_s": 0.0015}}
    },
    "long latency": {"rig": {"torque": {"latency_s": 0.1}}, "guard": {"stale_s": 0.2}},
    "no rounding, much noise": {
        "rig": {
            "torque": {"resolution_nm": 0.0, "noise_sd_nm": 0.5},
            "motion": {"angle_resolution_deg": 0.0, "velocity_resolution_deg_s": 0.0},
        }
    },
    "coarse rounding": {
        "rig": {
            "torque": {"resolution_nm": 0.25},
            "motion": {"angle_resolution_deg": 0.5, "velocity_resolution_deg_s": 8.0},
        }
    },
    "a restless subject": {"subject": {"OFF": RESTLESS}},
    "a restless subject at the paper's rates": {"rig": PAPER["rig"], "subject": {"OFF": RESTLESS}},
    "every limit": {
        "prbs": {**SHORT, "amplitude_nm": 8.0},
        "guard": {
            "position_limit_deg": 25.0,
            "speed_limit_deg_s": 100.0,
            "acceleration_limit_deg_s2": 2000.0,
        },
        "subject": {"OFF": SLACK},
    },
    "no controller damping": {"controller": {"damping_nm_s_rad": 0.0}},
    "coarse readings at a narrow limit": {
        "rig": {"motion": {"angle_resolution_deg": 1.0}},
        "guard": {"position_limit_deg": 1.0},
        "sinusoid": {"amplitude_deg": 0.5},
        "prbs": {**SHORT, "amplitude_nm": 5.0},
    },
    "torque too high": {
        "guard": {"torque_limit_nm": 1.2, "torque_stop_nm": 1.3},
        "subject": {"OFF": {"voluntary_sd_nm": 1.0}},
    },
}


@pytest.mark.parametrize("tables", CASES.values(), ids=CASES)
def test_every_column_is_the_loops(tables):
    settings = parse_settings({"prbs": SHORT, **tables})
    batch = simulate_epochs(settings, 2, seed=3)
    for i in range(2):
        samples, result, joint = by_the_loop(settings, epoch_generator(3, i))
        assert_same_bits(batch, i, samples, result)
        assert batch.joints[i] == joint


def test_the_cases_reach_the_limits_and_the_latch():
    def limited(case):
        batch = simulate_epochs(parse_settings({"prbs": SHORT, **CASES[case]}), 1, seed=3)
        return set(np.unique(batch.limited).tolist()), int(batch.cause[0])

    assert limited("default") == ({Limited.NOT}, Cause.NONE)
    kinds, _ = limited("every limit")
    assert kinds == {Limited.ACCELERATION, Limited.SPEED, Limited.POSITION}
    assert limited("torque too high")[1] in (Cause.TORQUE_HIGH, Cause.TORQUE_TOO_HIGH)


@pytest.mark.parametrize("number", range(12))
def test_settings_drawn_at_random(number):
    rng = np.random.default_rng(number)
    rate_hz = float(rng.uniform(400.0, 2000.0))

    def sensor(**other):
        sensor_hz = float(rng.uniform(0.02, 1.0) * rate_hz)
        jitter_s = float(rng.uniform(0.0, 0.9) / sensor_hz) if rng.random() < 0.5 else 0.0
        latency_s = float(rng.uniform(0.0, 0.02))
        stamp_s = float(rng.uniform(0.5, 1.0)) * latency_s
        return {
            "rate_hz": sensor_hz,
            "jitter_s": min(jitter_s, 0.1),
            "latency_s": latency_s,
            "stamp_latency_s": stamp_s,
            **other,
        }

    settings = parse_settings(
        {
            "rig": {
                "tick_rate_hz": rate_hz,
                "drive_bandwidth_hz": float(rng.uniform(20.0, 100.0)),
                "drive_damping_ratio": float(rng.uniform(0.6, 0.99)),
                "torque": sensor(noise_sd_nm=float(rng.uniform(0.0, 0.1))),
                "motion": sensor(),
            },
            "controller": {"inertia_kg_m2": float(rng.uniform(0.02, 0.1))},
            "guard": {
                "position_limit_deg": float(rng.uniform(5.0, 40.0)),
                "speed_limit_deg_s": float(rng.uniform(50.0, 300.0)),
                "acceleration_limit_deg_s2": float(rng.uniform(1000.0, 20000.0)),
                "reaction_time_s": 0.1,
            },
            "sinusoid": {"amplitude_deg": 2.0},
            "prbs": {"duration_s": 1.5, "amplitude_nm": float(rng.uniform(0.5, 6.0))},
            "subject": {"OFF": {**RESTLESS, "voluntary_sd_nm": float(rng.uniform(0.0, 1.0))}},
        }
    )
    batch = simulate_epochs(settings, 1, first=number)
    samples, result, _ = by_the_loop(settings, epoch_generator(1, number))
    assert_same_bits(batch, 0, samples, result)


@pytest.mark.parametrize(("value", "resolution_nm"), [(math.nan, 0.0005), (math.inf, 0.0)])
def test_noise_that_is_no_number_latches_both(value, resolution_nm):
    settings = parse_settings({"prbs": SHORT, "rig": {"torque": {"resolution_nm": resolution_nm}}})
    table = bench(settings, 2000)
    inputs = draw_inputs(table, settings.subject["OFF"], epoch_generator(1, 0))
    noise = inputs.noise_nm.copy()
    noise[700] = value
    batch = simulate_inputs(
        table,
        prbs_nm(settings.prbs, 1000.0),
        [dataclasses.replace(inputs, noise_nm=noise)],
    )

    def spoil(rig, _):
        rig._noise = iter(noise.tolist())

    samples, result, _ = by_the_loop(settings, epoch_generator(1, 0), spoil=spoil)
    assert_same_bits(batch, 0, samples, result)
    assert batch.cause[0] == Cause.TORQUE_NOT_FINITE
    assert batch.ticks[0] == 701


def test_a_perturbation_that_is_no_number_latches_both():
    settings = parse_settings({"prbs": SHORT})
    wanted = prbs_nm(settings.prbs, 1000.0)
    wanted[300] = math.nan
    batch = simulate_epochs(settings, 1, perturbation_nm=wanted)
    samples, result, _ = by_the_loop(settings, epoch_generator(1, 0), perturbation_nm=wanted)
    assert_same_bits(batch, 0, samples, result)
    assert batch.cause[0] == Cause.COMMAND_NOT_FINITE


def test_an_angle_beyond_the_limit_latches_both():
    """A guard that lets no one beyond a limit sees none there: this one counts inside as beyond."""
    settings = parse_settings({"prbs": SHORT})
    table = bench(settings, 2000)
    limits = table.coefficients.limits._replace(tolerance_rad=-0.65)
    table = dataclasses.replace(table, coefficients=table.coefficients._replace(limits=limits))
    inputs = draw_inputs(table, settings.subject["OFF"], epoch_generator(1, 0))
    batch = simulate_inputs(table, prbs_nm(settings.prbs, 1000.0), [inputs])

    def spoil(_, loop):
        loop.limits = limits

    samples, result, _ = by_the_loop(settings, epoch_generator(1, 0), spoil=spoil)
    assert_same_bits(batch, 0, samples, result)
    assert batch.cause[0] == Cause.POSITION_LIMIT_EXCEEDED


def test_a_whole_epoch_of_20_s_is_the_loops():
    settings = Settings()
    subject = SubjectSettings(voluntary_sd_nm=0.2, stiffness_cv_percent=20.0)
    batch = simulate_epochs(settings, 1, subjects=[subject])
    samples, result, joint = by_the_loop(settings, epoch_generator(1, 0), subject)
    assert_same_bits(batch, 0, samples, result)
    assert batch.joints == (joint,)


def test_the_first_epoch_of_a_session_reads_the_same(simulate):
    tables = {"prbs": {"duration_s": 3.0}, "rig": PAPER["rig"]}
    (recorded,), _ = read_session(simulate(seed=5, **tables))
    settings = parse_settings({"seed": 5, **tables})
    table = bench(settings, 3000)
    inputs = draw_inputs(table, settings.subject["OFF"], np.random.default_rng(5))
    batch = simulate_inputs(
        table, prbs_nm(settings.prbs, 1000.0), [inputs], conditions=[recorded.condition]
    )
    ours = batch.epoch(0)
    assert list(ours.channels) == list(recorded.channels)
    for name, channel in ours.channels.items():
        np.testing.assert_array_equal(bits(channel.values), bits(recorded.channels[name].values))
        np.testing.assert_array_equal(bits(channel.time_s), bits(recorded.channels[name].time_s))
    for field in ("condition", "task", "motion", "excitation_hz", "closed", "virtual"):
        assert getattr(ours, field) == getattr(recorded, field)


def test_what_is_compiled_also_runs_in_the_interpreter():
    settings = parse_settings({"prbs": {"duration_s": 1.0}, "rig": PAPER["rig"]})
    table = bench(settings, 1000)
    inputs = draw_inputs(table, settings.subject["OFF"], epoch_generator(1, 0))
    wanted = prbs_nm(settings.prbs, 1000.0)
    batch = simulate_inputs(table, wanted, [inputs])
    columns = plain.EpochColumns(*(np.empty(1000) for _ in range(5)), np.empty(1000, np.int8))
    joint = plain.Joint(*dataclasses.astuple(inputs.joint))
    plain.run_epoch(
        table.coefficients,
        joint,
        wanted,
        inputs.voluntary_nm,
        inputs.noise_nm,
        inputs.torque,
        inputs.motion,
        BiquadState(),
        guard_state(table.coefficients.limits),
        DriveState(),
        columns,
    )
    for name, values in columns._asdict().items():
        np.testing.assert_array_equal(bits(getattr(batch, name)[0]), bits(values), err_msg=name)


def test_every_recorded_column_is_compared():
    known = {"tick", "time_s", "lateness_s", "epoch", "target_angle_rad"}
    known |= set(Sample._field_defaults)  # what devices say; the batch has the cause of the epoch
    assert set(Sample._fields) - known == set(COLUMNS)
