"""Subject, perturbation, sensors and session folder of the independent simulator."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from tests.scenarios.catalogue import SCENARIOS
from tests.scenarios.motion import STIFFNESS, SUBJECT
from tests.scenarios.perturbations import Perturbation, perturbation_nm
from tests.scenarios.recordings import measured_alone, simulate
from tests.scenarios.scenario import scenario
from tests.scenarios.session import write_session
from tests.scenarios.subject import Subject, courses

import rigidimeter as rm

SHORT = {"duration_s": 8.0}


def rng() -> np.random.Generator:
    return np.random.default_rng(7)


def test_voluntary_torque_has_its_sd_and_its_band() -> None:
    torque = courses(Subject(voluntary_nm=0.2), 400.0, 0, rng())[SUBJECT]
    assert abs(np.std(torque) / 0.2 - 1) < 0.05
    power = np.abs(np.fft.rfft(torque)) ** 2
    frequency = np.fft.rfftfreq(torque.size, 1e-3)
    inside = (frequency > 0.29) & (frequency < 4.01)
    assert power[inside].sum() > 0.99 * power.sum()


def test_voluntary_torque_with_skirts_has_its_sd_and_power_beyond_its_band() -> None:
    subject = Subject(voluntary_nm=0.2, voluntary_skirts=True)
    torque = courses(subject, 400.0, 0, rng())[SUBJECT]
    assert abs(np.std(torque) / 0.2 - 1) < 0.05
    power = np.abs(np.fft.rfft(torque)) ** 2
    beyond = np.fft.rfftfreq(torque.size, 1e-3) > 8.0
    assert 1e-3 < power[beyond].sum() / power.sum() < 0.05


def test_a_tool_is_inertia_of_its_epochs() -> None:
    found = SCENARIOS["J a third larger in half the epochs"].simulated(0, 4)
    assert np.allclose(found.truth[:, 0], [0.0045, 0.0045, 0.006, 0.006])


def test_a_velocity_is_stored_as_its_sensor_makes_it() -> None:
    names = ("differenced", "in steps of 2°/s")
    made = [SCENARIOS[f"velocity {name}"].simulated(0, 1).epochs[0].channels for name in names]
    angle, velocity = (made[0][name].values for name in ("angle_rad", "velocity_rad_s"))
    step = np.radians(0.01)
    assert np.allclose(velocity[1:], np.diff(angle) * 1000.0, atol=0.51 * step)
    coarse = made[1]["velocity_rad_s"].values / np.radians(2.0)
    assert np.allclose(coarse, np.round(coarse), atol=1e-9)


def test_tremor_has_its_amplitude_and_a_frequency_between_4_and_7_hz() -> None:
    torque = courses(Subject(tremor_nm=0.3), 60.0, 0, rng())[SUBJECT]
    assert np.max(torque) > 0.299
    assert np.max(np.abs(torque)) <= 0.3
    power = np.abs(np.fft.rfft(torque)) ** 2
    assert 4 < np.fft.rfftfreq(torque.size, 1e-3)[np.argmax(power)] < 7


def test_stiffness_changes_about_its_mean_and_by_epoch() -> None:
    for course in ("step", "drift"):
        found = courses(Subject(stiffness=course, stiffness_depth=0.3), 20.0, 0, rng())[STIFFNESS]
        assert abs(found[:20_000].mean() - 1.0) < 1e-3
        assert (round(found[0], 6), round(found[19_999], 3)) == (0.7, 1.3)
    assert courses(Subject(between=(0.6, 1.4)), 1.0, 3, rng())[STIFFNESS].max() == 1.4


def test_the_binary_sequence_is_of_maximal_length() -> None:
    chips = perturbation_nm(Perturbation(bits=7, clock_hz=20.0, duration_s=6.35), 20.0)
    chips = np.sign(chips)
    assert chips.sum() == 1.0
    products = [np.dot(chips, np.roll(chips, k)) for k in range(127)]
    assert products[0] == 127.0
    assert np.all(np.array(products[1:]) == -1.0)


def test_the_multisine_has_equal_lines_in_its_band_and_its_peak() -> None:
    values = perturbation_nm(Perturbation(kind="multisine", duration_s=20.0), 1000.0)
    power = np.abs(np.fft.rfft(values)) ** 2
    frequency = np.fft.rfftfreq(values.size, 1e-3)
    lines = power > 0.01 * power.max()
    assert np.ptp(power[lines]) < 1e-6 * power.max()
    assert 0.15 <= frequency[lines].min() < frequency[lines].max() <= 10.0
    assert abs(np.max(np.abs(values)) - 1.0) < 1e-12


def test_what_is_lost_late_and_rounded_is_so_in_the_record() -> None:
    found = scenario(
        "x",
        perturbation=SHORT,
        torque={"lost": 0.1, "late_s": 0.004, "stamp_noise_s": 0.0003},
        motion={"step": 0.01},
        velocity=False,
    )
    whole, _ = simulate(scenario("x", perturbation=SHORT).setup, 1, np.random.SeedSequence(3))
    (epoch,), _ = simulate(found.setup, 1, np.random.SeedSequence(3))
    torque = epoch.channels["torque_nm"]
    assert 0.88 < len(torque) / len(whole[0].channels["torque_nm"]) < 0.92
    assert np.all(np.diff(torque.time_s) > 0)
    early = torque.time_s - np.round(torque.time_s - 0.004, 3)
    assert 0.0036 < early.min() < 0.0038 < 0.0042 < early.max() < 0.0044
    steps = epoch.channels["angle_rad"].values / 0.01
    assert np.allclose(steps, np.round(steps), atol=1e-9)
    assert "velocity_rad_s" not in epoch.channels


def test_a_recording_follows_from_its_number() -> None:
    one = scenario("x", perturbation=SHORT, subject={"tremor_nm": 0.1})
    first, again, other = (one.simulated(k, 1).epochs[0] for k in (0, 0, 1))
    torque = [epoch.channels["torque_nm"].values for epoch in (first, again, other)]
    assert np.array_equal(torque[0], torque[1])
    assert not np.array_equal(torque[0], torque[2])


def test_a_file_of_torque_and_motion_says_nothing_of_the_perturbation() -> None:
    (epoch,), _ = simulate(scenario("x", perturbation=SHORT).setup, 1, np.random.SeedSequence(3))
    blind = measured_alone(epoch)
    assert sorted(blind.channels) == ["angle_rad", "torque_nm", "velocity_rad_s"]
    assert blind.excitation_hz is None


def test_late_and_missed_ticks_take_nothing_off_the_joint() -> None:
    """The drive holds its command; from a drive that is taken for unknown J is 0.8 % low."""
    found = SCENARIOS["2 % of ticks late, 1 ms"]
    (epoch,), truth = found.simulated(0, 1)
    command = epoch.channels["velocity_command_rad_s"]
    assert epoch.ticks is not None
    assert epoch.ticks.ran == len(command)
    assert epoch.ticks.ran + epoch.ticks.missed == 20000
    assert 100 < epoch.ticks.missed < 400
    assert 100 < epoch.ticks.late < 400
    assert np.max(np.diff(command.time_s)) > 0.003
    assert np.min(np.diff(command.time_s)) > 0.0
    for method in ("iv", "bandlimited"):
        (fit,) = rm.estimate([epoch], method, settings=found.analysed_with()).fits
        assert np.all((fit.low <= truth[0]) & (truth[0] <= fit.high)), method
        assert fit.high[0] - fit.low[0] < 0.01 * truth[0, 0]
        assert [each.name for each in fit.findings if each.level != "note"] == []


def test_a_session_folder_gives_the_estimates_of_the_epochs(tmp_path: Path) -> None:
    """Simulated epochs through the recorder and the reader are what they were."""
    plain = scenario("x", perturbation=SHORT)
    epochs, truth = simulate(plain.setup, 2, np.random.SeedSequence(5))
    settings = plain.analysed_with()
    write_session(tmp_path / "session", epochs, settings)
    read = rm.read(tmp_path / "session")
    assert not read.notices
    direct, through = rm.estimate(epochs, "iv", settings=settings), rm.estimate(read, "iv")
    for one, other in zip(direct.fits, through.fits, strict=True):
        assert np.allclose(one.value, other.value, rtol=1e-4)
    assert np.allclose(through.fits[0].value, truth[0], rtol=0.01)


def test_the_catalogue_names_limbs_and_findings() -> None:
    assert len(SCENARIOS) >= 24
    for name, found in SCENARIOS.items():
        assert found.name == name
        assert isinstance(found.findings, tuple)
        found.analysed_with()
