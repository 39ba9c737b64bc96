"""Files that cannot be read: one sentence each, never a traceback."""

import numpy as np
import pytest
import scipy.io

from rigidimeter.analysis.reading.formats.read_options import ReadOptions
from rigidimeter.analysis.reading.formats.readers import read_recording
from rigidimeter.core.errors import UserError

HEAD = b"time_s,torque_nm,angle_rad\n"
ROWS = b"".join(b"%.2f,%d,0.1\n" % (k / 100, k % 7) for k in range(50))


def refusal(path, **options) -> str:
    with pytest.raises(UserError) as caught:
        read_recording(path, ReadOptions(**options))
    text = str(caught.value)
    assert text
    assert "\n" not in text
    return text


@pytest.mark.parametrize(
    ("data", "told"),
    [
        (b"", "is empty"),
        (b"\n\n# only a remark\n", "is empty; its first line must name the columns"),
        (HEAD, "names its columns in line 1 but has no samples"),
        (HEAD + b"0,1,2\n", "holds 1 sample"),
        (ROWS, "first line holds numbers (0.00, 0, 0.1), but it must name the columns"),
        (b"time_s\n1\n2\n", "names fewer than two columns"),
        (HEAD + ROWS + b"0.5,oops,1\n", "line 52: torque_nm holds 'oops', which is not a number"),
        (HEAD + ROWS + b"0.5,1\n", "line 52 has 2 values, but the first line names 3 columns"),
        (HEAD + b"0,1,2,3\n" + ROWS, "line 2 has 4 values"),
        (HEAD + ROWS + ROWS, "line 52: time_s goes back from 0.49 to 0.0"),
        (HEAD + ROWS + b"0.49,1,1\n", "line 52: time_s repeats 0.49"),
        (HEAD + b",1,1\n" + ROWS, "line 2: time_s is missing"),
        (HEAD + ROWS + b"inf,1,1\n", "line 52: time_s is infinite"),
        (b"a,a\n1,2\n", "its columns are a, a (2)"),
        (b"\x89PNG\r\n\x1a\n\x00\xff\xfe", "is not a text file in UTF-8"),
        (b"a,b\n1,\x002\n", "is not a text file: it holds zero bytes"),
        (HEAD.decode().encode("utf-16")[:-1], "is not a text file in UTF-8"),
        (HEAD.replace(b"angle", b"\x81") + ROWS, "is not a text file in UTF-8"),
        (HEAD.replace(b"angle", b"\xb0\x1b") + ROWS, "is not a text file in UTF-8"),
        (HEAD + ROWS + b'0.5,"1,1\n0.6,1,1\n', "line 52 has 2 values"),
        (HEAD + b'0.5,"1,1\n' + 400 * ROWS, "is not a readable table: field larger than"),
        (HEAD + ROWS + b'0.5,"1"x,1\n', "line 52: torque_nm holds '1x', which is not a number"),
    ],
)  # fmt: skip
def test_text_files(tmp_path, data, told):
    path = tmp_path / "bad.csv"
    path.write_bytes(data)
    text = refusal(path)
    assert text.startswith(str(path))
    assert told in text


@pytest.mark.parametrize(
    ("head", "options", "told"),
    [
        ("time_s,Torqe,angle_rad", {}, "has no column torque_nm; its columns are time_s, Torqe, "
         "angle_rad; the nearest is Torqe: if it is the one, say --column torque=Torqe"),
        ("time_s,torque_nm,positn", {}, "has neither column velocity_rad_s nor angle_rad"),
        ("time_s,torque_nm,positn", {}, "--column angle=positn"),
        ("x,torque_nm,angle_rad", {}, "say --rate-hz, or name the column of the time, as in "
         "--column time=NAME"),
        (HEAD.decode().strip(), {"columns": {"torque_nM": "Fz"}}, "torque_nM is not a name that is "
         "read; the nearest is torque_nm"),
        (HEAD.decode().strip(), {"columns": {"torque_nm": "torque"}}, "there is no column torque; "
         "the nearest is torque_nm"),
        (HEAD.decode().strip(), {"rate_hz": 50.0}, "--rate-hz 50 disagrees with column time_s, "
         "whose stamps are 100 Hz"),
        ("x,torque_nm,angle_rad", {"rate_hz": 0.0}, "must be greater than 0 Hz"),
        ("x,torque_nm,angle_rad", {"rate_hz": np.nan}, "must be greater than 0 Hz"),
    ],
)  # fmt: skip
def test_columns_that_are_not_there(tmp_path, head, options, told):
    path = tmp_path / "bad.csv"
    path.write_bytes(head.encode() + b"\n" + ROWS)
    assert told in refusal(path, **options)


def test_what_is_not_a_readable_file(tmp_path):
    assert "folder without manifest.json, so it is not a session folder" in refusal(tmp_path)
    assert "there is no such file" in refusal(tmp_path / "none.csv")
    (tmp_path / "r.docx").write_bytes(b"x")
    readable = refusal(tmp_path / "r.docx").partition("what can be read is ")[2]
    assert {".csv", ".xlsx", ".npz", ".mat", ".nwb", ".tdms", ".c3d"} < set(readable.split(", "))
    (tmp_path / "r").write_bytes(b"x")
    assert "without a suffix" in refusal(tmp_path / "r")


@pytest.mark.parametrize("suffix", ["npz", "mat"])
@pytest.mark.parametrize(
    "data",
    [b"", b"PK\x03\x04 cut short", b"hello " * 200, b"\x89HDF\r\n\x1a\n" + bytes(600), b"\0" * 9],
)
def test_binary_files_that_are_something_else(tmp_path, suffix, data):
    path = tmp_path / f"bad.{suffix}"
    path.write_bytes(data)
    assert refusal(path).startswith(str(path))


@pytest.mark.parametrize(
    ("entries", "told"),
    [
        ({"torque_nm": np.arange(5.0), "angle_rad": np.arange(6.0)}, "column angle_rad has 6 "
         "values and column torque_nm has 5; all columns must have the same length"),
        ({"torque_nm": np.array([{}, 1], dtype=object)}, "torque_nm holds Python objects"),
        ({"torque_nm": 1.0, "m": np.zeros((3, 4))}, "has no column of samples"),
        ({"torque_nm": np.arange(5.0), "angle_rad": np.arange(5.0)}, "say --rate-hz"),
        ({"torque_nm": np.arange(5.0), "angle_rad": np.arange(5.0), "fs": 0.0}, "fs = 0"),
        ({"torque_nm": np.arange(5.0), "angle_rad": np.arange(5.0), "fs": 1.0, "rate_hz": 2.0},
         "states several sampling rates (fs = 1, rate_hz = 2)"),
        ({"torque_nm": np.array(["1", "2", "x"]), "angle_rad": np.arange(3.0), "fs": 1.0},
         "row 3: torque_nm holds 'x'"),
        ({}, "has no column of samples"),
    ],
)  # fmt: skip
def test_archives(tmp_path, entries, told):
    path = tmp_path / "bad.npz"
    np.savez(path, **entries)
    text = refusal(path)
    assert text.startswith(str(path))
    assert told in text


def test_a_matrix_where_a_column_was_named(tmp_path):
    path = tmp_path / "bad.npz"
    np.savez(path, m=np.zeros((3, 4)), torque_nm=np.arange(4.0), fs=5.0)
    assert "m is an array of 3 × 4" in refusal(path, columns={"angle_rad": "m"})
    assert "fs is a single value" in refusal(path, columns={"angle_rad": "fs"})


def test_a_single_array_under_the_name_of_an_archive(tmp_path):
    path = tmp_path / "bad.npz"
    with path.open("wb") as file:
        np.save(file, np.arange(4.0))
    assert "save the columns by name, with numpy.savez" in refusal(path)


def test_matlab_without_columns(tmp_path):
    path = tmp_path / "bad.mat"
    scipy.io.savemat(path, {"a": 1.0, "m": np.zeros((3, 4)), "c": np.array([1, "x"], dtype=object)})
    assert "has no column of samples" in refusal(path)


@pytest.fixture
def whole_mat(tmp_path):
    path = tmp_path / "r.mat"
    columns = {"time_s": np.arange(50) / 100, "torque_nm": np.ones(50), "angle_rad": np.ones(50)}
    cells = np.array(["a", "bc"], dtype=object)
    more = {"s": {"x": np.array([1j, 2j]), "t": cells, "e": np.zeros((0, 0))}, "label": "OFF"}
    scipy.io.savemat(path, columns | more)
    return path


# Where scipy's compiled reader takes a wrong code as it comes and ends the process.
@pytest.mark.parametrize(("place", "value"), [(145, 42), (184, 21), (656, 152), (128, 77)])
def test_matlab_files_that_would_end_the_process(whole_mat, place, value):
    data = bytearray(whole_mat.read_bytes())
    data[place] = value
    whole_mat.write_bytes(data)
    assert "is not a complete MATLAB file" in refusal(whole_mat)


def test_whole_matlab_files_pass_the_check(whole_mat):
    (epoch,), notices = read_recording(whole_mat, ReadOptions())
    assert notices == []
    assert len(epoch.channels["torque_nm"]) == 50


@pytest.mark.parametrize("kept", [100, 130, 400, -1, -9])
def test_matlab_files_cut_short(whole_mat, kept):
    whole_mat.write_bytes(whole_mat.read_bytes()[:kept])
    assert "is not a complete MATLAB file" in refusal(whole_mat)


def test_names_with_line_feeds_stay_in_one_sentence(tmp_path):
    path = tmp_path / "r.npz"
    np.savez(path, **{"a\nb": np.arange(4.0)})
    assert "a?b" in refusal(path)


@pytest.mark.parametrize("suffix", ["csv", "npz", "mat"])
def test_damage_anywhere_is_read_or_refused(tmp_path, suffix):
    """Flip bytes or cut the file short: a sentence or an epoch, nothing else."""
    path = tmp_path / f"r.{suffix}"
    columns = {"time_s": np.arange(50) / 100, "torque_nm": np.ones(50), "angle_rad": np.ones(50)}
    if suffix == "csv":
        path.write_bytes(HEAD + ROWS)
    elif suffix == "npz":
        np.savez_compressed(path, **columns)
    else:
        scipy.io.savemat(path, columns)
    whole = path.read_bytes()
    rng = np.random.default_rng(11)
    sentences = []
    for _ in range(150):
        damaged = bytearray(whole)
        if rng.random() < 0.3:
            del damaged[rng.integers(1, len(whole)) :]
        else:
            for place in rng.integers(0, len(whole), rng.integers(1, 4)):
                damaged[place] ^= int(rng.integers(1, 256))
        path.write_bytes(damaged)
        try:
            read_recording(path, ReadOptions())
        except UserError as error:
            sentences.append(str(error))
    assert len(sentences) > 20
    assert all(str(path) in text for text in sentences)
