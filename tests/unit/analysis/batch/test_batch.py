"""Many recordings become one table: every epoch once, every failure a row with its reason."""

from __future__ import annotations

import errno
import math
import multiprocessing
import shutil
from multiprocessing.process import BaseProcess
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from tests.known_joint import TRUTH
from tests.unit.analysis.batch.conftest import write_recording

import rigidimeter as rm
from rigidimeter.analysis.batch import epoch_rows as rows
from rigidimeter.analysis.batch import epoch_table as table
from rigidimeter.analysis.batch import parts
from rigidimeter.core.errors import UserError

NUMBERS = ("inertia_kg_m2", "damping_nm_s_rad", "stiffness_nm_rad")


def test_rows_are_what_estimate_gives(archive: Path, tmp_path: Path) -> None:
    done = rm.batch(archive, tmp_path / "out.parquet")
    assert (done.inputs, done.epochs, done.before, done.failed) == (3, 6, 0, ())
    found = done.table()
    for path, own in found.groupby("input"):
        analysis = rm.estimate(rm.read(path))
        assert own["method"].tolist() == [analysis.method] * 2
        for row, fit in zip(own.to_dict("records"), analysis.rows(), strict=True):
            for name, value in fit.items():
                if isinstance(value, float) and math.isfinite(value):
                    assert row[name] == value, name
            assert row["sha256"] == rows.content_digest(Path(path))
    values = found[[*NUMBERS]].to_numpy()
    errors = found[[f"{name}_se" for name in NUMBERS]].to_numpy()
    assert np.all(np.abs(values - TRUTH) < 5 * errors)


@pytest.mark.parametrize("ending", ["parquet", "csv"])
def test_rows_have_what_the_emg_shows(archive: Path, tmp_path: Path, ending: str) -> None:
    """Of the one recording with EMG; the others have nothing there."""
    path = archive / "day-1" / "elbow.csv"
    head, *lines = path.read_text().splitlines()
    rng = np.random.default_rng(5)
    volts = 1e-5 * rng.standard_normal((len(lines), 2))
    volts[300:500] *= 20.0
    one_epoch = [line.removesuffix("2") + "1" * line.endswith("2") for line in lines]  # of 12 s
    with_emg = [f"{line},{one},{two}" for line, (one, two) in zip(one_epoch, volts, strict=True)]
    path.write_text("\n".join([f"{head},emg_v,emg_2_v", *with_emg]) + "\n")
    found = rm.batch(archive, tmp_path / f"out.{ending}").table()
    own, others = found[found["input"] == str(path)], found[found["input"] != str(path)]
    for row, fit in zip(own.to_dict("records"), rm.estimate(rm.read(path)).fits, strict=True):
        for name, value in fit.activity.row().items():
            assert row[name] == value or (not value and pd.isna(row[name])), name
    assert own["active_left_out_percent"].tolist()[0] > 8
    assert own["cocontraction_percent"].min() > 0
    assert "emg_2_v" in own["active_stretches"].tolist()[0]
    assert others["active_percent"].isna().all()


def test_two_processes_write_the_same_bytes(archive: Path, tmp_path: Path) -> None:
    """Though one of them is killed in the middle."""
    killed: list[BaseProcess] = []

    def progress(share: float) -> None:
        if not killed:
            killed.append(multiprocessing.active_children()[0])
            killed[0].kill()

    one = rm.batch(archive, tmp_path / "one.parquet")
    two = rm.batch(archive, tmp_path / "two.parquet", jobs=2, progress=progress)
    assert two.path.read_bytes() == one.path.read_bytes()


def test_csv_holds_the_same_numbers(archive: Path, tmp_path: Path) -> None:
    parquet = rm.batch(archive, tmp_path / "out.parquet").table()
    csv = rm.batch(archive, tmp_path / "out.csv").table()
    assert csv.equals(parquet)


def test_each_failure_is_a_row_with_the_sentence_of_the_command_line(
    archive: Path, tmp_path: Path, rigidimeter
) -> None:
    (archive / "day-1" / "elbow.csv").write_text("nonsense\n")
    (archive / "empty.csv").write_text("")
    (archive / "broken.npz").write_bytes(b"PK\3\4 and nothing else")
    absent = archive / "absent.csv"
    done = rm.batch([archive, absent], tmp_path / "out.parquet")
    found = done.table()
    failed = found[found["outcome"] == "failed"]
    assert (done.inputs, done.epochs, len(failed)) == (6, 4, 4)
    assert tuple(failed["reason"]) == done.failed
    for path, reason in zip(failed["input"], failed["reason"], strict=True):
        said = rigidimeter("estimate", path).err
        assert said == "\n".join(f"rigidimeter: {line}" for line in [reason]) + "\n"


def test_any_error_of_the_estimator_is_a_row(archive: Path, tmp_path: Path, monkeypatch) -> None:
    def estimate(epochs, *_, **__):
        raise ZeroDivisionError("a bug")

    monkeypatch.setattr(rows, "estimate", estimate)
    done = rm.batch(archive, tmp_path / "out.parquet")
    assert [reason.rpartition(": ")[0].rpartition(" ")[2] for reason in done.failed] == [
        "ZeroDivisionError"
    ] * 3


def test_a_file_that_changes_while_it_is_read_is_a_row(
    archive: Path, tmp_path: Path, monkeypatch
) -> None:
    original = rows.read_as

    def changing(named, *rest):
        read = original(named, *rest)
        (path,) = named
        if path.parent.name == "day-1":
            with path.open("a") as file:
                file.write("12.0,0,0,2\n")
        return read

    monkeypatch.setattr(rows, "read_as", changing)
    done = rm.batch(archive, tmp_path / "out.parquet")
    assert done.epochs == 4
    (reason,) = done.failed
    assert "day-1/elbow.csv: was changed while it was read" in reason
    monkeypatch.undo()
    assert rm.batch(archive, tmp_path / "out.parquet").failed == ()


def test_a_full_disk_loses_nothing(archive: Path, tmp_path: Path, monkeypatch) -> None:
    def full(path, content):
        raise OSError(errno.ENOSPC, "No space left on device")

    plain = rm.batch(archive, tmp_path / "plain.parquet")
    monkeypatch.setattr(parts, "replace_file", full)
    assert rm.batch(archive, tmp_path / "out.parquet").table().equals(plain.table())


def test_a_disk_that_is_full_at_the_end_keeps_what_is_done(
    archive: Path, tmp_path: Path, monkeypatch, estimated: list[Path]
) -> None:
    def full(path, chunks):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(table, "_write_parquet", full)
    with pytest.raises(
        UserError,
        match=r"No space left on device.*; give the command again, which goes on from .*parts$",
    ):
        rm.batch(archive, tmp_path / "out.parquet")
    assert len(estimated) == 3
    monkeypatch.undo()
    assert rm.batch(archive, tmp_path / "out.parquet").before == 3
    assert not (tmp_path / "out.parquet.parts").exists()


def test_a_study_is_its_sessions(fitted_study: Path, tmp_path: Path) -> None:
    study = Path(shutil.copytree(fitted_study, tmp_path / "study"))
    (study / "exclusions.csv").write_text("path,epoch,reason\nsessions/2-DBS,1,cough\n")
    found = rm.batch(study, tmp_path / "out.parquet", method="bandlimited").table()
    assert len(found) == 12
    assert set(found["condition"]) == {"OFF", "DBS"}
    assert sorted(set(found["day"])) == ["1", "2", "3", "4"]
    (out,) = found[found["outcome"] == "excluded"].to_dict("records")
    assert (out["input"], out["epoch"]) == (str(study / "sessions/2-DBS"), "1")
    assert out["reason"] == "cough"


def test_inputs_are_found_once(archive: Path, tmp_path: Path) -> None:
    pattern = f"{archive}/**/*.csv"
    done = rm.batch([pattern, archive, archive / "day-0" / "elbow.csv"], archive / "out.parquet")
    assert (done.inputs, done.epochs) == (3, 6)
    assert rm.batch(archive, archive / "out.parquet").inputs == 3  # the table is no input
    done = rm.batch(f"{archive}/*.tdms", tmp_path / "none.csv")
    assert done.failed == (f"{archive}/*.tdms: there is no such file",)


def test_scores_are_rows_too(tmp_path: Path) -> None:
    path = write_recording(tmp_path / "swing.csv", 1)
    found = rm.batch(path, tmp_path / "out.parquet", task="sinusoid").table()
    scores = rm.estimate(rm.read(path, task="sinusoid")).scores
    assert found["task"].tolist() == ["sinusoid"] * 2
    assert found["epoch"].tolist() == [score.epoch for score in scores]


def test_wrong_arguments_are_refused(archive: Path, tmp_path: Path, rigidimeter) -> None:
    with pytest.raises(UserError, match=r"must end in \.parquet or \.csv"):
        rm.batch(archive, tmp_path / "out.txt")
    with pytest.raises(UserError, match="method nonsense"):
        rm.batch(archive, tmp_path / "out.csv", method="nonsense")
    mine = tmp_path / "mine.csv"
    mine.write_text("a,b\n1,2\n")
    with pytest.raises(UserError, match="is not the table of a batch"):
        rm.batch(archive, mine)
    assert mine.read_text() == "a,b\n1,2\n"
    ran = rigidimeter("batch", archive, "--out", tmp_path / "o.csv", "--join")
    assert "--join: is for single recordings" in ran.err


def test_the_command_says_what_failed(archive: Path, tmp_path: Path, rigidimeter) -> None:
    (archive / "empty.csv").write_text("")
    ran = rigidimeter("batch", archive, "--out", tmp_path / "out.csv")
    assert ran.err == f"error: {archive}/empty.csv is empty; a recording in a .csv file was " \
        "expected\n"  # fmt: skip
    assert ran.out == f"{tmp_path}/out.csv: 6 epochs of 4 inputs\n"
