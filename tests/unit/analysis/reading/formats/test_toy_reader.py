"""A format from outside the package: one function and one entry in the list of readers."""

import json
import re
import struct
from pathlib import Path

import numpy as np
import pytest
from tests.faults.test_bad_inputs import recording as joint_motion

import rigidimeter.analysis.reading as recording
from rigidimeter.analysis.reading.formats import READERS, Reader, Table, formats_text
from rigidimeter.core.errors import UserError

MAGIC = b"TOY1"
NAMES = ("time_s", "torque_nm", "angle_rad")


def read_toy(path):
    """Read little-endian doubles, three a row, behind a magic and a count."""
    data = path.read_bytes()
    (count,) = struct.unpack_from("<I", data, 4)
    values = np.frombuffer(data, "<f8", 3 * count, 8).reshape(-1, 3)
    return Table(str(path), dict(zip(NAMES, values.T, strict=True)))


def is_toy(path):
    return path.is_file() and path.read_bytes()[:4] == MAGIC


TOY = Reader("toy recording", (".toy",), read_toy, sniff=is_toy, made_by="the toy")


@pytest.fixture
def toy():
    READERS.append(TOY)
    yield TOY
    READERS.remove(TOY)


@pytest.fixture
def path(tmp_path):
    columns = joint_motion()
    values = np.column_stack([columns[name] for name in NAMES])
    path = tmp_path / "r.toy"
    path.write_bytes(MAGIC + struct.pack("<I", len(values)) + values.astype("<f8").tobytes())
    return path


def test_it_is_read(toy, path):
    (epoch,) = recording.read(path).epochs
    np.testing.assert_array_equal(epoch.channels["torque_nm"].values, joint_motion()["torque_nm"])


def test_it_is_found_by_its_content_where_the_suffix_says_nothing(toy, path, tmp_path):
    path.rename(tmp_path / "r.bin")
    assert len(recording.read(tmp_path / "r.bin").epochs) == 1


def test_it_is_estimated_by_the_command_line(toy, path, tmp_path, rigidimeter):
    out = tmp_path / "out.json"
    assert rigidimeter("estimate", path, "--json", out).status == 0
    (epoch,) = json.loads(out.read_text())["epochs"]
    assert epoch["stiffness_nm_rad"] == pytest.approx(20.0, rel=0.01)


def test_it_is_listed(toy, tmp_path, rigidimeter):
    assert "toy recordings (.toy)" in formats_text()
    assert "toy recordings (.toy)" in " ".join(rigidimeter("estimate", "--help-all").out.split())
    (tmp_path / "r.xyz").write_bytes(b"x")
    with pytest.raises(UserError, match=r"what can be read is .*\.mat, .* or \.toy"):
        recording.read(tmp_path / "r.xyz")


def test_a_damaged_file_is_a_sentence(toy, path):
    path.write_bytes(path.read_bytes()[:30])
    with pytest.raises(UserError, match=r"r\.toy is not a complete toy recording \(buffer is"):
        recording.read(path)


def test_a_format_that_needs_another_package_says_which(monkeypatch, path):
    def needs_more(path):
        raise ImportError("no module named toylib")

    monkeypatch.setattr(
        "rigidimeter.analysis.reading.formats.readers.READERS",
        [Reader("toy recording", (".toy",), needs_more, extra="toys")],
    )
    with pytest.raises(UserError, match=r"pip install 'rigidimeter\[toys\]'"):
        recording.read(path)


ROOT = Path(__file__).parents[5]
HOW_TO = ROOT / "docs" / "development" / "add-a-file-format.md"


def test_the_example_of_the_document_is_read_by_the_command_line(tmp_path, rigidimeter):
    (example,) = re.findall(r"```python\n(.*?)```", HOW_TO.read_text("utf-8"), re.S)
    (tmp_path / "amplifier.py").write_text(example)
    columns = joint_motion()
    values = np.column_stack([columns[name] for name in NAMES]).astype("<f8")
    (tmp_path / "r.amp").write_bytes(",".join(NAMES).encode() + b"\n" + values.tobytes())
    known = list(READERS)
    out = tmp_path / "out.json"
    try:
        ran = rigidimeter(
            "--load", tmp_path / "amplifier.py", "estimate", tmp_path / "r.amp", "--json", out
        )
    finally:
        READERS[:] = known
    assert ran.status == 0, ran.err
    assert json.loads(out.read_text())["epochs"][0]["outcome"] == "included"


def test_the_document_on_reading_lists_every_format():
    text = (ROOT / "docs" / "reference" / "formats.md").read_text("utf-8")
    for reader in READERS:
        suffixes = ", ".join(f"`{suffix}`" for suffix in reader.suffixes) or "a folder"
        assert f"| {reader.name} | {suffixes} | " in text
        assert reader.about
