"""EMG of the virtual subject: recorded, read back, and compared with the torque that made it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.replayed import assert_folder_replayed

import rigidimeter as rm
from rigidimeter.analysis.export import format_named, sessions_of_recording
from rigidimeter.core.errors import UserError
from rigidimeter.core.session import EMG, EmgLog, read_session_files, recover
from rigidimeter.core.settings import Settings, dump_settings, parse_settings
from rigidimeter.model import EMG_BAND_HZ, VirtualEmg, VirtualMuscles
from rigidimeter.virtual import run_virtual_session

TABLES: dict[str, Any] = {
    "emg": {"source": "virtual", "muscles": ["biceps", "triceps"], "electrodes": "Ag/AgCl, 20 mm",
            "placement": "SENIAM, biceps brachii and triceps long head"},
    "subject": {"OFF": {"voluntary_sd_nm": 0.3, "tremor_amplitude_nm": 0.2}},
    "protocol": {"blocks": [{"task": "prbs", "condition": "OFF", "epochs": 2}],
                 "rests_s": [1.0], "return_s": 0.5},
    "prbs": {"duration_s": 2.0},
}  # fmt: skip


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    """Return a session of two epochs with the EMG of two muscles."""
    folder = tmp_path_factory.mktemp("emg") / "session"
    run_virtual_session(parse_settings(TABLES), folder)
    assert_folder_replayed(folder)
    return folder


def of_ticks(folder: Path) -> tuple[VirtualMuscles, dict[str, Any], dict[int, str]]:
    settings = parse_settings(TABLES)
    columns = read_session_files(folder).samples.columns
    conditions = dict.fromkeys(range(100), "OFF")
    return VirtualMuscles(settings, settings.subject["OFF"]), columns, conditions


def test_epochs_have_the_emg_of_each_muscle(folder: Path):
    for epoch in rm.read(folder).epochs:
        torque = epoch.channels["torque_nm"]
        for name in ("emg_v", "emg_2_v"):
            emg = epoch.channels[name]
            assert emg.rate_hz == pytest.approx(2000.0)
            assert abs(emg.time_s[0] - torque.time_s[0]) < 0.003
            assert abs(emg.time_s[-1] - torque.time_s[-1]) < 0.003
    about = json.loads((folder / "manifest.json").read_text())["settings"]["emg"]
    assert about["muscles"] == ["biceps", "triceps"]
    assert about["placement"] == TABLES["emg"]["placement"]


def test_it_is_exported_with_the_session(folder: Path):
    (session,) = sessions_of_recording(rm.read(folder), None)
    (emg,) = [stream for stream in session.streams if stream.name == "emg"]
    assert list(emg.columns) == ["emg_v", "emg_2_v"]
    assert session.about["units"]["emg_2_v"] == "V"
    assert session.about["settings"]["emg"]["muscles"] == ["biceps", "triceps"]


def test_its_nwb_file_is_read_as_the_session(folder: Path, tmp_path: Path):
    pytest.importorskip("pynwb", reason="pip install 'rigidimeter[nwb]'")
    (session,) = sessions_of_recording(rm.read(folder), None)
    format_named("nwb").write(session, tmp_path / "session.nwb")
    found = rm.read(tmp_path / "session.nwb")
    assert not [notice for notice in found.notices if "EMG" in notice.text]
    for epoch, own in zip(found.epochs, rm.read(folder).epochs, strict=True):
        for name in ("emg_v", "emg_2_v"):
            one, recorded = epoch.channels[name], own.channels[name]
            at = np.searchsorted(one.time_s, recorded.time_s[5:-5] - 1e-5)
            np.testing.assert_array_equal(one.values[at], recorded.values[5:-5])
            np.testing.assert_allclose(one.time_s[at], recorded.time_s[5:-5], atol=1e-6)


def test_a_session_without_emg_is_as_before(tmp_path: Path):
    assert "emg" not in dump_settings(Settings())
    small = {
        **TABLES,
        "protocol": {**TABLES["protocol"], "blocks": [TABLES["protocol"]["blocks"][0]]},
    }
    del small["emg"]
    run_virtual_session(parse_settings(small), tmp_path / "session")
    assert_folder_replayed(tmp_path / "session")
    assert not (tmp_path / "session" / EMG).exists()
    names = {name for epoch in rm.read(tmp_path / "session").epochs for name in epoch.channels}
    assert not [name for name in names if name.startswith("emg")]


def test_the_motion_is_that_without_emg(folder: Path, tmp_path: Path):
    without = {key: value for key, value in TABLES.items() if key != "emg"}
    run_virtual_session(parse_settings(without), tmp_path / "session")
    assert_folder_replayed(tmp_path / "session")
    columns = read_session_files(folder).samples.columns
    for name, values in read_session_files(tmp_path / "session").samples.columns.items():
        np.testing.assert_array_equal(values, columns[name], err_msg=name)


def test_amplitude_follows_the_torque_of_the_subject():
    """RMS is the gain times the torque in the muscle's direction, and nothing outside the band."""
    emg = parse_settings(TABLES).emg.model_copy(
        update={"virtual_noise_uv": 0.0, "virtual_hum_uv": 0.0}
    )
    muscles = VirtualEmg(emg, np.random.default_rng(3))
    torque = np.repeat([0.5, -0.25], 20000)
    biceps, triceps = muscles.block(torque).T
    assert np.std(biceps[:20000]) == pytest.approx(0.5 * 200e-6, rel=0.03)
    assert np.std(triceps[20000:]) == pytest.approx(0.25 * 200e-6, rel=0.03)
    assert not biceps[20000:].any()
    assert not triceps[:20000].any()
    power = np.abs(np.fft.rfft(biceps[:20000])) ** 2
    hz = np.fft.rfftfreq(20000, 1 / 2000.0)
    inside = (hz > 0.8 * EMG_BAND_HZ[0]) & (hz < 1.2 * EMG_BAND_HZ[1])
    assert power[inside].sum() > 0.95 * power.sum()


def test_a_muscle_is_active_before_its_torque():
    """By the electromechanical delay; EMG whose torque is still to come is not given."""
    emg = parse_settings(TABLES).emg.model_copy(
        update={"virtual_noise_uv": 0.0, "virtual_hum_uv": 0.0, "virtual_delay_s": 0.03}
    )
    time_s = np.arange(2001) / 1000.0
    muscles = VirtualEmg(emg, np.random.default_rng(3))
    biceps, triceps = muscles.until(time_s, np.where(time_s >= 1.0, 0.5, 0.0)).T
    assert biceps.size == 1 + round((2.0 - 0.03) * 2000)
    assert np.flatnonzero(biceps)[0] == pytest.approx(0.97 * 2000, abs=2)
    assert not triceps.any()


def test_baseline_is_noise_and_hum():
    emg = parse_settings(TABLES).emg
    muscles = VirtualEmg(emg, np.random.default_rng(3))
    biceps = muscles.block(np.zeros(20000))[:, 0]
    assert np.std(biceps) == pytest.approx(1e-6 * np.hypot(4.0, 2.0 / np.sqrt(2.0)), rel=0.03)
    hum = 2.0 * np.mean(biceps * np.exp(-2j * np.pi * 50.0 * np.arange(20000) / 2000.0))
    assert abs(hum) == pytest.approx(2e-6, rel=0.05)


def test_the_torque_behind_the_emg_is_that_of_the_rig(folder: Path):
    """While the arm stands still the sensor measures the subject and the arm's stiffness."""
    loud = {**TABLES, "emg": {**TABLES["emg"], "virtual_noise_uv": 0.0, "virtual_hum_uv": 0.0}}
    settings = parse_settings(loud)
    _, columns, conditions = of_ticks(folder)
    emg = VirtualMuscles(settings, settings.subject["OFF"]).take(
        columns["tick"], columns["epoch"], conditions
    )
    subject_nm = 1.751 * columns["angle_rad"] - columns["torque_nm"]
    still = (columns["velocity_command_rad_s"] == 0.0) & (np.abs(columns["velocity_rad_s"]) < 1e-3)
    still &= (columns["epoch"] < 0) & (np.abs(subject_nm) > 0.05)
    # The sensor is 1 ms late, and the muscle before its torque.
    at = (columns["tick"][still] - 1) * 2 - round(2000.0 * settings.emg.virtual_delay_s)
    assert at[0] > 0
    toward = subject_nm[still] > 0.0
    assert still.sum() > 50
    assert emg[at[toward], 0].all()
    assert not emg[at[toward], 1].any()
    assert emg[at[~toward], 1].all()
    assert not emg[at[~toward], 0].any()


def test_the_numbers_do_not_depend_on_when_they_are_taken(folder: Path):
    at_once, columns, conditions = of_ticks(folder)
    in_parts, *_ = of_ticks(folder)
    tick, epoch = columns["tick"], columns["epoch"]
    whole = at_once.take(tick, epoch, conditions)
    cuts = np.split(np.arange(tick.size), [1, 2, 700, 2000, 2000])
    parts = [in_parts.take(tick[rows], epoch[rows], conditions) for rows in cuts]
    np.testing.assert_array_equal(whole, np.concatenate(parts))


def test_a_torn_file_is_read_up_to_its_last_batch_and_closed_by_recover(
    folder: Path, tmp_path: Path
):
    torn = tmp_path / "torn"
    torn.mkdir()
    for file in folder.iterdir():
        (torn / file.name).write_bytes(file.read_bytes())
    content, events = (folder / EMG).read_bytes(), (folder / "events.jsonl").read_bytes()
    (torn / EMG).write_bytes(content[: int(0.75 * len(content))])
    (torn / "events.jsonl").write_bytes(b"".join(events.splitlines(keepends=True)[:-1]))
    first = rm.read(folder).epochs[0].channels["emg_v"]
    left = rm.read(torn).epochs[0].channels["emg_v"]
    np.testing.assert_array_equal(left.values, first.values)
    assert "emg.torn" in recover(torn).torn_files
    np.testing.assert_array_equal(rm.read(torn).epochs[0].channels["emg_v"].values, first.values)


def test_another_clock_is_brought_to_the_session_by_its_measured_offset(folder: Path, tmp_path):
    """A source whose clock is 100 s ahead and gains 1e-4, its offset measured within 50 µs."""
    other = tmp_path / "other"
    other.mkdir()
    for file in folder.iterdir():
        if file.name != EMG:
            (other / file.name).write_bytes(file.read_bytes())
    rng = np.random.default_rng(1)
    session_id = json.loads((folder / "manifest.json").read_text())["session_id"]
    log = EmgLog(other, ("emg_v", "emg_2_v"), 2000.0, session_id)
    for first in range(0, 8000, 500):
        true_s = (first + np.arange(500)) / 2000.0
        source_s = 100.0 + true_s * (1 + 1e-4)
        offset_s = true_s[0] - source_s[0] + 50e-6 * rng.standard_normal()
        log.append(source_s, offset_s, np.column_stack([true_s, true_s]))
    log.close()
    emg = rm.read(other).epochs[0].channels["emg_v"]
    assert emg.values.size > 3000
    assert np.max(np.abs(emg.time_s - emg.values)) < 1e-4


@pytest.mark.parametrize(
    ("table", "sentence"),
    [
        ({"source": "virtual"}, "muscles must have a label for each channel"),
        ({"source": "lsl", "muscles": ["a"]}, "stream must name the stream"),
        ({"source": "daq", "muscles": ["a"]}, "daq_channels must name the inputs"),
        (
            {"source": "virtual", "muscles": ["a"], "rate_hz": 1000.0},
            "emg.rate_hz = 1000.0: Input should be greater than or equal to 2000, in Hz",
        ),
    ],
)
def test_incomplete_settings_are_refused(table: dict[str, Any], sentence: str):
    with pytest.raises(UserError) as refused:
        parse_settings({"emg": table})
    assert sentence in str(refused.value)
