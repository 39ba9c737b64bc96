"""XDF: what pyxdf reads is what was recorded."""

from __future__ import annotations

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.unit.exporting.conftest import with_jitter

from rigidimeter.errors import UserError
from rigidimeter.exporting import export_sessions, sessions_of_recording
from rigidimeter.recording import read
from rigidimeter.recording.exported_session import ExportedSession

pyxdf = pytest.importorskip("pyxdf", reason="pip install 'rigidimeter[dev]'")


def loaded(session: ExportedSession, path: Path) -> dict[str, dict[str, Any]]:
    """Return the streams of an export by name, as pyxdf reads them by default."""
    export_sessions([session], "xdf", path)
    streams, _ = pyxdf.load_xdf(path)
    return {stream["info"]["name"][0].removeprefix("rigidimeter "): stream for stream in streams}


@pytest.mark.parametrize("even", [True, False])
def test_samples_and_stamps(exported: ExportedSession, tmp_path: Path, even: bool) -> None:
    """Stamps that jitter stay as they are; even ones are straightened to themselves."""
    session = exported if even else with_jitter(exported)
    found = loaded(session, tmp_path / "session.xdf")
    for stream in session.streams:
        one = found[stream.name]
        atol = 1e-9 if even else 0.0
        np.testing.assert_allclose(one["time_stamps"], stream.time_s, rtol=0, atol=atol)
        for k, values in enumerate(stream.columns.values()):
            np.testing.assert_array_equal(one["time_series"][:, k], values.astype(float))
        nominal = float(one["info"]["nominal_srate"][0])
        assert nominal == pytest.approx(stream.rate_hz if even else 0.0)


def test_labels_and_units(exported: ExportedSession, tmp_path: Path) -> None:
    found = loaded(exported, tmp_path / "session.xdf")
    channels = found["motion"]["info"]["desc"][0]["channels"][0]["channel"]
    named = [(channel["label"][0], channel["unit"][0]) for channel in channels]
    assert named[:2] == [("angle_rad", "rad"), ("velocity_rad_s", "rad/s")]
    assert "simulated" in found["motion"]["info"]["manufacturer"][0]


def test_markers_and_the_document(exported: ExportedSession, tmp_path: Path) -> None:
    found = loaded(exported, tmp_path / "session.xdf")
    markers = found["markers"]
    assert [text for (text,) in markers["time_series"]] == [
        "session_start",
        "epoch_start/1/prbs/OFF",
        "epoch_end/1/success",
        "epoch_start/2/prbs/OFF",
        "epoch_end/2/success",
        "session_end/success",
    ]
    events = exported.about["recorded"]["events"]
    assert markers["time_stamps"].tolist() == [event["time_s"] for event in events]
    ((document,),) = found["document"]["time_series"]
    assert json.loads(document) == exported.about


def test_a_recording_without_events_marks_its_epochs(tmp_path: Path) -> None:
    path = tmp_path / "joint.csv"
    rows = [f"{k / 100},{np.cos(k / 9):.5f},{np.sin(k / 9):.5f},{1 + k // 200}" for k in range(400)]
    path.write_text("\n".join(["time_s,torque_nm,angle_rad,epoch", *rows]) + "\n")
    (session,) = sessions_of_recording(read(path), None)
    found = loaded(session, tmp_path / "joint.xdf")
    assert [text for (text,) in found["markers"]["time_series"]] == [
        "epoch_start/1//",
        "epoch_end/1/included",
        "epoch_start/2//",
        "epoch_end/2/included",
    ]


def test_an_export_that_breaks_off_is_refused(exported: ExportedSession, tmp_path: Path) -> None:
    path = tmp_path / "session.xdf"
    export_sessions([exported], "xdf", path)
    whole = path.read_bytes()
    path.write_bytes(whole[: len(whole) // 2])
    with pytest.raises(UserError, match="whose end is missing"):
        read(path)


def test_a_count_that_no_chunk_can_hold_is_refused(
    exported: ExportedSession, tmp_path: Path
) -> None:
    """Before anybody makes room for it."""
    path = tmp_path / "session.xdf"
    export_sessions([exported], "xdf", path)
    data = bytearray(path.read_bytes())
    count = struct.pack("<BI", 4, 3251)
    at = data.index(count)
    data[at + 1 : at + 5] = b"\xff\xff\xff\x7f"
    path.write_bytes(data)
    with pytest.raises(UserError, match="says that it holds 2147483647 samples"):
        read(path)


def test_a_length_that_leads_beyond_the_file_is_refused(
    exported: ExportedSession, tmp_path: Path
) -> None:
    path = tmp_path / "session.xdf"
    export_sessions([exported], "xdf", path)
    data = bytearray(path.read_bytes())
    data[4 + 1 + 4] = 1  # of the file header
    path.write_bytes(data)
    with pytest.raises(UserError, match="damaged length"):
        read(path)
