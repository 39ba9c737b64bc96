"""The check of MATLAB files, on the files that scipy's own tests were given by MATLAB users."""

import io
from pathlib import Path

import pytest
import scipy.io

from rigidimeter.errors import UserError
from rigidimeter.recording.formats.mat_check import check_mat5
from rigidimeter.recording.formats.readers import read_table

FOLDER = Path(scipy.io.__file__).parent / "matlab" / "tests" / "data"
FILES = sorted(FOLDER.glob("*.mat"))
DAMAGED = {
    "bad_miuint32.mat",
    "corrupted_zlib_checksum.mat",
    "corrupted_zlib_data.mat",
    "malformed1.mat",
}

pytestmark = pytest.mark.skipif(not FILES, reason=f"scipy came without its test files in {FOLDER}")


def check(data):
    check_mat5(io.BytesIO(data), len(data), lambda _: None)


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
