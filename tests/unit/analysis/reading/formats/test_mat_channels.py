"""Channels of MATLAB structures: their clocks, and what is no channel."""

import numpy as np
import pytest
from tests.matlab_exports import (
    D,
    M,
    T,
    acqknowledge,
    by_hand,
    labchart,
    matrix,
    save,
    spike2,
    structures,
)

from rigidimeter.analysis.reading.formats import ReadOptions, read_table
from rigidimeter.core.errors import UserError


def table(path, values, **options):
    save(path, **values)
    return read_table(path, ReadOptions(**options))


def stamps(found, name):
    return found.columns["time_s"][np.isfinite(found.columns[name])]


def test_blocks_of_labchart_begin_when_they_were_recorded(tmp_path):
    found = table(tmp_path / "r.mat", labchart(blocks=2))
    torque_s = stamps(found, "Torque")
    np.testing.assert_allclose(torque_s[[0, 1999, 2000]], [0.0, 9.995, 40.0], atol=2e-5)
    np.testing.assert_allclose(np.diff(stamps(found, "Elbow angle"))[:9], 0.01, atol=1e-12)
    here = np.isfinite(found.columns["Torque"])
    np.testing.assert_array_equal(found.columns["Torque"][here], M)
    late = labchart()
    late["firstsampleoffset"] = np.array([[0.0], [3.0]])  # ticks of 5 ms
    assert stamps(table(tmp_path / "l.mat", late), "Elbow angle")[0] == pytest.approx(0.015)


def test_a_unit_that_changes_between_blocks_is_refused(tmp_path):
    values = labchart(blocks=2)
    values["unittextmap"] = np.array([[1, 2], [2, 2]])
    with pytest.raises(UserError, match="Torque is in Nm and in deg in different blocks"):
        table(tmp_path / "r.mat", values)


def test_the_times_of_a_channel_come_before_its_interval(tmp_path):
    values = spike2()
    values["elbow_Ch2"]["times"] = values["elbow_Ch2"]["times"] + 1.0
    assert stamps(table(tmp_path / "r.mat", values), "Angle")[0] == pytest.approx(1.25)
    values["elbow_Ch1"]["interval"] = 0.0
    with pytest.raises(UserError, match="export of Spike2 that cannot be read"):
        table(tmp_path / "r.mat", values)


def test_an_interval_in_another_unit(tmp_path):
    found = table(tmp_path / "r.mat", acqknowledge() | {"isi": 5000.0, "isi_units": "us"})
    np.testing.assert_allclose(found.columns["time_s"], T, atol=1e-9)
    assert found.units["Elbow torque"] == "N-m"


def test_columns_that_name_torque_and_motion_come_before_structures(tmp_path):
    values = {"torque_nm": M, "angle_deg": D, "fs": 200.0}
    found = table(tmp_path / "r.mat", {**values, "emg": {"data": M, "fs": 2000.0}})
    assert {"torque_nm", "angle_deg", "emg.data"} == set(found.columns)


def test_what_has_no_clock_is_said(tmp_path):
    found = table(tmp_path / "r.mat", {**by_hand(), "calibration": M[:9], "condition": "OFF"})
    assert found.others["calibration"] == "without a clock, beside channels that have one"
    assert found.scalars == {"condition": "OFF"}


def test_many_structures_without_samples_are_no_columns(tmp_path):
    events = structures(*({"kind": "a", "at": float(k)} for k in range(3000)))
    found = table(tmp_path / "r.mat", {"torque_nm": M, "angle_deg": D, "events": events})
    assert found.others["events"] == "an array of objects"


def two(torque, angle):
    """Return a structure for each channel, with these fields besides its own."""
    return {"torque": {"data": M, "unit": "Nm", **torque},
            "angle": {"data": D, "unit": "deg", **angle}}  # fmt: skip


@pytest.mark.parametrize(
    ("torque", "angle"),
    [
        ({"fs": 200.0, "time": T}, {"fs": 200.0, "time": T + 0.25}),
        ({"fs": 200.0, "t": 1e3 * T}, {"fs": 200.0, "t": 1e3 * (T + 0.25)}),
        ({"time_s": T}, {"t_ms": 1e3 * (T + 0.25)}),
        ({"fs": 200.0}, {"fs": 200.0, "time_s": T + 0.25}),
    ],
)
def test_the_times_of_a_structure_come_before_its_rate(tmp_path, torque, angle):
    found = table(tmp_path / "r.mat", two(torque, angle))
    assert found.units == {"time_s": "s", "torque": "Nm", "angle": "deg"}
    np.testing.assert_allclose(stamps(found, "torque"), T, atol=1e-9)
    np.testing.assert_allclose(stamps(found, "angle"), T + 0.25, atol=1e-9)


def test_times_that_the_rate_contradicts_are_no_clock(tmp_path):
    found = table(tmp_path / "r.mat", two({"fs": 100.0, "t": T}, {"fs": 100.0, "t": T}))
    assert {"torque.t", "angle.t"} < set(found.columns)


@pytest.mark.parametrize(
    ("values", "told"),
    [
        (two({"fs": 200.0}, {"fs": 200.0, "start": 0.25}),
         "angle has samples and a rate, but cannot be read (angle.start is 0.25, and no unit is"),
        (two({"fs": -5.0}, {"fs": 200.0}), "torque has samples and a rate, but cannot be read (a"),
        ({**acqknowledge(), "isi_units": 5.0}, "an export of AcqKnowledge that cannot be read (a"),
        ({**labchart(), "samplerate": np.ones((3, 1))},
         "LabChart that cannot be read (samplerate has 3 values for 2 channels)"),
    ],
)  # fmt: skip
def test_clocks_that_cannot_be_are_refused(tmp_path, values, told):
    with pytest.raises(UserError) as caught:
        table(tmp_path / "r.mat", values)
    assert told in str(caught.value)


def test_a_vector_beside_others_is_a_column(tmp_path):
    found = table(tmp_path / "r.mat", {"data": M, "angle_deg": D, "fs": 200.0, "units": "Nm"})
    assert set(found.columns) == {"angle_deg", "data"}
    assert found.scalars["fs"] == 200.0


def test_a_matrix_keeps_the_time_beside_it(tmp_path):
    found = table(tmp_path / "r.mat", matrix(t=T, condition="OFF"))
    assert set(found.columns) == {"t", "Torque", "Angle"}
    assert found.scalars["condition"] == "OFF"
    np.testing.assert_array_equal(found.columns["t"], T)


def test_structures_with_a_time_each_are_clocks(tmp_path):
    """The label of the first clock holds for the samples of the second; trials are no clocks."""
    trial = np.array(["1", "1", "", "2"])
    torque = {"time_s": np.arange(4.0), "Moment_Nm": np.ones(4), "epoch": trial}
    angle = {"t_ms": np.array([500.0, 1500.0, 3500.0]), "angle_deg": np.arange(3.0)}
    found = table(tmp_path / "r.mat", {"force": torque, "motion": angle})
    np.testing.assert_array_equal(stamps(found, "Moment_Nm"), [0, 1, 2, 3])
    np.testing.assert_array_equal(stamps(found, "angle_deg"), [0.5, 1.5, 3.5])
    assert [text.strip() for text in found.columns["epoch"]] == ["1", "1", "1", "1", "", "2", "2"]
    trials = table(tmp_path / "t.mat", {"one": torque, "two": torque})
    assert "two.Moment_Nm" in trials.columns
    assert "two.time_s" in trials.columns
