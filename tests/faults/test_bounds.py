"""Files beyond any bound: one sentence each, before they take the memory or the time."""

import json
import os
import zipfile
import zlib
from pathlib import Path

import numpy as np
import pytest
import scipy.io

from rigidimeter.analysis.reading.formats.read_options import ReadOptions
from rigidimeter.analysis.reading.formats.readers import read_recording, settings_in_file
from rigidimeter.analysis.statistics import bootstrap, fit_mixed
from rigidimeter.core.errors import UserError
from rigidimeter.core.files import (
    CELLS,
    MAX_COLUMNS,
    MAX_DIGITS,
    NESTING,
    TABLE_ROWS,
    read_json,
    read_text_table,
    read_toml,
)
from rigidimeter.core.session import SessionWriter, rest_of
from rigidimeter.core.settings import parse_settings

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
LONG = f"more than {MAX_DIGITS} digits"


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
    path.write_bytes(b'{"a": ' + b"9" * MAX_DIGITS + b"}")
    assert read_json(path) == {"a": 10**MAX_DIGITS - 1}
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


def test_settings_are_not_sought_in_a_pipe(tmp_path):
    pipe = tmp_path / "pipe.xdf"
    os.mkfifo(pipe)
    assert "cannot be read (it is a named pipe)" in refusal(settings_in_file, pipe)


@pytest.mark.parametrize("suffix", ["csv", "npz", "mat"])
def test_recordings_are_regular_files(tmp_path, suffix):
    pipe = tmp_path / f"pipe.{suffix}"
    os.mkfifo(pipe)
    assert "cannot be read (it is a named pipe)" in refused(pipe)
    endless = tmp_path / f"endless.{suffix}"
    endless.symlink_to("/dev/zero")
    assert "cannot be read (it is a device)" in refused(endless)
    path = tmp_path / f"large.{suffix}"
    with path.open("wb") as file:
        file.truncate(10**12)
    assert "has 931 GiB, and at most 8 GiB" in refused(path)
    with path.open("wb") as file:
        file.truncate(7 * 10**9)  # zeros, and no block of the disk
    assert str(path) in refused(path)


@pytest.mark.parametrize("name", ["manifest.json", "samples.arrows", "events.jsonl"])
def test_a_file_of_a_session_that_is_a_pipe(tmp_path, name):
    folder = tmp_path / "s"
    SessionWriter(folder, parse_settings({}), [], {"session": 1}, virtual=True).close(
        1.0, "success", ""
    )
    (folder / name).unlink()
    os.mkfifo(folder / name)
    assert f"{name}: cannot be read (it is a named pipe)" in refused(folder)


def test_a_million_columns(tmp_path):
    path = tmp_path / "wide.csv"
    names = b",".join(b"c%d" % k for k in range(10**6))
    path.write_bytes(names + b"\n" + b"1," * (10**6 - 1) + b"1\n")
    told = f"names 1000000 columns; at most {MAX_COLUMNS} are read"
    assert told in refused(path)
    assert told in refusal(read_text_table, path)


def test_a_million_rows_of_a_small_table(tmp_path):
    path = tmp_path / "long.csv"
    path.write_bytes(b"condition,examiner,score\n" + b"OFF,A,1\n" * 10**6)
    assert (
        f"has 1000000 rows of 3 columns; a table of labels and numbers may have {TABLE_ROWS}"
        in (refusal(read_text_table, path))
    )


def npy(shape: str, data: bytes, descr: str = "'<f8'") -> bytes:
    """Return an array of NumPy's format, of any header and any data."""
    header = f"{{'descr': {descr}, 'fortran_order': False, 'shape': {shape}, }}"
    header += " " * (-(len(header) + 11) % 64) + "\n"
    return b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little") + header.encode() + data


def test_an_npz_bomb(tmp_path):
    path = tmp_path / "bomb.npz"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name in ("torque_nm", "angle_rad", "time_s"):
            archive.writestr(f"{name}.npy", npy("(12500000,)", bytes(100_000_000)))
    assert path.stat().st_size < 400_000
    assert "expands to 95.4 MiB; the columns that are used of a file of this size" in refused(path)


def test_only_the_columns_that_are_used_are_expanded(tmp_path):
    path = tmp_path / "r.npz"
    used = {name: np.arange(50.0) for name in ("time_s", "torque_nm", "angle_rad")}
    np.savez_compressed(path, **used)
    with zipfile.ZipFile(path, "a", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("other.npy", npy("(12500000,)", bytes(100_000_000)))
    (epoch,), _ = read_recording(path, ReadOptions())
    assert len(epoch.channels["torque_nm"]) == 50


@pytest.mark.parametrize(
    ("shape", "descr"), [("(10**12,)", "'<f8'"), ("(1000000000000,)", "'<f8'"), ("(-1,)", "'<f8'")]
)
def test_an_array_that_is_shorter_than_its_header_says(tmp_path, shape, descr):
    path = tmp_path / "r.npz"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("torque_nm.npy", npy(shape, bytes(800), descr))
    assert "is not a complete NumPy archive" in refused(path)


def test_an_archive_of_many_entries(tmp_path):
    path = tmp_path / "r.npz"
    with zipfile.ZipFile(path, "w") as archive:
        for k in range(MAX_COLUMNS + 1):
            archive.writestr(f"a{k}.npy", b"")
    assert f"holds {MAX_COLUMNS + 1} entries; at most {MAX_COLUMNS} are read" in refused(path)


def mat5(*elements: bytes) -> bytes:
    return b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM" + b"".join(elements)


def compressed(size: int, stored: bytes) -> bytes:
    data = zlib.compress((14).to_bytes(4, "little") + size.to_bytes(4, "little") + stored, 9)
    return (15).to_bytes(4, "little") + len(data).to_bytes(4, "little") + data


@pytest.mark.parametrize(
    ("size", "zeros", "told"),
    [(300_000_000, 300_000_000, "expands to 286 MiB"), (8, 30_000_000, "than its tag")],
)
def test_a_mat_bomb(tmp_path, size, zeros, told):
    path = tmp_path / "bomb.mat"
    path.write_bytes(mat5(compressed(size, bytes(zeros))))
    assert path.stat().st_size < 400_000
    assert told in refused(path)


def test_a_matlab_matrix_of_bytes_that_become_doubles(tmp_path):
    """MATLAB stores doubles that are small whole numbers as bytes: 8 times as large when read."""
    path = tmp_path / "r.mat"
    long = np.zeros(20_000_000, dtype=np.uint8)
    scipy.io.savemat(
        path, {"torque_nm": long, "angle_rad": long, "fs": 1000.0}, do_compression=True
    )
    assert "expands to 153 MiB" in refused(path)


def test_a_matlab_file_of_many_cells(tmp_path, monkeypatch):
    monkeypatch.setattr("rigidimeter.analysis.reading.formats.mat_check.CELLS", CELLS // 100)
    path = tmp_path / "r.mat"
    empty = b"\x0e\0\0\0\0\0\0\0"
    flags = b"\x06\0\0\0\x08\0\0\0\x01\0\0\0\0\0\0\0"
    dims = b"\x05\0\0\0\x08\0\0\0" + (1).to_bytes(4, "little") + (10**4).to_bytes(4, "little")
    matrix = flags + dims + b"\x01\0\x01\0a\0\0\0" + empty * 10**4
    path.write_bytes(mat5(compressed(len(matrix), matrix)))
    assert f"more than {CELLS // 100} cells" in refused(path)


def hdf5(path: Path, fill) -> Path:
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w", userblock_size=512) as file:
        for name in ("time_s", "torque_nm", "angle_rad"):
            file[name] = np.arange(50.0)
        fill(h5py, file)
    return path


def test_an_hdf5_bomb(tmp_path):
    def fill(_h5py, file):
        del file["torque_nm"]
        file.create_dataset("torque_nm", (10**12,), "f8")  # of which nothing is stored

    text = refused(hdf5(tmp_path / "r.mat", fill))
    assert "torque_nm expands to 7.45e+03 GiB" in text


def test_what_an_hdf5_file_links_to_is_not_read(tmp_path):
    def fill(h5py, file):
        file["elsewhere"] = h5py.ExternalLink("/dev/zero", "/a")
        file["soft"] = h5py.SoftLink("/torque_nm")
        kept = [("/etc/hostname", 0, 80)]
        file.create_dataset("outside", (10,), "f8", external=kept)

    (epoch,), _ = read_recording(hdf5(tmp_path / "r.mat", fill), ReadOptions())
    assert len(epoch.channels["torque_nm"]) == 50


def test_an_hdf5_group_that_holds_itself(tmp_path):
    def fill(_h5py, file):
        group = file.create_group("a")
        group["a"] = group

    assert "nested too deeply" in refused(hdf5(tmp_path / "r.mat", fill))


def table(path: Path, time_s=None, scale_torque=1.0, scale_angle=1.0, **more) -> Path:
    """Write a recording of 50 rows."""
    k = np.arange(50.0)
    columns = {
        "time_s": k / 100 if time_s is None else time_s,
        "torque_nm": np.cos(k) * scale_torque,
        "angle_rad": np.sin(k) * scale_angle,
        **more,
    }
    np.savez(path, **{name: values for name, values in columns.items() if values is not False})
    return path


@pytest.mark.parametrize(
    ("changed", "options", "told"),
    [
        ({"scale_torque": 1e-320}, {}, "the largest value of torque_nm is 9.99989e-321; it must"),
        ({"scale_angle": 1e-320}, {}, "the largest value of angle_rad is"),
        ({"scale_angle": 1e300}, {}, "must be from 1e-30 to 1e+30 in SI units"),
        ({"time_s": np.arange(50) * 1e-310}, {}, "samples that are 1e-310 s apart"),
        ({"time_s": np.arange(50) * 1e300}, {}, "samples that are 1e+300 s apart"),
        ({}, {"epoch_length_s": 1e-300}, "more than 10000 epochs of --epoch-length-s 1e-300"),
        ({}, {"epoch_length_s": 5e-324}, "more than 10000 epochs of --epoch-length-s 4.94066e-324"),
    ],
)
def test_numbers_beyond_arithmetic(tmp_path, changed, options, told):
    assert told in refused(table(tmp_path / "r.npz", **changed), **options)


@pytest.mark.parametrize("rate_hz", [1e-308, 5e-324, 1e-5, 1e300])
def test_sampling_rates_of_nothing(tmp_path, rate_hz):
    path = table(tmp_path / "r.npz", time_s=False)
    with pytest.raises(UserError, match=r"--rate-hz .* must be from 0\.001 to 1e\+07 Hz"):
        read_recording(path, ReadOptions(rate_hz=rate_hz))


def test_an_epoch_for_every_row(tmp_path):
    path = tmp_path / "r.npz"
    k = np.arange(30_000.0)
    angle_rad = 0.1 * np.sin(k / 9)
    np.savez(path, time_s=k / 100, torque_nm=np.cos(k / 9), angle_rad=angle_rad, epoch=k)
    assert "the epoch column changes more than 20000 times" in refused(path)


@pytest.mark.parametrize(
    ("n_scores", "n_examiners"), [(12_000, 3_000), (100_000, 50_000), (100_000, 200)]
)
def test_more_ratings_than_can_be_modelled(n_scores, n_examiners):
    examiners = [f"E{k % n_examiners}" for k in range(n_scores)]
    conditions = [("OFF", "DBS")[k // 7 % 2] for k in range(n_scores)]
    with pytest.raises(ValueError, match="are too many for a mixed model; with so many scores"):
        fit_mixed(np.zeros(n_scores), conditions, {"examiner": examiners})


def test_more_values_than_can_be_resampled():
    with pytest.raises(UserError, match="must be at most 2083"):
        bootstrap(lambda a, b: a[:, 0] - b[:, 0], (6000, 6000), np.random.default_rng(1))


@pytest.mark.parametrize("value", [5, [], "a", {"origin_rad": "x"}, {"origin_rad": True}])
def test_a_session_that_continues_nothing(simulate, value):
    folder = simulate()
    manifest = json.loads((folder / "manifest.json").read_text())
    manifest["continues"] = value
    manifest["schema"] = "rigidimeter.session/1"  # which has no checksum
    (folder / "manifest.json").write_text(json.dumps(manifest))
    with pytest.raises(UserError) as caught:
        rest_of(folder)
    assert str(folder) in str(caught.value)
