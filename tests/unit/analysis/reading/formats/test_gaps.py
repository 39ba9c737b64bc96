"""Lost samples, gaps, slower sensors, and units that look wrong."""

import numpy as np
import pytest

from rigidimeter.analysis.reading.formats.read_options import ReadOptions
from rigidimeter.analysis.reading.formats.table import Table
from rigidimeter.analysis.reading.formats.table_epochs import epochs_from_table
from rigidimeter.core.errors import UserError

NAN = np.nan


def table(n=1000, *, time_s=None, **more):
    time_s = np.arange(n) / 100 if time_s is None else time_s
    columns = {"time_s": time_s, "torque_nm": np.sin(time_s), "angle_rad": np.cos(time_s)}
    return Table("r.csv", columns | more)


def lacking(rows, value=NAN, n=1000):
    values = np.sin(np.arange(n) / 100)
    values[rows] = value
    return values


def read(data, **options):
    return epochs_from_table(data, ReadOptions(**options))


def lengths(epochs, name="torque_nm"):
    return [(epoch.label, len(epoch.channels[name])) for epoch in epochs]


@pytest.mark.parametrize("value", [NAN, np.inf, -np.inf])
def test_a_short_run_is_bridged_and_reported(value):
    epochs, (notice,) = read(table(torque_nm=lacking(slice(200, 203), value)))
    assert lengths(epochs) == [("1", 997)]
    assert lengths(epochs, "angle_rad") == [("1", 1000)]
    assert notice.level == "error"
    assert notice.text.startswith(
        "r.csv: torque_nm has 3 samples missing or not finite, from 2 s to 2.02 s"
    )


def test_the_file_name_of_a_mapped_column_is_told():
    data = Table("r.csv", dict(table().columns) | {"Fz": lacking([5])})
    _, (notice,) = read(data, columns={"torque_nm": "Fz"})
    assert "torque_nm (column Fz) has 1 sample" in notice.text


def test_a_long_run_ends_the_epoch_for_all_channels():
    epochs, notices = read(table(torque_nm=lacking(slice(200, 240))))
    assert lengths(epochs) == lengths(epochs, "angle_rad") == [("1a", 200), ("1b", 760)]
    assert [notice.level for notice in notices] == ["error", "error"]
    assert "missing for 0.41 s from 1.99 s to 2.4 s in torque_nm" in notices[0].text


@pytest.mark.parametrize(("lost", "pieces"), [(4, 1), (5, 2)])
def test_the_limit_is_the_larger_of_three_intervals_and_50_ms(lost, pieces):
    epochs, _ = read(table(torque_nm=lacking(slice(200, 200 + lost))))
    assert len(epochs) == pieces


def test_gaps_are_looked_for_in_each_epoch_by_itself():
    time_s = np.arange(1000) / 100
    time_s[500:] += 15  # the rest between two epochs was not recorded
    time_s[700:] += 1
    epochs, notices = read(table(time_s=time_s, epoch=np.repeat([1.0, 2.0], 500)))
    assert lengths(epochs) == [("1", 500), ("2a", 200), ("2b", 300)]
    assert len(notices) == 1


def test_a_gap_between_epochs_of_one_length_is_told():
    time_s = np.arange(1000) / 100
    time_s[500:] += 0.3
    epochs, notices = read(table(time_s=time_s), epoch_length_s=5.0)
    assert lengths(epochs) == [("1", 500), ("2", 470)]
    assert ["between epochs 1 and 2" in notice.text for notice in notices] == [True, False]


def test_missing_ends_shorten_the_epoch():
    rows = np.r_[0:20, 990:1000]
    epochs, notices = read(table(torque_nm=lacking(rows)))
    assert lengths(epochs) == lengths(epochs, "angle_rad") == [("1", 970)]
    assert {notice.level for notice in notices} == {"error"}
    assert "30 samples" in notices[1].text


def test_samples_missing_during_rest_are_no_fault():
    labels = np.repeat([1.0, NAN, 2.0], [400, 200, 400])
    epochs, notices = read(table(torque_nm=lacking(slice(420, 500)), epoch=labels))
    assert lengths(epochs) == [("1", 400), ("2", 400)]
    assert notices == []


@pytest.mark.parametrize(("step", "phase"), [(2, 0), (2, 1), (10, 9), (40, 13)])
def test_a_sensor_on_every_kth_row_is_slower_not_faulty(step, phase):
    angle = np.full(1000, NAN)
    angle[phase::step] = 0.1
    (epoch,), notices = read(table(angle_rad=angle))
    assert notices == []
    assert epoch.channels["angle_rad"].rate_hz == pytest.approx(100 / step)
    assert len(epoch.channels["torque_nm"]) == 1000


def test_a_slow_sensor_that_loses_samples_is_faulty():
    angle = np.full(1000, NAN)
    angle[::2] = 0.1
    angle[300] = NAN
    angle[400] = np.inf
    (epoch,), (notice,) = read(table(angle_rad=angle))
    assert "angle_rad has 2 samples missing or not finite" in notice.text
    assert len(epoch.channels["angle_rad"]) == 498


def interleaved(rates_hz, phases_s, duration_s=20.0):
    """Sensors on clocks of their own in one table, each filling its own rows."""
    clocks = [np.arange(p, duration_s, 1 / r) for r, p in zip(rates_hz, phases_s, strict=True)]
    time_s = np.unique(np.concatenate(clocks))
    columns = {"time_s": time_s}
    for name, clock in zip(("torque_nm", "angle_rad"), clocks, strict=True):
        columns[name] = np.full(time_s.size, NAN)
        columns[name][np.searchsorted(time_s, clock)] = 0.5
    return Table("r.csv", columns)


@pytest.mark.parametrize(
    "rates_hz", [(1000, 1000), (1000, 900), (1000, 100), (100, 1000), (500, 37)]
)
@pytest.mark.parametrize("phases_s", [(0.0, 0.0003), (0.0003, 0.0), (0.0, 0.0007)])
@pytest.mark.parametrize("epoch_length_s", [None, 5.0])
def test_interleaved_clocks_are_no_fault(rates_hz, phases_s, epoch_length_s):
    data = interleaved(rates_hz, phases_s)
    epochs, notices = read(data, epoch_length_s=epoch_length_s)
    assert notices == []
    assert len(epochs) == (4 if epoch_length_s else 1)
    for name in ("torque_nm", "angle_rad"):
        total = sum(len(epoch.channels[name]) for epoch in epochs)
        assert total == np.count_nonzero(np.isfinite(data.columns[name]))


def test_a_gap_between_interleaved_clocks_is_a_warning():
    data = interleaved((1000, 1000), (0.0, 0.0003))
    kept = (data.columns["time_s"] < 7) | (data.columns["time_s"] > 8)
    data = Table("r.csv", {name: values[kept] for name, values in data.columns.items()})
    epochs, notices = read(data)
    assert [epoch.label for epoch in epochs] == ["1a", "1b"]
    assert {notice.level for notice in notices} == {"warning"}


def test_a_dropout_between_interleaved_clocks_is_an_error():
    data = interleaved((1000, 1000), (0.0, 0.0003))
    time_s = data.columns["time_s"]
    data.columns["torque_nm"][(time_s > 7) & (time_s < 8)] = NAN
    epochs, notices = read(data)
    assert [epoch.label for epoch in epochs] == ["1a", "1b"]
    assert {notice.level for notice in notices} == {"error"}
    assert "torque_nm has 999 samples missing" in notices[-1].text


@pytest.mark.parametrize("name", ["torque_nm", "angle_rad"])
def test_a_required_column_without_numbers_is_refused(name):
    with pytest.raises(UserError, match=rf"r\.csv: {name} has no number in any row"):
        read(table(**{name: np.full(1000, NAN)}))


@pytest.mark.parametrize("name", ["velocity_rad_s", "perturbation_nm"])
def test_an_optional_column_without_numbers_is_left_out_aloud(name):
    (epoch,), (notice,) = read(table(**{name: np.full(1000, NAN)}))
    assert name not in epoch.channels
    assert notice.level == "error"
    assert f"{name} has no number in any row; it was left out" in notice.text


def test_an_epoch_without_torque_is_not_read_but_the_others_are():
    labels = np.repeat([1.0, 2.0], 500)
    (epoch,), (notice,) = read(table(torque_nm=lacking(slice(0, 500)), epoch=labels))
    assert epoch.label == "2"
    assert notice.level == "error"
    assert "epoch 1: torque_nm has no number in any row; the epoch was not read" in notice.text


def test_nothing_left_is_refused_with_the_reason():
    labels = np.repeat([1.0, NAN], [500, 500])
    with pytest.raises(UserError, match=r"nothing is left to read \(.*epoch 1: torque_nm has no"):
        read(table(torque_nm=lacking(slice(0, 500)), epoch=labels))


def test_a_lone_sample_between_gaps_is_left_out_aloud():
    time_s = np.arange(1000) / 100
    time_s[400:] += 0.5
    time_s[401:] += 0.5
    epochs, notices = read(table(time_s=time_s))
    assert lengths(epochs) == [("1a", 400), ("1b", 599)]
    assert any("fewer than 2 samples from 4.5 s to 4.5 s" in notice.text for notice in notices)
