"""Seeds, chunks, workers, what varies by epoch, and what is refused."""

import builtins
import math
import subprocess
import sys
import tracemalloc

import numba
import numpy as np
import pytest

from rigidimeter.analysis.estimation import fit_epoch
from rigidimeter.core.errors import UserError
from rigidimeter.core.settings import Settings, SubjectSettings, parse_settings
from rigidimeter.model import JointDynamics
from rigidimeter.rig.guard import Cause
from rigidimeter.virtual.batch import (
    bench,
    draw_inputs,
    epoch_generator,
    simulate_chunks,
    simulate_epochs,
    simulate_inputs,
)
from rigidimeter.virtual.batch import compiled_steps as compiled

SETTINGS = parse_settings(
    {
        "prbs": {"duration_s": 1.0},
        "rig": {"motion": {"jitter_s": 0.0005}},
        "subject": {
            "OFF": {"voluntary_sd_nm": 0.2, "stiffness_cv_percent": 20.0},
            "DBS": {"stiffness_nm_rad": 1.2},
        },
    }
)


def arrays(batches):
    names = [name for name, value in vars(batches[0]).items() if isinstance(value, np.ndarray)]
    names.remove("time_s")
    return {name: np.concatenate([getattr(batch, name) for batch in batches]) for name in names}


def assert_equal(ours, others):
    for name, values in arrays(ours).items():
        np.testing.assert_array_equal(values, arrays(others)[name], err_msg=name)
    assert [j for batch in ours for j in batch.joints] == [j for b in others for j in b.joints]


@pytest.mark.parametrize("workers", [1, 2, 5])
@pytest.mark.parametrize("chunk", [1, 3, 7, 100])
def test_neither_chunks_nor_workers_change_a_bit(chunk, workers):
    whole = simulate_epochs(SETTINGS, 7)
    parts = list(simulate_chunks(SETTINGS, 7, chunk=chunk, workers=workers))
    assert_equal(parts, [whole])
    assert [part.first for part in parts] == list(range(0, 7, chunk))


def test_any_epoch_can_be_had_alone():
    whole = simulate_epochs(SETTINGS, 4, seed=9)
    alone = simulate_epochs(SETTINGS, 1, seed=9, first=3)
    np.testing.assert_array_equal(alone.torque_nm[0], whole.torque_nm[3])
    assert alone.epoch(0).name == whole.epoch(3).name == "batch of seed 9, epoch 3"


def test_the_seeds_are_the_spawned_children():
    child = np.random.SeedSequence(9).spawn(3)[2]
    expected = np.random.default_rng(child).standard_normal(4)
    np.testing.assert_array_equal(epoch_generator(9, 2).standard_normal(4), expected)


def test_epochs_and_seeds_differ():
    batch = simulate_epochs(SETTINGS, 3)
    assert len({row.tobytes() for row in batch.torque_nm}) == 3
    other = simulate_epochs(SETTINGS, 3, seed=2)
    assert not np.array_equal(batch.torque_nm, other.torque_nm)


def test_what_is_given_by_epoch():
    joints = [JointDynamics(0.0045, 0.1, 1.0), JointDynamics(0.006, 0.2, 3.0)]
    ticks = np.arange(1000)
    wanted = np.stack([np.sign(np.sin(ticks / 30)), np.sign(np.sin(ticks / 50))])
    batch = simulate_epochs(SETTINGS, 2, joints=joints, perturbation_nm=wanted)
    assert batch.joints == tuple(joints)
    for i in range(2):
        alone = simulate_epochs(
            SETTINGS, 1, joints=joints[i : i + 1], perturbation_nm=wanted[i], first=i
        )
        np.testing.assert_array_equal(alone.torque_nm[0], batch.torque_nm[i])
        np.testing.assert_array_equal(batch.epoch(i).channels["perturbation_nm"].values, wanted[i])


def test_conditions_and_subjects():
    batch = simulate_epochs(SETTINGS, 2, conditions=["OFF", "DBS"])
    assert batch.joints[1].stiffness_nm_rad == 1.2
    assert [batch.epoch(i).condition for i in range(2)] == ["OFF", "DBS"]
    stiff = SubjectSettings(stiffness_nm_rad=9.0)
    batch = simulate_epochs(SETTINGS, 1, conditions="elsewhere", subjects=[stiff])
    assert batch.joints[0].stiffness_nm_rad == 9.0
    assert batch.conditions == ("elsewhere",)


def test_a_given_joint_leaves_noise_and_subject_as_they_were():
    table = bench(SETTINGS, 1000)
    subject = SETTINGS.subject["OFF"]
    drawn = draw_inputs(table, subject, epoch_generator(1, 0))
    given = draw_inputs(table, subject, epoch_generator(1, 0), JointDynamics(1.0, 1.0, 1.0))
    np.testing.assert_array_equal(drawn.noise_nm, given.noise_nm)
    np.testing.assert_array_equal(drawn.voluntary_nm, given.voluntary_nm)


def test_an_epoch_gives_its_joint_back():
    settings = Settings()
    joint = JointDynamics(0.0045, 0.1368, 1.751)
    epoch = simulate_epochs(settings, 1, joints=[joint]).epoch(0)
    fit = fit_epoch(epoch, "bandlimited", settings)
    assert fit.outcome.included
    assert fit.stiffness_nm_rad == pytest.approx(1.751, rel=0.005)
    assert fit.damping_nm_s_rad == pytest.approx(0.1368, rel=0.01)
    assert fit.inertia_kg_m2 == pytest.approx(0.0045, rel=0.02)


def test_an_epoch_that_came_to_the_limit_does_not_count():
    settings = parse_settings(
        {
            "prbs": {"duration_s": 2.0, "amplitude_nm": 8.0},
            "guard": {"position_limit_deg": 25.0},
            "subject": {"OFF": {"stiffness_nm_rad": 0.1, "damping_nm_s_rad": 0.01}},
        }
    )
    batch = simulate_epochs(settings, 1)
    closed = batch.epoch(0).closed
    assert closed.kind == "excluded"
    assert f"limit of ±25 deg at {batch.limit_time_s[0]:.3f} s" in closed.reason


PUSHES = {"voluntary_sd_nm": 1.0}


def test_a_latched_epoch_ends_there_and_says_why():
    settings = parse_settings(
        {"prbs": {"duration_s": 2.0}, "guard": {"torque_limit_nm": 1.3}, "subject": {"OFF": PUSHES}}
    )
    batch = simulate_epochs(settings, 1)
    assert batch.cause[0] == Cause.TORQUE_HIGH
    epoch = batch.epoch(0)
    assert len(epoch.channels["perturbation_nm"]) == batch.ticks[0] < 2000
    assert epoch.closed.reason == f"the guard stopped the rig: {Cause.TORQUE_HIGH.sentence}"


def test_memory_does_not_grow_with_the_number_of_epochs():
    def peak(n_epochs):
        tracemalloc.start()
        for _ in simulate_chunks(SETTINGS, n_epochs, chunk=5):
            pass
        _, most = tracemalloc.get_traced_memory()
        tracemalloc.stop()
        return most

    peak(1)  # what is loaded once is not counted
    assert peak(30) < 1.2 * peak(10)


def test_progress_counts_epochs():
    done = []
    for _ in simulate_chunks(SETTINGS, 5, chunk=2, progress=done.append):
        pass
    assert done == [1, 2, 3, 4, 5]


def test_columns_cannot_be_written():
    batch = simulate_epochs(SETTINGS, 1)
    with pytest.raises(ValueError, match="read-only"):
        batch.torque_nm[0, 0] = 1.0
    with pytest.raises(IndexError, match="epoch 1 of a batch of 1"):
        batch.epoch(1)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"n_epochs": 0}, "at least 1 epoch"),
        ({"first": -1}, "from number 0 on"),
        ({"chunk": 0}, "chunk and workers"),
        ({"workers": 0}, "chunk and workers"),
        ({"joints": [JointDynamics(1.0, 1.0, 1.0)]}, "2 epochs need as many joints, got 1"),
        ({"conditions": ["OFF"]}, "2 epochs need as many conditions, got 1"),
        ({"perturbation_nm": np.zeros((3, 10))}, "must have shape"),
        ({"perturbation_nm": []}, "must have shape"),
        ({"perturbation_nm": 1.0}, "must have shape"),
    ],
)
def test_what_does_not_fit_is_refused_at_once(options, words):
    with pytest.raises(ValueError, match=words):
        simulate_chunks(SETTINGS, **{"n_epochs": 2, **options})


def test_a_condition_without_a_subject_is_named():
    with pytest.raises(UserError, match=r"no \[subject.ON\]; known conditions: DBS, OFF"):
        simulate_epochs(SETTINGS, 1, conditions="ON")


def test_inputs_of_another_length_are_refused():
    inputs = draw_inputs(bench(SETTINGS, 100), SETTINGS.subject["OFF"], epoch_generator(1, 0))
    with pytest.raises(ValueError, match="100 ticks and 101 torque samples"):
        type(inputs)(inputs.joint, np.zeros(99), inputs.noise_nm, inputs.torque, inputs.motion)


def test_a_bench_of_another_length_is_refused():
    table = bench(SETTINGS, 100)
    inputs = draw_inputs(table, SETTINGS.subject["OFF"], epoch_generator(1, 0))
    with pytest.raises(ValueError, match="for 100 ticks, but perturbation and inputs have 99, 100"):
        simulate_inputs(table, np.zeros(99), [inputs])
    with pytest.raises(ValueError, match="for 101 ticks"):
        simulate_inputs(bench(SETTINGS, 101), np.zeros(100), [inputs])


def test_one_form_is_compiled_for_all_settings():
    """Other numbers, and arrays that can or cannot be written, are no reason to compile again."""
    simulate_epochs(SETTINGS, 1, perturbation_nm=np.ones(50))
    simulate_epochs(Settings(), 1, perturbation_nm=[0, 1, 0])
    assert len(compiled.compiled().run_epoch.signatures) == 1
    assert len(compiled.compiled().moments.signatures) == 1


def test_the_kept_code_follows_the_source_of_every_step(tmp_path, monkeypatch):
    before = compiled._digest()
    changed = tmp_path / "guard.py"
    source = sys.modules["rigidimeter.rig.guard.step"].__file__
    with open(source, "rb") as file:
        changed.write_bytes(file.read() + b"\n")
    monkeypatch.setattr(sys.modules["rigidimeter.rig.guard.step"], "__file__", str(changed))
    assert compiled._digest() != before


def test_without_numba_a_sentence_says_so(monkeypatch):
    load = builtins.__import__

    def refuse(name, *rest):
        if name == "numba":
            raise ImportError(name)
        return load(name, *rest)

    monkeypatch.setattr(builtins, "__import__", refuse)
    with pytest.raises(UserError, match=r"rigidimeter\[batch\]"):
        compiled.compiled.__wrapped__()


def test_without_a_folder_for_the_code_it_is_compiled_each_time(monkeypatch):
    njit = numba.njit

    def nowhere(function, *, cache=False, **options):
        if cache:
            raise RuntimeError("cannot cache function: no locator available")
        return njit(function, **options)

    monkeypatch.setattr(numba, "njit", nowhere)
    elapsed_s, left = np.empty(1), np.empty(1)
    ones = np.ones(1)
    compiled.compiled.__wrapped__().moments(0.75 * ones, ones, 1.0, elapsed_s, left)
    assert (elapsed_s[0], left[0]) == (0.75, 0.25)


def test_importing_the_room_does_not_import_numba():
    code = "import sys, rigidimeter.virtual.batch; sys.exit('numba' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_the_arm_moves_as_the_admittance_says_when_nothing_resists():
    """J_c v' + B_c v = M with no joint to speak of: v tends to M / B_c, in rad/s."""
    settings = parse_settings(
        {
            "guard": {"position_limit_deg": 180.0, "acceleration_limit_deg_s2": 1e5},
            "rig": {"torque": {"noise_sd_nm": 0.0, "resolution_nm": 0.0}},
        }
    )
    free = JointDynamics(1e-9, 0.0, 0.0)
    batch = simulate_epochs(settings, 1, perturbation_nm=np.ones(600), joints=[free])
    J, B = settings.controller.inertia_kg_m2, settings.controller.damping_nm_s_rad
    ideal = -math.expm1(-B * 0.6 / J) / B
    assert batch.velocity_command_rad_s[0, -1] == pytest.approx(ideal, rel=1e-6)
