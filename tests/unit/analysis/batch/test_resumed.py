"""Nothing is estimated twice: a batch that was killed goes on where it was."""

from __future__ import annotations

import shutil
import subprocess
import sys
from functools import partial
from pathlib import Path

import pytest
from tests.unit.analysis.batch.conftest import write_recording

import rigidimeter as rm
from rigidimeter.analysis.batch import Parts
from rigidimeter.analysis.batch import archive_run as run
from rigidimeter.analysis.batch import epoch_rows as rows
from rigidimeter.cli.progress import Meter
from rigidimeter.core.errors import UserError

KILLED = """
import os, signal, sys
import rigidimeter as rm
done = []
def progress(share):
    done.append(share)
    if len(done) == 2:
        os.kill(os.getpid(), signal.SIGKILL)
rm.batch(sys.argv[1], sys.argv[2], progress=progress)
"""


def test_a_killed_batch_goes_on_where_it_was(
    archive: Path, tmp_path: Path, estimated: list[Path]
) -> None:
    out = tmp_path / "out.parquet"
    ran = subprocess.run([sys.executable, "-c", KILLED, archive, out], check=False)
    assert ran.returncode == -9
    assert not out.exists()
    shares: list[float] = []
    done = rm.batch(archive, out, progress=shares.append)
    assert (done.before, done.epochs) == (2, 6)
    assert shares == [1.0]
    assert estimated == [archive / "day-2" / "elbow.csv"]
    rm.batch(archive, tmp_path / "whole.parquet")
    assert out.read_bytes() == (tmp_path / "whole.parquet").read_bytes()


@pytest.mark.parametrize("ending", ["parquet", "csv"])
def test_what_is_in_the_table_is_not_estimated_again(
    archive: Path, tmp_path: Path, estimated: list[Path], ending: str
) -> None:
    out = tmp_path / f"out.{ending}"
    rm.batch(archive, out)
    first = out.read_bytes()
    estimated.clear()
    assert rm.batch(archive, out).before == 3
    assert estimated == []
    assert out.read_bytes() == first
    write_recording(archive / "new.csv", 9)
    assert rm.batch(archive, out).epochs == 8
    assert estimated == [archive / "new.csv"]
    assert out.read_bytes().startswith(first[:4])


def test_other_content_settings_or_version_are_estimated_again(
    archive: Path, tmp_path: Path, estimated: list[Path], monkeypatch
) -> None:
    out = tmp_path / "out.parquet"
    rm.batch(archive, out)
    for change in ({"method": "bandlimited"}, {"changes": {"estimation": {"band_low_hz": 0.3}}}):
        estimated.clear()
        assert rm.batch(archive, out, **change).before == 0
        assert len(estimated) == 3
    estimated.clear()
    write_recording(archive / "day-1" / "elbow.csv", 9)
    rm.batch(archive, out, **change)
    assert estimated == [archive / "day-1" / "elbow.csv"]


def test_another_version_estimates_again_what_one_left_behind(
    archive: Path, tmp_path: Path, estimated: list[Path], monkeypatch
) -> None:
    def killed(path, rows):
        raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr(run, "write_table", killed)
        with pytest.raises(KeyboardInterrupt):
            rm.batch(archive, tmp_path / "out.parquet")
    for module in (run, rows):
        monkeypatch.setattr(module, "__version__", "0.2.0")
    monkeypatch.setattr(run, "How", partial(rows.How, version="0.2.0"))
    estimated.clear()
    for before in (0, 3):
        assert rm.batch(archive, tmp_path / "out.parquet").before == before
        assert len(estimated) == 3


@pytest.fixture(params=["in turn", "at once"])
def taken(request, monkeypatch) -> None:
    """Take inputs one by one, or all before the first is done, as many processes do."""

    def at_once(function, items, **_):
        yield from [(item, function(item)) for item in [*items]]

    if request.param == "at once":
        monkeypatch.setattr(run, "each", at_once)


@pytest.mark.usefixtures("taken")
def test_a_copy_is_estimated_once_and_has_its_rows(
    archive: Path, tmp_path: Path, estimated: list[Path]
) -> None:
    shutil.copy(archive / "day-0" / "elbow.csv", archive / "copy.csv")
    found = rm.batch(archive, tmp_path / "out.parquet").table()
    assert len(estimated) == 3
    own = [found[found["input"] == str(archive / name)] for name in ("copy.csv", "day-0/elbow.csv")]
    assert (
        own[0]
        .drop(columns="input")
        .reset_index(drop=True)
        .equals(own[1].drop(columns="input").reset_index(drop=True))
    )


@pytest.mark.usefixtures("taken")
def test_what_failed_is_tried_again(archive: Path, tmp_path: Path, estimated: list[Path]) -> None:
    (archive / "bad.csv").write_text("nonsense\n")
    shutil.copy(archive / "bad.csv", archive / "worse.csv")
    out = tmp_path / "out.parquet"
    done = rm.batch(archive, out)
    assert [reason.split(":")[0] for reason in done.failed] == [
        str(archive / "bad.csv"), str(archive / "worse.csv"),
    ]  # fmt: skip
    estimated.clear()
    rm.batch(archive, out)
    assert sorted(estimated) == [archive / "bad.csv", archive / "worse.csv"]


def test_one_batch_at_a_time_writes_an_output(archive: Path, tmp_path: Path) -> None:
    with Parts(tmp_path / "out.csv.parts"), pytest.raises(UserError, match="another batch"):
        rm.batch(archive, tmp_path / "out.csv")


def test_time_left_is_right_within_three_of_inputs_of_all_sizes(
    archive: Path, tmp_path: Path, monkeypatch
) -> None:
    """With a clock that goes on by the real cost of an input: a base, and so much an epoch."""
    for index, epochs in enumerate([8, 1, 3, 1, 12, 2]):
        write_recording(archive / f"{index}.csv", index, epochs)
    now_s, left_s = [0.0], []
    meter = Meter("batch", 1.0, clock=lambda: now_s[0], from_first=True)

    def answer(one, digest, how):
        now_s[0] += 0.05 + 0.04 * round(one.path.stat().st_size / 72_000)
        return [{"epoch": "1", "outcome": "included"}]

    def progress(share: float) -> None:
        meter.reach(share)
        left_s.append((now_s[0], meter.left_s))

    monkeypatch.setattr(run, "answer", answer)
    rm.batch(archive, tmp_path / "out.csv", progress=progress)
    told = [(at_s, left) for at_s, left in left_s[:-1] if left is not None]
    assert len(told) >= 5
    for at_s, left in told:
        assert 1 / 3 < left / (now_s[0] - at_s) < 3
