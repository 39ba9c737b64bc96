"""A measured ankle (REKLAB, McGill), read as archive, text and MATLAB file."""

import numpy as np
import pytest
import scipy.io

from rigidimeter.analysis.reading.formats.read_options import ReadOptions
from rigidimeter.analysis.reading.formats.readers import read_recording

OPTIONS = ReadOptions(
    columns={"angle_rad": "position_rad", "torque_nm": "torque_Nm"},
    reaction=True,
    epoch_length_s=20.0,
)


@pytest.fixture
def ankle(shared_data):
    path = shared_data / "ankle" / "z_df.npz"
    with np.load(path) as archive:
        return path, {name: archive[name] for name in archive.files}


def assert_same_channels(epochs, reference):
    assert [epoch.label for epoch in epochs] == [epoch.label for epoch in reference]
    for epoch, expected in zip(epochs, reference, strict=True):
        assert set(epoch.channels) == set(expected.channels)
        for name, channel in epoch.channels.items():
            np.testing.assert_array_equal(channel.time_s, expected.channels[name].time_s)
            np.testing.assert_array_equal(channel.values, expected.channels[name].values)


def test_three_epochs_of_20_s(ankle):
    path, arrays = ankle
    epochs, notices = read_recording(path, OPTIONS)
    assert notices == []
    assert [epoch.label for epoch in epochs] == ["1", "2", "3"]
    torque = np.concatenate([epoch.channels["torque_nm"].values for epoch in epochs])
    angle = np.concatenate([epoch.channels["angle_rad"].values for epoch in epochs])
    np.testing.assert_array_equal(torque, -arrays["torque_Nm"])
    np.testing.assert_array_equal(angle, arrays["position_rad"])
    assert {len(channel) for epoch in epochs for channel in epoch.channels.values()} == {20_000}
    assert epochs[2].channels["angle_rad"].time_s[0] == 40.0


@pytest.mark.parametrize("compress", [False, True])
def test_the_same_as_a_matlab_file(ankle, tmp_path, compress):
    path, arrays = ankle
    scipy.io.savemat(tmp_path / "ankle.mat", arrays, do_compression=compress)
    epochs, notices = read_recording(tmp_path / "ankle.mat", OPTIONS)
    assert notices == []
    assert_same_channels(epochs, read_recording(path, OPTIONS)[0])


def test_the_same_as_a_text_file(ankle, tmp_path):
    path, arrays = ankle
    n = arrays["torque_Nm"].size
    time_s = np.arange(n) / float(arrays["fs_hz"])
    columns = (time_s, arrays["position_rad"], arrays["torque_Nm"])
    rows = zip(*(values.tolist() for values in columns), strict=True)
    text = "time_s,position_rad,torque_Nm\n" + "".join(f"{t!r},{a!r},{m!r}\n" for t, a, m in rows)
    (tmp_path / "ankle.csv").write_text(text)
    epochs, notices = read_recording(tmp_path / "ankle.csv", OPTIONS)
    assert notices == []
    assert_same_channels(epochs, read_recording(path, OPTIONS)[0])


def test_a_real_text_file_without_time(shared_data):
    options = ReadOptions(columns={"torque_nm": "V1", "angle_rad": "V2"}, rate_hz=610.3516)
    (epoch,), _ = read_recording(shared_data / "silverbox" / "SNLS80mV.csv", options)
    assert len(epoch.channels["torque_nm"]) > 100_000


def test_a_real_matlab_file(shared_data):
    options = ReadOptions(columns={"time_s": "t", "torque_nm": "vir", "angle_rad": "qm"})
    (epoch,), _ = read_recording(shared_data / "emps" / "DATA_EMPS.mat", options)
    assert len(epoch.channels["torque_nm"]) == 24_841
    assert epoch.channels["torque_nm"].rate_hz == pytest.approx(1000.0, rel=1e-4)
