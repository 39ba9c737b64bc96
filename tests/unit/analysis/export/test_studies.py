"""Exports in a study folder count as the sessions that they were made of."""

import shutil
from pathlib import Path

import pytest

from rigidimeter.analysis.export import export_sessions, sessions_of_recording
from rigidimeter.analysis.reading import read
from rigidimeter.analysis.study import load_study


def test_exports_are_the_sessions_that_they_were_made_of(study: Path) -> None:
    pytest.importorskip("pynwb")
    before = load_study(study)
    table = (study / "sessions.csv").read_text()
    formats = {"bids": "", "mat": ".mat", "nwb": ".nwb"}
    for (to, suffix), session in zip(formats.items(), before.recordings.sessions, strict=False):
        path = study / session.row["path"]
        exported = path.with_name(f"{path.name}-{to}{suffix}")
        export_sessions(sessions_of_recording(read(path), None), to, exported)
        shutil.rmtree(path)
        table = table.replace(session.row["path"], str(exported.relative_to(study)))
    (study / "sessions.csv").write_text(table)
    after = load_study(study)
    assert [n.text for n in after.notices] == [n.text for n in before.notices]
    for one, other in zip(after.epochs, before.epochs, strict=True):
        assert (one.condition, one.task, one.label) == (
            other.condition,
            other.task,
            other.label,
        )
        for name, channel in other.channels.items():
            assert len(one.channels[name]) == pytest.approx(len(channel), abs=3)


def test_a_copy_of_a_folder_under_another_name_is_found(study: Path, edit) -> None:
    rows = (study / "sessions.csv").read_text().splitlines()[1:3]
    for row, new, subject in zip(rows, ("one", "two"), ("S1", "S2"), strict=True):
        path = study / row.split(",")[0]
        first = read(study / rows[0].split(",")[0])
        exported = sessions_of_recording(first, None, subject=subject)
        export_sessions(exported, "bids", path.with_name(new))
        edit(study / "sessions.csv", str(path.relative_to(study)), f"sessions/{new}")
    (out,) = load_study(study).recordings.left_out
    assert "sessions/two holds the same samples as sessions/one" in out.reason
