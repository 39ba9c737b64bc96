"""Any table that is written is read back the same, and cutting loses nothing in silence."""

import re
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import scipy.io
from hypothesis import given, settings
from hypothesis import strategies as st

from rigidimeter.analysis.reading.formats.read_options import ReadOptions
from rigidimeter.analysis.reading.formats.readers import read_table
from rigidimeter.analysis.reading.formats.table import Table
from rigidimeter.analysis.reading.formats.table_epochs import epochs_from_table
from rigidimeter.core.errors import UserError

finite = st.floats(allow_nan=False, allow_infinity=False)
sizes = st.integers(2, 12)


@st.composite
def columns(draw):
    size, count = draw(sizes), draw(st.integers(2, 4))
    lists = draw(
        st.lists(st.lists(finite, min_size=size, max_size=size), min_size=count, max_size=count)
    )
    return {f"c{index}": np.array(values) for index, values in enumerate(lists)}


def written(folder: str, suffix: str, data, delimiter: str = ",", decimal: str = ".") -> Path:
    path = Path(folder) / f"r{suffix}"
    if suffix == ".npz":
        np.savez(path, **data)
    elif suffix == ".mat":
        scipy.io.savemat(path, data)
    else:
        rows = zip(*(values.tolist() for values in data.values()), strict=True)
        lines = [delimiter.join(repr(value).replace(".", decimal) for value in row) for row in rows]
        path.write_text("\n".join([delimiter.join(data), *lines]))
    return path


@settings(max_examples=40)
@given(data=columns(), suffix=st.sampled_from([".npz", ".mat", ".csv"]))
def test_what_is_written_is_read(data, suffix):
    with TemporaryDirectory() as folder:
        table = read_table(written(folder, suffix, data))
        assert list(table.columns) == list(data)
        for name, values in data.items():  # each is read when it is asked for
            np.testing.assert_array_equal(table.columns[name], values)


@settings(max_examples=40)
@given(data=columns(), delimiter=st.sampled_from([";", "\t"]), decimal=st.sampled_from([",", "."]))
def test_delimiters_and_decimal_marks(data, delimiter, decimal):
    with TemporaryDirectory() as folder:
        table = read_table(written(folder, ".csv", data, delimiter, decimal))
    for name, values in data.items():
        np.testing.assert_array_equal(table.columns[name], values)


@st.composite
def recordings(draw):
    """A table with pauses, lost samples and labels, on a clock of about 100 Hz.

    Ten samples or more of each signal are left: of five that lie in three pieces nobody can say
    whether most are lost or the sensor is slow.
    """
    size = draw(st.integers(25, 200))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    steps = np.full(size, 0.01)
    for _ in range(draw(st.integers(0, 2))):
        steps[rng.integers(1, size)] = draw(st.sampled_from([0.03, 0.2, 1.0]))
    data = {"time_s": np.cumsum(steps)}
    for name in ("torque_nm", "angle_rad"):
        data[name] = rng.normal(size=size)
        for _ in range(draw(st.integers(0, 1))):
            start = rng.integers(0, size)
            run = slice(start, start + draw(st.integers(1, 15)))
            data[name][run] = draw(st.sampled_from([np.nan, np.inf]))
    if draw(st.booleans()):
        labels = np.repeat(rng.integers(0, 3, size // 10 + 1), 10)[:size].astype(float)
        data["epoch"] = np.where(labels == 0, np.nan, labels)
    return Table("r", data)


@settings(max_examples=150)
@given(table=recordings(), length_s=st.sampled_from([None, 0.25, 1.0]))
def test_cutting_loses_nothing_in_silence(table, length_s):
    try:
        epochs, notices = epochs_from_table(table, ReadOptions(epoch_length_s=length_s))
    except UserError:
        return
    told = [
        (float(start), float(stop) if stop else np.inf)
        for notice in notices
        for start, stop in re.findall(r"from ([\d.]+) s (?:to ([\d.]+) s|on)", notice.text)
    ]
    told += [
        (float(at), float(at))
        for notice in notices
        for at in re.findall(r"finite, at ([\d.]+) s", notice.text)
    ]
    time_s = table.columns["time_s"]
    labelled = ~np.isnan(table.columns.get("epoch", np.zeros(time_s.size)))
    for name in ("torque_nm", "angle_rad"):
        read = [epoch.channels[name] for epoch in epochs if name in epoch.channels]
        stamps = np.concatenate([channel.time_s for channel in read]) if read else np.empty(0)
        values = np.concatenate([channel.values for channel in read]) if read else np.empty(0)
        assert np.all(np.diff(stamps) > 0)  # in order, and none twice
        rows = np.searchsorted(time_s, stamps)
        np.testing.assert_array_equal(time_s[rows], stamps)
        np.testing.assert_array_equal(table.columns[name][rows], values)
        lost = np.setdiff1d(np.flatnonzero(labelled), rows)
        for row in lost:
            at_s = time_s[row]
            named = any(start - 1e-4 <= at_s <= stop + 1e-4 for start, stop in told)
            without = any("no number in any row" in notice.text for notice in notices)
            assert named or without, (row, at_s, [notice.text for notice in notices])


@settings(max_examples=100)
@given(table=recordings(), length_s=st.sampled_from([None, 0.25, 1.0]))
def test_no_epoch_holds_an_interval_too_long_to_bridge(table, length_s):
    try:
        epochs, _ = epochs_from_table(table, ReadOptions(epoch_length_s=length_s))
    except UserError:
        return
    for epoch in epochs:
        for channel in epoch.channels.values():
            assert np.diff(channel.time_s).max() <= 0.05 + 1e-9
            assert np.isfinite(channel.values).all()
