"""Files beyond any bound: one sentence each, before they take the memory or the time."""

import os
import zipfile
import zlib
from pathlib import Path

import numpy as np
import pytest
import scipy.io

from rigidimeter.documents import read_json, read_toml
from rigidimeter.documents.bounds import COLUMNS, DIGITS, NESTING, TABLE_ROWS
from rigidimeter.errors import UserError
from rigidimeter.recording.formats.readers import read_recording
from rigidimeter.recording.formats.table_epochs import ReadOptions
from rigidimeter.recording.formats.text_table import read_text_table

HEAD = b"time_s,torque_nm,angle_rad\n"


def refusal(read, path: Path, *more) -> str:
    with pytest.raises(UserError) as caught:
        read(path, *more)
    text = str(caught.value)
    assert text.startswith(str(path))
    assert "\n" not in text
    return text


def refused(path: Path, **options) -> str:
    return refusal(read_recording, path, ReadOptions(**options))


DEEP = f"nested more than {NESTING} deep"
LONG = f"more than {DIGITS} digits"


@pytest.mark.parametrize(
    ("read", "text", "told"),
    [
        (read_json, b'{"a": ' + b"9" * 5000 + b"}", LONG),
        (read_json, b'{"a": [1' + b"0" * 40 + b"]}", f"a[0] has {LONG}"),
        (read_json, b"[" * 100_000, DEEP),
        (read_json, b"[" * 33 + b"]" * 33, DEEP),
        (read_json, b'{"a": NaN}', "a is nan, which is not a number of JSON"),
        (read_json, b"\xff", "not text in UTF-8"),
        (read_toml, b"a = " + b"9" * 5000, LONG),
        (read_toml, b"a.b = 0x" + b"f" * 5000, f"a.b has {LONG}"),
        (read_toml, b"a = " + b"[" * 100_000, DEEP),
        (read_toml, b"a." * 100_000 + b"b = 1", DEEP),
        (read_toml, b"a = 2021-02-30", "not valid TOML"),
    ],
)
def test_documents(tmp_path, read, text, told):
    path = tmp_path / "a"
    path.write_bytes(text)
    assert told in refusal(read, path)


def test_a_document_within_its_bounds(tmp_path):
    path = tmp_path / "a"
    path.write_bytes(b'{"a": ' + b"9" * DIGITS + b"}")
    assert read_json(path) == {"a": 10**DIGITS - 1}
    path.write_bytes(b"[" * NESTING + b"]" * NESTING)
    assert read_json(path)


@pytest.mark.parametrize("read", [read_json, read_toml, read_text_table])
def test_only_regular_files(tmp_path, read):
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    assert "it is a named pipe" in refusal(read, pipe)
    endless = tmp_path / "endless"
    endless.symlink_to("/dev/zero")
    assert "it is a device" in refusal(read, endless)
    assert "it is a folder" in refusal(read, tmp_path)
    ring = tmp_path / "ring"
    ring.symlink_to("ring")
    assert "cannot be read" in refusal(read, ring)
    with (tmp_path / "large").open("wb") as file:
        file.truncate(10**12)
    assert "has 931 GiB, and at most" in refusal(read, tmp_path / "large")


@pytest.mark.parametrize("suffix", ["csv", "npz", "mat"])
def test_recordings_are_regular_files(tmp_path, suffix):
    for name, target in (("pipe", None), ("endless", "/dev/zero")):
        path = tmp_path / f"{name}.{suffix}"
        if target is None:
            os.mkfifo(path)
        else:
            path.symlink_to(target)
        assert "what can be read is" in refused(path)
    path = tmp_path / f"large.{suffix}"
    with path.open("wb") as file:
        file.truncate(10**12)
    assert "has 931 GiB, and at most 8 GiB" in refused(path)
    with path.open("wb") as file:
        file.truncate(7 * 10**9)  # zeros, and no block of the disk
    assert str(path) in refused(path)


def test_a_manifest_that_is_a_pipe(tmp_path):
    os.mkfifo(tmp_path / "manifest.json")
    refused(tmp_path)


def test_a_million_columns(tmp_path):
    path = tmp_path / "wide.csv"
    names = b",".join(b"c%d" % k for k in range(10**6))
    path.write_bytes(names + b"\n" + b"1," * (10**6 - 1) + b"1\n")
    told = f"names 1000000 columns; at most {COLUMNS} are read"
    assert told in refused(path)
    assert told in refusal(read_text_table, path)


def test_a_million_rows_of_a_small_table(tmp_path):
    path = tmp_path / "long.csv"
    path.write_bytes(b"condition,examiner,score\n" + b"OFF,A,1\n" * 10**6)
    assert f"has 1000000 rows of 3 columns; a table of labels and numbers may have {TABLE_ROWS}" in (
        refusal(read_text_table, path)
    )
