"""A report takes what `compare` kept while it holds, and is the same as one made anew."""

import re
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from tests.small_study import TOML, record
from typer.testing import CliRunner

import rigidimeter as rm
from rigidimeter.cli.main import app
from rigidimeter.documents import replace_file

AGAIN = "the study is analysed again: "
KEPT = "analysis/kept.json"


@pytest.fixture(scope="module")
def of_both(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Make a study with fits and scores in both conditions, and keep its analysis."""
    folder = tmp_path_factory.mktemp("both") / "study"
    (folder / "sessions").mkdir(parents=True)
    rows = ["path,subject,day,condition"]
    repeating = {"duration_s": 8.0, "register_bits": 5}
    for condition in ("OFF", "DBS"):
        path = f"sessions/{condition}"
        record(folder / path, condition, seed=10 * len(rows), prbs=repeating)
        record(folder / f"{path}-sine", condition, seed=40 + len(rows), task="sinusoid")
        rows += [f"{path},M1,1,{condition}", f"{path}-sine,M1,1,{condition}"]
    (folder / "study.toml").write_text(TOML)
    (folder / "sessions.csv").write_text("\n".join(rows) + "\n")
    return folder


def files(folder: Path) -> dict[str, bytes]:
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file()
    }


def timeless(found: dict[str, bytes]) -> dict[str, bytes]:
    """Return files without the moment at which they were made."""
    moment = re.compile(rb"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\+00:00")
    return {name: moment.sub(b"", data) for name, data in found.items()}


@pytest.fixture
def no_analysis(monkeypatch: pytest.MonkeyPatch) -> Callable[[], None]:
    """Make every analysis fail from now on."""

    def forbidden(*_: object, **__: object) -> None:
        raise AssertionError("the study was analysed again")

    def forbid() -> None:
        monkeypatch.setattr("rigidimeter.cli.inputs.analyse_study_folder", forbidden)

    return forbid


@pytest.mark.usefixtures("no_figures")  # what a figure draws is compared as its CSV
def test_the_page_of_a_kept_result_is_that_of_a_new_one(
    of_both: Path, tmp_path: Path, rigidimeter, no_analysis
) -> None:
    folder = Path(shutil.copytree(of_both, tmp_path / "study"))
    compared = rigidimeter("compare", folder)
    kept = (folder / KEPT).read_bytes()
    (folder / KEPT).unlink()
    anew = rigidimeter("report", folder, "--out", tmp_path / "report")
    expected = files(tmp_path / "report")
    shutil.rmtree(tmp_path / "report")
    assert (folder / KEPT).read_bytes() == kept
    no_analysis()
    ran = rigidimeter("report", folder, "--out", tmp_path / "report")
    assert (ran.status, ran.out) == (anew.status, anew.out)
    warnings = [line for line in ran.err.splitlines() if line.startswith("warning")]
    assert warnings == [line for line in compared.err.splitlines() if line.startswith("warning")]
    found = files(tmp_path / "report")
    assert {"figures/impedance.csv", "figures/loops.csv", "figures/recorded.csv"} <= set(found)
    one, two = timeless(found), timeless(expected)
    assert [name for name in {**one, **two} if one.get(name) != two.get(name)] == []


@pytest.fixture(scope="module")
def kept_once(scored_study: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Make a study of scores whose analysis is kept; it is not to be changed."""
    folder = Path(shutil.copytree(scored_study, tmp_path_factory.mktemp("kept") / "study"))
    assert CliRunner().invoke(app, ["compare", str(folder)]).exit_code == 0
    assert (folder / KEPT).is_file()
    return folder


@pytest.fixture
def kept(kept_once: Path, tmp_path: Path, no_figures) -> Path:
    """Return a copy of it that a test may change."""
    return Path(shutil.copytree(kept_once, tmp_path / "study"))


def test_a_damaged_file_is_said_and_made_anew(kept: Path, tmp_path: Path, rigidimeter) -> None:
    before = (kept / KEPT).read_bytes()
    (kept / KEPT).write_bytes(before[:-1000])
    ran = rigidimeter("report", kept, "--out", tmp_path / "report")
    assert ran.status == 0
    assert f"{AGAIN}{KEPT} is damaged" in ran.err
    assert (kept / KEPT).read_bytes() == before


def test_options_are_part_of_it(kept: Path, tmp_path: Path, rigidimeter) -> None:
    rigidimeter("compare", kept, "--seed", "7", "--resamples", "100")
    ran = rigidimeter("report", kept, "--band-hz", "0.5", "9", "--out", tmp_path / "report")
    assert f"{AGAIN}--band-hz was null, and is [0.5, 9.0]" in ran.err
    ran = rigidimeter("report", kept, "--out", tmp_path / "report")
    assert f"{AGAIN}--band-hz was [0.5, 9.0], and is null" in ran.err


def test_a_study_that_cannot_be_written_still_gives_a_report(
    kept: Path, tmp_path: Path, rigidimeter, no_analysis, monkeypatch
) -> None:
    def read_only(path: Path, content: bytes) -> None:
        if path.is_relative_to(kept):
            raise OSError(30, "Read-only file system")
        replace_file(path, content)

    monkeypatch.setattr("rigidimeter.study.kept_result.replace_file", read_only)
    monkeypatch.setattr("rigidimeter.documents.writing.replace_file", read_only)
    ratings = kept / "ratings.csv"
    before = ratings.read_bytes()
    ratings.write_bytes(before.replace(b"M1,1,OFF,A,2.0", b"M1,1,OFF,A,2.5"))
    ran = rigidimeter("report", kept, "--out", tmp_path / "one")
    assert (tmp_path / "one/report.html").is_file()
    assert f"{AGAIN}ratings.csv has changed" in ran.err
    assert "the analysis is not kept" in ran.err
    ratings.write_bytes(before)
    no_analysis()
    assert rigidimeter("report", kept, "--out", tmp_path / "two").status == 0


def test_with_files_of_the_user_everything_is_computed(
    kept: Path, tmp_path: Path, rigidimeter
) -> None:
    (tmp_path / "added.py").write_text("")
    before = (kept / KEPT).read_bytes()
    ran = rigidimeter("--load", tmp_path / "added.py", "report", kept, "--out", tmp_path / "r")
    assert f"{AGAIN}files are loaded with --load" in ran.err
    assert (kept / KEPT).read_bytes() == before


def test_from_python_a_report_takes_the_kept_result_too(
    kept: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Anew(Exception):
        pass

    def analysed(folder: Path) -> None:
        raise Anew(folder)

    monkeypatch.setattr("rigidimeter.reporting.make_report.compare", analysed)
    page = rm.report(kept, tmp_path / "report").read_text(encoding="utf-8")
    table = (tmp_path / "report/tables/comparisons.csv").read_bytes()
    assert table == (kept / "analysis/comparisons.csv").read_bytes()
    assert "Data quality" in page
    (kept / "ratings.csv").write_bytes((kept / "ratings.csv").read_bytes() + b"M1,1,OFF,C,1.0\n")
    with pytest.raises(Anew):
        rm.report(kept, tmp_path / "report")
