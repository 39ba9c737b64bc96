"""`read`: several paths become one recording, and a bad one loses no other."""

import hashlib
from pathlib import Path

import numpy as np
import pytest
from tests.replayed import assert_folder_replayed

from rigidimeter.analysis.reading import read
from rigidimeter.analysis.recording import provenance
from rigidimeter.core.errors import UserError
from rigidimeter.core.settings import parse_settings
from rigidimeter.virtual import run_virtual_session


def write(path: Path, head: str = "time_s,torque_nm,angle_rad") -> Path:
    rows = "".join(f"{k / 100},{k % 7},{k % 5}\n" for k in range(200))
    path.write_text(f"{head}\n{rows}")
    return path


@pytest.fixture
def session(tmp_path):
    settings = parse_settings(
        {"protocol": {"blocks": [{"task": "prbs", "condition": "DBS", "epochs": 1}]}}
    )
    run_virtual_session(settings, tmp_path / "session")
    assert_folder_replayed(tmp_path / "session")
    return tmp_path / "session"


def test_a_file_alone(tmp_path):
    path = write(tmp_path / "a.csv")
    recording = read(str(path), epoch_length_s=1.0, condition="OFF", task="prbs")
    assert [epoch.label for epoch in recording.epochs] == ["1", "2"]
    assert {(epoch.condition, epoch.task) for epoch in recording.epochs} == {("OFF", "prbs")}
    assert recording.paths == (path,)
    assert not recording.failed
    assert repr(recording).startswith(
        "a.csv; 2 epochs of 1 s at 100 samples/s; OFF 2; torque_nm, angle_rad"
    )
    assert "\n" not in repr(recording)
    shown = recording._repr_html_()
    assert f"<td>{path.name}</td><td>OFF</td><td>2</td><td>1</td><td>100</td>" in shown


def test_options_reach_the_file(tmp_path):
    path = write(tmp_path / "a.csv", "x,Fz,theta")
    names = {"torque_nm": "Fz", "angle_rad": "theta"}
    (epoch,) = read(path, column=names, rate_hz=50.0, reaction=True).epochs
    assert epoch.channels["torque_nm"].time_s[-1] == pytest.approx(199 / 50)
    np.testing.assert_array_equal(epoch.channels["torque_nm"].values[:3], [0, -1, -2])


def test_a_condition_for_each_path(tmp_path):
    paths = [write(tmp_path / name) for name in ("a.csv", "b.csv")]
    recording = read(paths, condition=["OFF", "DBS"])
    assert [epoch.condition for epoch in recording.epochs] == ["OFF", "DBS"]
    with pytest.raises(UserError, match="--condition was given 3 times for 2 inputs"):
        read(paths, condition=["OFF", "DBS", "OFF"])


def test_what_cannot_be_read_is_said_and_the_rest_is_read(tmp_path):
    good, bad = write(tmp_path / "a.csv"), tmp_path / "none.csv"
    recording = read([bad, good])
    assert recording.failed
    assert [notice.text for notice in recording.notices] == [f"{bad}: there is no such file"]
    assert [epoch.source for epoch in recording.epochs] == [str(good)]
    with pytest.raises(UserError, match="there is no such file"):
        read(bad)


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ({"rate_hz": -1.0}, "--rate-hz -1: the sampling rate must be greater than 0 Hz"),
        ({"epoch_length_s": np.nan}, "--epoch-length-s nan: the length must be greater than 0 s"),
        ({"task": "walk"}, "--task walk: must be prbs or sinusoid"),
        ({"rate_hz": "1000"}, "--rate-hz '1000': the sampling rate must be a number"),
        ({"column": ["torque_nm=Fz"]}, "column maps quantities to texts"),
        ({"column": {"torque_nm": 1}}, "column maps quantities to texts"),
        ({"condition": 3}, "condition is a name, or one for each path, not 3"),
        ({"settings": {"estimations": {}}}, "estimations is not a setting"),
        ({"settings": 3}, "settings are a Settings object, a TOML file or a mapping"),
    ],
)
def test_wrong_options_are_refused(tmp_path, options, told):
    with pytest.raises(UserError, match=told):
        read(write(tmp_path / "a.csv"), **options)


@pytest.mark.parametrize("paths", [None, 3, b"a.csv", [None]])
def test_what_is_no_path_is_refused(paths):
    with pytest.raises(UserError, match="what to read is a path or a list of paths, not"):
        read(paths)


def test_settings_of_a_mapping_are_used(tmp_path):
    settings = {"estimation": {"band_low_hz": 0.3}}
    assert read(write(tmp_path / "a.csv"), settings=settings).settings.estimation.band_low_hz == 0.3


def test_settings_are_those_given_or_of_the_first_session(session, tmp_path):
    file = write(tmp_path / "a.csv")
    settings_file = tmp_path / "s.toml"
    settings_file.write_text("[estimation]\nband_low_hz = 0.3\n")
    recorded = read([file, session])
    assert recorded.settings.protocol.blocks[0].condition == "DBS"
    assert [epoch.condition for epoch in recorded.epochs] == ["", "DBS"]
    given = read([file, session], settings=settings_file)
    assert given.settings.estimation.band_low_hz == 0.3
    assert read(file).settings == parse_settings({})


def test_digests_are_of_what_was_read(tmp_path):
    path = write(tmp_path / "a.csv")
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    recording = read(path)
    path.write_text("another file")
    assert recording.digests == {path: digest}
    assert provenance([path], recording.digests, recording.settings)[str(path)] == (
        f"SHA-256 {digest}"
    )


def test_a_time_of_which_some_is_infinite_is_refused_in_one_sentence(tmp_path: Path) -> None:
    time_s = np.arange(2000) / 100.0
    time_s[[5, 6]] = np.inf
    path = tmp_path / "r.npz"
    np.savez(path, time_s=time_s, torque_nm=np.zeros(2000), angle_rad=np.ones(2000))
    with pytest.raises(UserError, match="time_s"):
        read(path)
