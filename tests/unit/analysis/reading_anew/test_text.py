"""Texts: what pandas may read as it is and what is taken apart give the same columns."""

from __future__ import annotations

import gzip
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from tests.known_joint import angle_rad, torque_nm

from rigidimeter.analysis.reading_anew import Columns, Mapping, columns_of, mapping_of, read_file
from rigidimeter.core.errors import UserError

T = np.arange(3000) / 200.0
M, D = torque_nm(T, 1), np.degrees(angle_rad(T, 1))
HEAD = "t [s];M [Nm];phi [deg]"


def rows(mark: str = ";", form: str = "%.9g", *columns: np.ndarray) -> str:
    table = zip(*(columns or (T, M, D)), strict=True)
    return "\n".join(mark.join(form % value for value in row) for row in table) + "\n"


def read(folder: Path, text: str | bytes, said: Mapping | None = None) -> Columns:
    path = folder / "r.txt"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return columns_of(path, said or Mapping())


def values(found: Columns) -> np.ndarray:
    return np.column_stack([column.read() for column in found.columns.values()])


PLAIN = f"{HEAD}\n{rows()}"
AGAIN: dict[str, Callable[[str], str | bytes]] = {
    # the same table, in a way that needs a closer look
    "a comment": lambda text: text + "# the end\n",
    "a comment among the rows": lambda text: text.replace("\n0.5;", "\n# stopped\n0.5;"),
    "blank lines": lambda text: text.replace("\n0.5;", "\n\n\n0.5;"),
    "Windows": lambda text: text.replace("\n", "\r\n"),
    "a mark of the byte order": lambda text: "\ufeff" + text,
    "UTF-16": lambda text: text.encode("utf-16"),
    "gzip": lambda text: gzip.compress(text.encode()),
    "quotes": lambda text: "\n".join(
        ";".join(f'"{cell}"' for cell in line.split(";")) for line in text.splitlines()
    ),
    "no end of the last line": lambda text: text.rstrip("\n"),
    "separators at the end": lambda text: HEAD + "\n" + rows().replace("\n", ";\n"),
    "a footer": lambda text: text + "End of data\nSaved by lab 3\n",
    "the minus sign of print": lambda text: HEAD + text.removeprefix(HEAD).replace("-", "\u2212"),
    "decimal commas": lambda text: text.replace(".", ","),
}


@pytest.mark.parametrize("how", AGAIN)
def test_the_same_table_gives_the_same_columns(tmp_path: Path, how: str) -> None:
    plain, again = read(tmp_path, PLAIN), read(tmp_path, AGAIN[how](PLAIN))
    assert list(again.columns) == list(plain.columns)
    path = tmp_path / "r.txt"
    ours = read_file(path).epochs[0].channels
    path.write_text(PLAIN, "utf-8")
    for name, channel in read_file(path).epochs[0].channels.items():
        assert np.array_equal(ours[name].values, channel.values)
        assert np.array_equal(ours[name].time_s, channel.time_s)


def test_fortran_writes_a_d(tmp_path: Path) -> None:
    text = f"{HEAD}\n{rows(';', '%.8e').replace('e', 'D')}"
    path = tmp_path / "r.csv"
    path.write_text(text, "utf-8")
    found = read_file(path).epochs[0].channels["torque_nm"].values
    assert np.allclose(found, M, atol=1e-8)


@pytest.mark.parametrize(
    ("before", "line"), [("", 1503), ("# one\n# two\n", 1505), ("Rate: 200 Hz;;\n\n", 1505)]
)
@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (lambda row: row + ";1", "has 4 values"),
        (lambda row: row.rpartition(";")[0], "has 2 values"),
        (lambda row: row.replace(row.split(";")[1], "7.5x"), "holds '7.5x', which is not a number"),
    ],
)
def test_a_row_that_is_wrong_is_named_by_its_line(
    tmp_path: Path, before: str, line: int, change: Callable[[str], str], sentence: str
) -> None:
    lines = rows().splitlines()
    lines[1501] = change(lines[1501])
    path = tmp_path / "r.csv"
    path.write_text(f"{before}{HEAD}\n" + "\n".join(lines) + "\n", "utf-8")
    try:
        said = "\n".join(notice.text for notice in read_file(path).notices)
    except UserError as error:
        said = str(error)
    assert f"line {line}" in said
    assert sentence in said


def test_one_cell_too_many_and_one_too_few_are_no_table(tmp_path: Path) -> None:
    lines = rows().splitlines()
    lines[7], lines[9] = lines[7] + ";1", lines[9].rpartition(";")[0]
    with pytest.raises(UserError, match="line 9 has 4 values"):
        read(tmp_path, f"{HEAD}\n" + "\n".join(lines) + "\n")


def test_cells_that_are_empty_are_no_fault(tmp_path: Path) -> None:
    lines = rows().splitlines()
    lines[7] = lines[7].rpartition(";")[0] + ";"
    found = read(tmp_path, f"{HEAD}\n" + "\n".join(lines) + "\n")
    assert np.flatnonzero(np.isnan(values(found)[:, 2])).tolist() == [7]


def test_labels_of_text_stay_as_they_are_written(tmp_path: Path) -> None:
    lines = [f"{row};{label}" for row, label in zip(
        rows().splitlines(), np.where(T > 10, "true", "'=1"), strict=True)]  # fmt: skip
    found = read(tmp_path, f"{HEAD};mode\n" + "\n".join(lines) + "\n")
    assert set(found.columns["mode"].read()) == {"true", "=1"}


@pytest.mark.parametrize(
    ("mark", "thousands", "decimal"), [(";", ".", ","), ("\t", ",", "."), (";", "'", ".")]
)
def test_marks_between_thousands(tmp_path: Path, mark: str, thousands: str, decimal: str) -> None:
    def cell(value: float) -> str:
        text = f"{value:,.2f}"
        return text.replace(",", "&").replace(".", decimal).replace("&", thousands)

    table = [mark.join(map(cell, row)) for row in zip(1e3 * T, 1e4 * M, 1e4 * D, strict=True)]
    found = read(tmp_path, mark.join(["t [ms]", "M", "phi"]) + "\n" + "\n".join(table) + "\n")
    assert np.allclose(values(found)[:, 0], 1e3 * T, atol=0.006)
    assert np.allclose(values(found)[:, 2], 1e4 * D, atol=0.006)


def test_lines_to_skip_and_names(tmp_path: Path) -> None:
    said = mapping_of(skip_rows=2, names=["t [s]", "M [Nm]", "phi [deg]"])
    found = read(tmp_path, "junk\n1;2\n" + rows(), said)
    assert list(found.columns) == ["t [s]", "M [Nm]", "phi [deg]"]
    assert found.where(0).endswith("line 3")


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        (b"", "is empty"),
        (b"\0\1\2" * 99, "not a text file"),
        (b"time\n1\n2\n", "fewer than two columns"),
        (b"t;M;phi\n", "has no samples"),
        (b"1;2;3\n4;5;6\n7;8;9\n", "must name the columns"),
        (b't;M\n1;"2\n3;4\n', "not a readable table"),
        (b"LabVIEW Measurement\t\nSeparator\tTab\n1\t2\n", "LabVIEW file is not complete"),
        (b"Interval=\t5 ms\nUnitName=\tNm\n0\t1\n1\t2\n", "LabChart file is not complete"),
    ],
)
def test_what_is_no_recording_is_refused(tmp_path: Path, text: bytes, sentence: str) -> None:
    with pytest.raises(UserError, match=sentence):
        read(tmp_path, text)
