"""Epochs by label and by length; condition and task."""

import numpy as np
import pytest

from rigidimeter.analysis.reading.formats.cutting import lettered
from rigidimeter.analysis.reading.formats.read_options import ReadOptions
from rigidimeter.analysis.reading.formats.table import Table
from rigidimeter.analysis.reading.formats.table_epochs import epochs_from_table
from rigidimeter.core.errors import UserError


def table(n=300, *, rate_hz=100.0, start_s=0.0, **more):
    time_s = start_s + np.arange(n) / rate_hz
    columns = {"time_s": time_s, "torque_nm": np.sin(time_s), "angle_rad": np.cos(time_s)}
    return Table("r.csv", columns | {name: np.asarray(values) for name, values in more.items()})


def texts(*runs):
    return np.array([label for label, count in runs for _ in range(count)], dtype=object)


def spans(epochs):
    return [
        (e.label, round(e.channels["torque_nm"].time_s[0], 6), len(e.channels["torque_nm"]))
        for e in epochs
    ]


def test_rest_between_labels_is_not_read():
    labels = texts(("", 20), ("a", 100), ("NaN", 30), ("b", 100), (" ", 50))
    epochs, notices = epochs_from_table(table(epoch=labels), ReadOptions())
    assert spans(epochs) == [("a", 0.2, 100), ("b", 1.5, 100)]
    assert notices == []


def test_numbers_are_labels_without_a_point():
    labels = np.repeat([1.0, np.nan, 2.0, 2.5], [100, 50, 100, 50])
    epochs, _ = epochs_from_table(table(epoch=labels), ReadOptions())
    assert spans(epochs) == [("1", 0.0, 100), ("2", 1.5, 100), ("2.5", 2.5, 50)]


def test_a_label_that_returns_is_another_epoch():
    labels = texts(("1", 50), ("", 50), ("1", 50), ("2", 100), ("1", 50))
    epochs, notices = epochs_from_table(table(epoch=labels), ReadOptions())
    assert [epoch.label for epoch in epochs] == ["1", "1 (2)", "2", "1 (3)"]
    assert [notice.level for notice in notices] == ["warning", "warning"]
    assert "epoch 1 occurs again at 1 s" in notices[0].text


def test_two_spellings_of_a_label_are_one_epoch():
    labels = texts(("1", 100), ("1.0", 100), (" 1", 100))
    epochs, notices = epochs_from_table(table(epoch=labels), ReadOptions())
    assert spans(epochs) == [("1", 0.0, 300)]
    assert notices == []


def test_condition_and_task_of_each_epoch():
    data = table(
        epoch=texts(("1", 150), ("2", 150)),
        condition=texts(("OFF", 150), ("DBS", 150)),
        task=texts(("prbs", 150), ("Sinusoid", 150)),
    )
    epochs, _ = epochs_from_table(data, ReadOptions(condition="unused", task="prbs"))
    assert [(e.condition, e.task) for e in epochs] == [("OFF", "prbs"), ("DBS", "sinusoid")]


def test_an_empty_condition_is_that_of_the_options():
    data = table(condition=texts(("", 300)), task=texts(("", 300)))
    (epoch,), _ = epochs_from_table(data, ReadOptions(condition="OFF", task="prbs"))
    assert (epoch.condition, epoch.task) == ("OFF", "prbs")


@pytest.mark.parametrize("name", ["condition", "task"])
def test_a_label_that_changes_within_an_epoch_is_refused(name):
    data = table(**{name: texts(("prbs", 150), ("sinusoid", 150))})
    with pytest.raises(UserError, match=rf"row 151: {name} changes .* within epoch 1;"):
        epochs_from_table(data, ReadOptions())


def test_an_unknown_task_is_refused_with_the_nearest():
    data = table(task=texts(("sine", 300)))
    with pytest.raises(
        UserError, match=r"epoch 1: task sine is not known.* prbs or sinusoid .*is sinusoid"
    ):
        epochs_from_table(data, ReadOptions())


def test_no_label_anywhere_is_refused():
    with pytest.raises(UserError, match="epoch column is empty in every row"):
        epochs_from_table(table(epoch=np.full(300, np.nan)), ReadOptions())


@pytest.mark.parametrize(
    ("rows", "labels", "left_s"), [(294, "12", "0.94"), (295, "123", ""), (301, "123", "0.01")]
)
def test_a_short_remainder_is_left_out_aloud(rows, labels, left_s):
    epochs, notices = epochs_from_table(table(rows), ReadOptions(epoch_length_s=1.0))
    assert [epoch.label for epoch in epochs] == list(labels)
    assert [f"the last {left_s} s, from" in notice.text for notice in notices] == [True] * bool(
        left_s
    )


@pytest.mark.parametrize("start_s", [0.1, 12345.678, 1.7e9])
@pytest.mark.parametrize("rate_hz", [1000.0, 300.0, 1024.0])
def test_rounding_of_stamps_moves_no_sample_across_a_cut(start_s, rate_hz):
    data = table(int(3 * rate_hz), rate_hz=rate_hz, start_s=start_s)
    epochs, _ = epochs_from_table(data, ReadOptions(epoch_length_s=1.0))
    assert [len(epoch.channels["angle_rad"]) for epoch in epochs] == [rate_hz] * 3


def test_labels_win_over_a_length_aloud():
    options = ReadOptions(epoch_length_s=1.0)
    epochs, notices = epochs_from_table(table(epoch=texts(("x", 300))), options)
    assert [epoch.label for epoch in epochs] == ["x"]
    assert [notice.level for notice in notices] == ["warning"]


def test_a_file_shorter_than_one_epoch_is_refused():
    with pytest.raises(UserError, match=r"lasts 3 s, which is shorter than .*--epoch-length-s 20"):
        epochs_from_table(table(), ReadOptions(epoch_length_s=20.0))


@pytest.mark.parametrize("length_s", [0.0, -1.0, np.nan, np.inf])
def test_a_senseless_length_is_refused(length_s):
    with pytest.raises(UserError, match="--epoch-length-s"):
        epochs_from_table(table(), ReadOptions(epoch_length_s=length_s))


def test_pieces_are_lettered_beyond_z():
    names = lettered("3", 60)
    assert names[:2] == ["3a", "3b"]
    assert names[25:28] == ["3z", "3aa", "3ab"]
    assert names[51:53] == ["3az", "3ba"]
    assert lettered("3", 1) == ["3"]
