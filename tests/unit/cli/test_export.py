"""`rigidimeter export`: what is written where, and what is refused."""

from __future__ import annotations

from pathlib import Path

import pytest
from tests.small_study import record

from rigidimeter.analysis.export import FORMATS, Format


@pytest.fixture(scope="module")
def session(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return record(tmp_path_factory.mktemp("sessions") / "session", "OFF", 1, epochs=1)


def test_one_session_is_one_file(rigidimeter, session: Path, tmp_path: Path) -> None:
    ran = rigidimeter("export", session, "--to", "mat", "--out", tmp_path / "s.mat")
    assert ran.status == 0
    assert "1 file" in ran.out
    assert [each.name for each in tmp_path.iterdir()] == ["s.mat"]


def test_a_study_is_a_folder_of_files(rigidimeter, scored_study: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    ran = rigidimeter("export", scored_study, "--to", "mat", "--out", out)
    assert ran.status == 0
    names = sorted(each.name for each in out.iterdir())
    assert names[:2] == ["sub-M1_ses-1_acq-OFF.mat", "sub-M1_ses-2_acq-DBS.mat"]
    assert len(names) == 6


def test_nothing_is_overwritten_unless_asked(rigidimeter, session: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    out.mkdir()
    (out / "notes.txt").write_text("mine")
    (out / "session.json").write_text("old")
    arguments = ("export", session, "--no-estimates", "--to", "csv", "--out", out)
    ran = rigidimeter(*arguments)
    assert ran.status == 1
    assert "is not empty; name another, or say --overwrite" in ran.err
    assert (out / "session.json").read_text() == "old"
    assert rigidimeter(*arguments, "--overwrite").status == 0
    assert (out / "session.json").read_text() != "old"
    assert (out / "notes.txt").read_text() == "mine"


@pytest.mark.parametrize(
    ("to", "out", "said"),
    [
        ("xlsx", "a.xlsx", "--to xlsx: there is no such format; known: nwb, "),
        ("mat", "a.txt", "must end in .mat"),
        ("csv", "session/inside", "lies in a session folder"),
        ("mat", "file.mat", "exists already; name another, or say --overwrite"),
        ("csv", "file.mat", "is a file; name a new folder"),
        ("csv", "file.mat/inside", "cannot be written"),
    ],
)
def test_what_is_refused(
    rigidimeter, session: Path, tmp_path: Path, to: str, out: str, said: str
) -> None:
    (tmp_path / "file.mat").write_text("old")
    place = session.parent / out if out.startswith("session") else tmp_path / out
    ran = rigidimeter("export", session, "--no-estimates", "--to", to, "--out", place)
    assert ran.status == 1
    assert said in ran.err
    assert len(ran.err.splitlines()) == 1
    assert sorted(each.name for each in tmp_path.iterdir()) == ["file.mat"]


def test_a_missing_library_is_named_with_its_command(
    rigidimeter, session: Path, tmp_path: Path, monkeypatch
) -> None:
    def write(_session, _path):
        raise ImportError("no module named other")

    monkeypatch.setattr(
        "rigidimeter.analysis.export.formats.FORMATS",
        [*FORMATS, Format("other", "other", write, ".oth", extra="other")],
    )
    out = tmp_path / "a.oth"
    ran = rigidimeter("export", session, "--no-estimates", "--to", "other", "--out", out)
    assert ran.status == 1
    assert "needs one more package: pip install 'rigidimeter[other]'" in ran.err


def test_two_subjects_do_not_become_one(rigidimeter, scored_study: Path, tmp_path: Path) -> None:
    import shutil

    study = Path(shutil.copytree(scored_study, tmp_path / "study"))
    table = (study / "sessions.csv").read_text()
    (study / "sessions.csv").write_text(table.replace(",M1,1", ",M-1,1"))
    ran = rigidimeter("export", study, "--no-estimates", "--to", "mat", "--out", tmp_path / "o")
    assert ran.status == 1
    assert "would both be sub-M1" in ran.err


def test_options_of_single_recordings_are_not_for_a_study(
    rigidimeter, scored_study: Path, tmp_path: Path
) -> None:
    out = tmp_path / "o"
    ran = rigidimeter("export", scored_study, "--to", "mat", "--out", out, "--subject", "X")
    assert ran.status == 1
    assert "--subject X: is for single recordings" in ran.err
