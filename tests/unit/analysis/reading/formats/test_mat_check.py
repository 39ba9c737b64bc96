"""The check of MATLAB files, on the files that scipy's own tests were given by MATLAB users."""

import io
import struct
from pathlib import Path

import numpy as np
import pytest
import scipy.io

from rigidimeter.analysis.reading.formats.mat4_check import check_mat4
from rigidimeter.analysis.reading.formats.mat_check import check_mat5
from rigidimeter.analysis.reading.formats.readers import read_table
from rigidimeter.core.errors import UserError

FOLDER = Path(scipy.io.__file__).parent / "matlab" / "tests" / "data"
FILES = sorted(FOLDER.glob("*.mat"))
DAMAGED = {
    "bad_miuint32.mat",
    "corrupted_zlib_checksum.mat",
    "corrupted_zlib_data.mat",
    "malformed1.mat",
}

needs_files = pytest.mark.skipif(not FILES, reason=f"scipy came without its test files in {FOLDER}")


def check(data):
    check_mat5(io.BytesIO(data), len(data), lambda _: None)


@needs_files
@pytest.mark.parametrize("path", FILES, ids=lambda path: path.name)
def test_no_whole_file_is_refused(path):
    data = path.read_bytes()
    if data[512:516] == b"\x89HDF":
        return
    if path.name in DAMAGED:
        with pytest.raises(
            Exception,
            match=r"cut short|negative dimension|Error -[35] while decompressing|size than its tag",
        ):
            check(data)
    else:
        check(data)


@needs_files
@pytest.mark.parametrize("path", FILES, ids=lambda path: path.name)
def test_every_file_is_read_or_refused_in_a_sentence(path):
    try:
        table = read_table(path)
    except UserError as error:
        text = str(error)
    else:
        text = table.source
    assert str(path) in text
    assert "\n" not in text


HEADER = ("kind", "rows", "columns", "imaginary", "name_bytes")


def version_4(folder, order="<", **header):
    """Write a file of version 4 with one column `t` of three values, and change its header."""
    values = {"kind": 1000 * (order == ">"), "rows": 3, "columns": 1, "imaginary": 0}
    values |= {"name_bytes": 2} | header
    head = struct.pack(f"{order}5i", *(values[name] for name in HEADER))
    path = folder / "r.mat"
    path.write_bytes(head + b"t\0" + np.arange(3.0).astype(f"{order}f8").tobytes())
    return path


@pytest.mark.parametrize("order", ["<", ">"])
def test_version_4_is_read_in_both_orders_of_bytes(tmp_path, order):
    table = read_table(version_4(tmp_path, order))
    assert table.columns["t"].tolist() == [0.0, 1.0, 2.0]


@pytest.mark.parametrize(
    ("header", "words"),
    [
        ({"name_bytes": 2**31 - 1}, r"cut short: a variable states 2147483671 bytes"),
        ({"rows": 2**31 - 1}, r"cut short: a variable states 17179869178 bytes"),
        ({"columns": 2**31 - 1}, "cut short"),
        ({"imaginary": 1}, "cut short"),
        ({"rows": 2}, "ends within the header"),
        ({"rows": -1}, "negative size"),
        ({"name_bytes": 0}, "negative size"),
        ({"kind": 60}, "unknown type 60"),
        ({"kind": 2000}, "unknown type 2000"),
        ({"kind": 3}, "unknown type 3"),
        ({"kind": 2**30}, "unknown type 64"),  # as if of the other order of bytes
    ],
)
def test_a_version_4_that_states_more_than_it_holds_is_refused_unread(tmp_path, header, words):
    path = version_4(tmp_path, **header)
    with pytest.raises(UserError, match=words):
        read_table(path)


def test_version_4_of_many_variables_is_refused_before_they_are_read(tmp_path):
    path = version_4(tmp_path)
    path.write_bytes(path.read_bytes() * 2001)
    with pytest.raises(UserError, match="holds 2001 entries; at most 2000"):
        read_table(path)


@needs_files
@pytest.mark.parametrize("path", [p for p in FILES if "_4.2" in p.name], ids=lambda p: p.name)
def test_no_whole_file_of_version_4_is_refused(path):
    data = path.read_bytes()
    assert check_mat4(io.BytesIO(data), len(data)) == len(scipy.io.whosmat(path))
