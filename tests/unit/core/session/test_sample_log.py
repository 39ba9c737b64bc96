import math

import numpy as np
import pyarrow as pa
import pytest
from tests.file_size import file_size_limit

from rigidimeter.core.errors import UserError
from rigidimeter.core.session import (
    SAMPLE_SCHEMA,
    SAMPLE_UNITS,
    Sample,
    SampleLog,
    read_events,
    read_samples,
    sample_dtypes,
    scan_samples,
)


def sample(k):
    values = [float(k + i) for i in range(14)]
    values[0], values[3], values[13] = k, k % 3 - 1, k % 5
    values[10] = math.nan
    return Sample(*values)


def write(path, n, rate_hz=1000.0, close=True):
    log = SampleLog(path, rate_hz)
    for k in range(n):
        log.append(sample(k))
    if close:
        log.close()
    return log


def test_what_was_appended_is_read_back(tmp_path):
    write(tmp_path / "s.arrows", 1234)
    columns = read_samples(tmp_path / "s.arrows")
    assert list(columns) == list(Sample._fields) == list(SAMPLE_UNITS)
    np.testing.assert_array_equal(columns["tick"], np.arange(1234))
    np.testing.assert_array_equal(columns["torque_nm"], np.arange(1234) + 5.0)
    np.testing.assert_array_equal(columns["epoch"], np.arange(1234) % 3 - 1)
    assert np.isnan(columns["target_angle_rad"]).all()
    assert columns["limited"].dtype == np.int8


def test_an_open_stream_holds_all_but_the_last_tenth_of_a_second(tmp_path):
    log = write(tmp_path / "s.arrows", 1234, close=False)
    assert len(read_samples(tmp_path / "s.arrows")["tick"]) == 1200
    log.close()
    assert len(read_samples(tmp_path / "s.arrows")["tick"]) == 1234


@pytest.mark.parametrize("share", [0.0, 0.001, 0.02, 0.3, 0.5, 0.77, 0.999])
def test_a_stream_cut_anywhere_gives_its_whole_batches(tmp_path, share):
    path = tmp_path / "s.arrows"
    write(path, 2000)
    content = path.read_bytes()
    path.write_bytes(content[: int(share * len(content))])
    n = len(read_samples(path)["tick"])
    assert n % 100 == 0
    assert n >= int(share * 2000) - 200
    stream = scan_samples(path.read_bytes(), path).stream
    assert stream.stop <= path.stat().st_size
    assert not stream.closed
    assert not stream.gaps


def test_a_recording_is_never_written_over(tmp_path):
    write(tmp_path / "s.arrows", 10)
    with pytest.raises(FileExistsError):
        SampleLog(tmp_path / "s.arrows", 1000.0)


def test_a_batch_for_which_there_is_no_room_names_its_file_and_leaves_the_others(tmp_path):
    path = tmp_path / "samples.arrows"
    log = SampleLog(path, 1000.0, "s")
    for tick in range(199):
        log.append(sample(tick))
    size = path.stat().st_size
    with file_size_limit(size + 100), pytest.raises(OSError, match="File too large") as refused:
        log.append(sample(199))  # which makes the batch full
    assert refused.value.filename == str(path)
    assert path.stat().st_size == size
    log.close()
    assert read_samples(path)["tick"].tolist() == list(range(200))


def test_closing_twice_does_no_harm(tmp_path):
    write(tmp_path / "s.arrows", 10).close()
    assert len(read_samples(tmp_path / "s.arrows")["tick"]) == 10


def test_a_torn_last_event_is_left_out_and_said(tmp_path):
    path = tmp_path / "events.jsonl"
    path.write_text('{"event": "a"}\n{"event": "b"}\n{"eve')
    assert read_events(path) == ([{"event": "a"}, {"event": "b"}], True)


def test_a_damaged_event_is_named(tmp_path):
    path = tmp_path / "events.jsonl"
    path.write_text('{"event": "a"}\nrubbish\n')
    with pytest.raises(UserError, match="line 2 is not a JSON object"):
        read_events(path)


@pytest.mark.parametrize("change", ["type", "null", "name"])
def test_a_stream_of_other_columns_is_refused(tmp_path, change):
    arrays = {name: np.zeros(3, dtype) for name, dtype in sample_dtypes().items()}
    columns = {name: pa.array(values) for name, values in arrays.items()}
    if change == "type":
        columns["torque_nm"] = pa.array(np.zeros(3, np.float32))
    elif change == "null":
        columns["torque_nm"] = pa.array([0.0, None, 0.0])
    else:
        columns["torque"] = columns.pop("torque_nm")
    path = tmp_path / "samples.arrows"
    table = pa.table(columns)
    with pa.ipc.new_stream(str(path), table.schema) as stream:
        stream.write_table(table)
    with pytest.raises(UserError, match="holds other columns than a recording of this version"):
        read_samples(path)


def test_a_schema_whose_names_are_no_text_is_damaged(tmp_path):
    path = tmp_path / "samples.arrows"
    write(path, 500)
    content = path.read_bytes()
    path.write_bytes(content.replace(b"torque_nm", b"torque\xff\xff\xff"))
    assert read_samples(path)["torque_nm"].size == 500


def test_a_recording_before_the_drives_torque_is_read_with_no_torque(tmp_path):
    schema = pa.schema(list(SAMPLE_SCHEMA)[:19])
    assert schema.names[-1] == "cause"
    rows = [sample(k) for k in range(250)]
    columns = [pa.array([row[i] for row in rows], kind) for i, kind in enumerate(schema.types)]
    with pa.ipc.new_stream(str(tmp_path / "s.arrows"), schema) as stream:
        stream.write_table(pa.Table.from_arrays(columns, schema=schema), max_chunksize=100)
    found = read_samples(tmp_path / "s.arrows")
    assert list(found) == list(Sample._fields)
    np.testing.assert_array_equal(found["torque_nm"], np.arange(250) + 5.0)
    for name in ("drive_torque_nm", "drive_torque_time_s"):
        assert found[name].dtype == np.float64
        assert np.isnan(found[name]).all()
