"""Beside every table that is written stands what is in it: each column with unit and meaning."""

from __future__ import annotations

import csv
import re
import shutil
from pathlib import Path

import pytest
from typer.testing import CliRunner

from rigidimeter.cli.main import app
from rigidimeter.core.files import DICTIONARY, dictionary_text, is_dictionary, meaning_of
from rigidimeter.core.session import SAMPLE_UNITS
from rigidimeter.core.study_files import write_study_dictionary

RUN = CliRunner()


def _rows(path: Path) -> list[list[str]]:
    with path.open(encoding="utf-8", newline="") as file:
        return [row for row in csv.reader(file) if not row[:1] or not row[0].startswith("#")]


def _described(table: Path) -> dict[str, list[str]]:
    """Return unit and meaning of the columns of a table, by the dictionary beside it."""
    alone = table.with_name(f"{table.stem}.{DICTIONARY}")
    rows = _rows(alone if alone.exists() else table.with_name(DICTIONARY))
    assert rows[0] == ["file", "column", "unit", "meaning", "row"]
    return {row[1]: row[2:] for row in rows[1:] if row[0] == table.name}


def _tables(folder: Path) -> list[Path]:
    return [path for path in sorted(folder.rglob("*.csv")) if not is_dictionary(path)]


def _undescribed(tables: list[Path]) -> list[str]:
    """Return the columns that nobody described, and those with numbers whose unit is not known."""
    found = []
    for table in tables:
        header, *rows = _rows(table) or [[]]
        described = _described(table)
        for place, column in enumerate(header):
            unit, meaning, row = described.get(column, ["", "", ""])
            cells = {line[place] for line in rows if len(line) > place} - {""}
            numbers = cells and all(re.fullmatch(r"-?\d+\.\d+(e-?\d+)?", cell) for cell in cells)
            if not (meaning and row) or (numbers and not unit):
                found.append(f"{table.name}: {column}")
    return found


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory, fitted_study: Path) -> Path:
    """Return a folder in which every command wrote its tables."""
    place = tmp_path_factory.mktemp("written")
    study = shutil.copytree(fitted_study, place / "study")
    session = str(next(path for path in sorted((study / "sessions").iterdir())))
    for command in (
        ["report", str(study), "--out", str(place / "report")],
        ["compare", str(study / "analysis/estimates.json"), "--csv", str(place / "compared.csv")],
        ["estimate", session, "--csv", str(place / "epochs_fitted.csv"),
         "--subject-torque", str(place / "subject.csv")],
        ["batch", session, "--out", str(place / "batch.csv")],
        ["export", session, "--to", "csv", "--out", str(place / "exported")],
        ["design", "--out", str(place / "design")],
        ["study", "new", str(place / "new")],
    ):  # fmt: skip
        with pytest.MonkeyPatch.context() as patch:  # figures take most of the time
            patch.setattr("rigidimeter.analysis.report.page.svg_text", lambda *_: "<svg/>")
            result = RUN.invoke(app, command)
        assert result.exit_code == 0, (command, result.output)
    return place


def test_every_column_that_is_written_is_described(written: Path) -> None:
    tables = [path for path in _tables(written) if path.parent.parent.name != "sessions"]
    tables = [path for path in tables if path.parent != written / "study"]
    assert len(tables) > 50
    assert _undescribed(tables) == []


def test_a_dictionary_is_no_recording(written: Path, tmp_path: Path) -> None:
    """Also where a pattern finds it, or a shell names it."""
    archive = shutil.copytree(written / "exported", tmp_path / "archive")
    expanded = [str(path) for path in sorted(archive.glob("*.csv"))]
    assert any(is_dictionary(Path(name)) for name in expanded)
    for named in ([str(archive)], [str(archive / "*.csv")], expanded):
        out = tmp_path / f"{len(named)}{len(named[0])}.csv"
        result = RUN.invoke(app, ["batch", *named, "--out", str(out)])
        assert result.exit_code == 1, result.output  # tables without torque are errors
        inputs = {row[0] for row in _rows(out)[1:]}
        assert any(name.endswith("torque.csv") for name in inputs)
        assert not any(is_dictionary(Path(name)) for name in inputs)


@pytest.mark.parametrize("command", ["inspect", "estimate"])
def test_a_shell_that_names_a_dictionary_names_no_recording(written: Path, command: str) -> None:
    tables = [str(path) for path in (written / "exported").glob("[mt]o*.csv")]
    dictionary = str(written / "exported" / DICTIONARY)
    said = [RUN.invoke(app, [command, *tables, *more]).output for more in ([], [dictionary])]
    assert said[0] == said[1]
    assert len(tables) > 1


def test_a_dictionary_of_a_laboratory_is_kept(tmp_path: Path) -> None:
    """And ours names a table as the study does."""
    theirs = tmp_path / DICTIONARY
    theirs.write_text("variable;meaning\nk;stiffness\n", "utf-8")
    write_study_dictionary(tmp_path)
    assert theirs.read_text("utf-8").startswith("variable;")
    theirs.unlink()
    for named in ({}, {"ratings": "updrs.csv"}):
        write_study_dictionary(tmp_path, **named)
    files = {row[0]: row[4] for row in _rows(theirs)[1:]}
    assert "ratings.csv" not in files
    assert files["updrs.csv"] == "each rating"


def test_what_is_no_file_gets_no_dictionary(tmp_path: Path) -> None:
    table = tmp_path / "t.csv"
    table.write_text("name,condition,state\na,OFF,1\nb,DBS,2\n", "utf-8")
    result = RUN.invoke(app, ["compare", str(table), "--value", "state", "--csv", "/dev/null"])
    assert result.exit_code == 0, result.output
    assert not Path("/dev/null.data-dictionary.csv").exists()
    assert [path.name for path in tmp_path.iterdir()] == ["t.csv"]


@pytest.mark.parametrize(
    ("table", "column", "unit", "words"),
    [
        (
            "estimates",
            "fixed_inertia_stiffness_nm_rad_se",
            "N·m/rad",
            "standard error; with J held",
        ),
        ("conclusion", "difference_percent_low", "%", "difference_low in the same way"),
        ("conclusion", "level", "1", "significance level"),
        ("findings", "level", "", "note, caution or exclude"),
        ("comparisons", "days_mean_other", "(column unit)", "test by days: mean in the other"),
        ("emg", "emg_8_v", "V", "of muscle 8"),
        ("band_sensitivity", "inertia_kg_m2_p", "1", "probability of as large a change"),
    ],
)
def test_a_column_means_what_its_name_and_its_table_say(
    table: str, column: str, unit: str, words: str
) -> None:
    found = meaning_of(table, column)
    assert found.unit == unit
    assert words in found.meaning


def test_what_nobody_described_is_there_without_words() -> None:
    with pytest.raises(KeyError):
        meaning_of("estimates", "made_up")
    assert (
        dictionary_text({"estimates.csv": ["made_up"]})
        .splitlines()[1]
        .startswith("estimates.csv,made_up,,,")
    )


def test_every_recorded_column_is_described(written: Path) -> None:
    units = {}
    for table in _tables(written / "exported"):
        units |= {name: said[:2] for name, said in _described(table).items()}
    assert set(SAMPLE_UNITS) - {"torque_time_s", "motion_time_s"} <= set(units)
    assert units["torque_status"] == ["1", "status word of the torque sensor"]
    assert units["lateness_s"] == ["s", "behind the tick's deadline"]
