"""Text, JSON, CSV and TOML: full precision, nothing half written, and refusals in a sentence."""

import csv
import hashlib
import io
import json
import math
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rigidimeter.core.errors import UserError
from rigidimeter.core.files import (
    csv_text,
    json_line,
    json_text,
    noted_digests,
    parse_toml,
    read_bytes,
    read_json,
    read_text_table,
    read_toml,
    replace_file,
    toml_text,
    write_json,
    write_text,
)


@given(values=st.lists(st.floats(allow_nan=False, allow_infinity=False)))
def test_floats_survive_json_and_csv_to_the_bit(values):
    assert json.loads(json_text(values)) == values
    text = csv_text(["a", "b"], [(value, np.float64(value)) for value in values])
    rows = list(csv.reader(io.StringIO(text)))
    assert rows[0] == ["a", "b"]
    assert [tuple(map(float, row)) for row in rows[1:]] == [(v, v) for v in values]


def test_json_has_null_for_what_is_not_finite():
    document = {"a": math.nan, "b": (np.float64(np.inf), np.int64(3)), 4: "ä"}
    assert json.loads(json_text(document)) == {"a": None, "b": [None, 3], "4": "ä"}
    with pytest.raises(ValueError, match="not JSON compliant"):
        json_line({"torque_nm": math.nan})


def test_csv_leaves_cells_empty_and_quotes_what_needs_it():
    rows = [{"a": 1, "b": 'say "x", y'}, {"a": None, "c": True}, {"a": math.nan, "b": "z\nz"}]
    assert csv_text(["a", "b", "c"], rows) == (
        'a,b,c\n1,"say ""x"", y",\n,,True\n,"z\nz",\n'
    )  # fmt: skip
    assert csv_text(["a", "b"], []) == "a,b\n"


def test_an_older_file_survives_a_failed_write(tmp_path, monkeypatch):
    path = tmp_path / "a.json"
    write_json(path, {"old": 1})

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("pathlib.Path.write_bytes", full)
    with pytest.raises(UserError, match=r"a\.json: cannot be written \(No space left on device\)"):
        write_json(path, {"new": 2})
    with pytest.raises(OSError, match="No space"):
        replace_file(path, b"")
    assert read_json(path) == {"old": 1}
    assert [file.name for file in tmp_path.iterdir()] == ["a.json"]


def test_a_folder_is_not_written_over(tmp_path):
    with pytest.raises(UserError, match="cannot be written"):
        write_text(tmp_path, "x")


@given(st.dictionaries(st.text(), st.text() | st.floats(allow_nan=False), max_size=3))
def test_any_name_and_text_is_read_back_from_toml(values):
    written = toml_text({"a": values, "none": None})
    assert parse_toml(written.encode(), "x.toml") == {"a": values}


def test_what_cannot_be_read_is_a_sentence(tmp_path):
    bad = tmp_path / "bad"
    for data, json_told, toml_told in [
        (b"{", "is not valid JSON", "is not valid TOML"),
        (b"\xff", "is not valid JSON", "is not a text file in UTF-8"),
    ]:
        bad.write_bytes(data)
        with pytest.raises(UserError, match=json_told):
            read_json(bad)
        with pytest.raises(UserError, match=toml_told):
            read_toml(bad)
    for read in (read_json, read_toml):
        with pytest.raises(UserError, match="cannot be read"):
            read(tmp_path / "none")


def test_a_digest_is_of_what_was_read(tmp_path):
    path = tmp_path / "t.csv"
    path.write_bytes(b"old")
    with noted_digests() as noted:
        assert read_bytes(path, 10) == b"old"
        path.write_bytes(b"new")
    assert noted == {path: hashlib.sha256(b"old").hexdigest()}
    read_bytes(path, 10)
    assert len(noted) == 1


def test_a_file_that_changes_between_two_readings_is_refused(tmp_path):
    path = tmp_path / "t.csv"
    path.write_bytes(b"old")
    with noted_digests():
        read_bytes(path, 10)
        path.write_bytes(b"new")
        with pytest.raises(UserError, match="was changed while it was read"):
            read_bytes(path, 10)


SCHEMAS = {
    *("batch/1", "check/1", "commissioning/1", "comparison/3", "design/3", "estimates/2"),
    *("export/1", "mapping/1", "model/2", "plan/1", "ratings/1", "repeated/1", "rows/1"),
    *("session/1", "session/2", "study-inputs/1", "study/1"),
}


def test_files_on_disk_are_named_as_they_were_wherever_their_modules_are() -> None:
    """A module that moves must not take the name of a schema with it: older files have it."""
    source = Path(__file__).parents[3] / "src" / "rigidimeter"
    text = "".join(path.read_text("utf-8") for path in source.rglob("*.py"))
    assert set(re.findall(r"[\"\']rigidimeter\.([\w.-]+/\d+)[\"\']", text)) == SCHEMAS


def test_a_row_with_commas_between_thousands_is_told_what_to_write(tmp_path: Path) -> None:
    path = tmp_path / "ratings.csv"
    path.write_text("subject,score\nA,1,234.5\n")
    with pytest.raises(UserError, match=r"line 2 has 3 values.* without a comma between thousands"):
        read_text_table(path)
