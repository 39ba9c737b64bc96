"""From columns to epochs: gaps, lost samples, slower sensors, labels, lengths and clocks."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from tests.known_joint import angle_rad, torque_nm

from rigidimeter.analysis.reading_anew import (
    Column,
    Columns,
    Interval,
    Mapping,
    Recording,
    mapping_of,
    recording_of,
    verdict,
)
from rigidimeter.core.errors import UserError

T = np.arange(4000) / 200.0
M, A = torque_nm(T, 1), angle_rad(T, 1)
LATE = np.where(T >= 10.0, T + 2.0, T)


def columns(time_s: np.ndarray = T, **more: np.ndarray) -> Columns:
    given = {"time_s": time_s, "torque_nm": torque_nm(time_s, 1), "angle_rad": angle_rad(time_s, 1)}
    return Columns("r", {name: Column.of(one) for name, one in (given | more).items()})


def read(file: Columns, said: Mapping | None = None, condition: str = "") -> Recording:
    return recording_of(file, verdict(file, said or Mapping()), condition)


def sizes(found: Recording, channel: str = "torque_nm") -> dict[str, int]:
    return {one.label: len(one.channels[channel]) for one in found.epochs}


def texts(found: Recording) -> str:
    return "\n".join(f"{one.level}: {one.text}" for one in found.notices)


def without(values: np.ndarray, rows: Sequence[int] | slice | np.ndarray) -> np.ndarray:
    left = values.copy()
    left[rows] = np.nan
    return left


def test_a_recording_without_gaps_is_one_epoch_that_copies_nothing() -> None:
    file = columns()
    found = read(file)
    channel = found.epochs[0].channels["torque_nm"]
    assert np.shares_memory(channel.values, file.columns["torque_nm"].read())
    assert sizes(found) == {"1": 4000}
    assert found.notices == ()


def test_a_gap_cuts_an_epoch_and_is_said() -> None:
    found = read(columns(LATE))
    assert sizes(found) == {"1a": 2000, "1b": 2000}
    assert "warning: r, epoch 1: there is a gap of 2.005 s from 9.995 s to 12 s" in texts(found)


def test_a_short_pause_of_a_slow_motion_is_bridged() -> None:
    steps = np.where(np.random.default_rng(1).random(1500) < 0.02, 0.12, 0.02)
    time_s = np.cumsum(steps)
    slow = np.sin(2 * np.pi * 0.7 * time_s) + 0.6 * np.sin(2 * np.pi * 1.9 * time_s)
    turned = np.gradient(slow, time_s) * 0.02 + 0.1 * slow
    found = read(
        columns(time_s, torque_nm=turned, angle_rad=0.1 * slow), mapping_of(missing="none")
    )
    assert len(found.epochs) == 1
    assert "the clock pauses" in texts(found)


def test_samples_that_are_lost_are_left_out_and_said() -> None:
    found = read(columns(torque_nm=without(M, [50, 51, 700])))
    assert sizes(found) == {"1": 3997}
    assert sizes(found, "angle_rad") == {"1": 4000}
    assert "error: r: torque_nm has 3 samples missing or not finite, in 2 runs" in texts(found)


def test_a_channel_that_is_lost_for_long_cuts_all() -> None:
    found = read(columns(torque_nm=without(M, slice(1000, 1200))))
    assert sizes(found) == {"1a": 1000, "1b": 2800}
    assert sizes(found, "angle_rad") == {"1a": 1000, "1b": 2800}
    assert "error: r, epoch 1: samples are missing for 1.005 s" in texts(found)


def test_a_slower_sensor_has_its_own_rows_and_lost_nothing() -> None:
    rest = np.flatnonzero(np.arange(T.size) % 4)
    found = read(columns(angle_rad=without(A, rest)))
    channel = found.epochs[0].channels["angle_rad"]
    assert np.array_equal(channel.time_s, T[::4])
    assert np.array_equal(channel.values, A[::4])
    assert found.notices == ()


@pytest.mark.parametrize("rows", [3, 4])
def test_a_sensor_that_repeats_its_samples_is_a_slower_one(rows: int) -> None:
    repeated = np.repeat(A[::rows], rows)[: T.size]
    found = read(columns(angle_rad=repeated))
    assert np.array_equal(found.epochs[0].channels["angle_rad"].time_s, T[::rows])
    assert f"holds each value for {rows} rows" in texts(found)


def test_straight_lines_between_samples_are_no_motion() -> None:
    lines = np.interp(T, T[::8], A[::8])
    found = read(columns(angle_rad=lines))
    assert np.array_equal(found.epochs[0].channels["angle_rad"].time_s[:-1], T[::8][:-1])
    assert "has straight lines of 8 rows" in texts(found)


def test_labels_are_epochs_and_rest_is_none() -> None:
    label = np.array(["1"] * 1000 + [""] * 500 + ["2"] * 1000 + ["1"] * 1500, dtype=object)
    found = read(columns(epoch=label))
    assert sizes(found) == {"1": 1000, "2": 1000, "1 (2)": 1500}
    assert "epoch 1 occurs again at 12.5 s" in texts(found)


def test_an_epoch_has_one_condition() -> None:
    epoch = np.repeat([1.0, 2.0], 2000)
    condition = np.array(["OFF"] * 3000 + ["DBS"] * 1000, dtype=object)
    found = read(columns(epoch=epoch, condition=condition))
    assert [one.condition for one in found.epochs] == ["OFF"]
    assert "condition changes from OFF to DBS within epoch 2" in texts(found)


def test_the_condition_of_the_file_comes_before_that_of_the_user() -> None:
    own = np.full(T.size, "OFF", dtype=object)
    assert read(columns(condition=own), condition="DBS").epochs[0].condition == "OFF"
    assert read(columns(), condition="DBS").epochs[0].condition == "DBS"


@pytest.mark.parametrize(
    ("length_s", "labels"), [(5.0, ["1", "2", "3", "4"]), (8.0, ["1", "2"]), (6.7, ["1", "2", "3"])]
)
def test_epochs_of_one_length(length_s: float, labels: list[str]) -> None:
    found = read(columns(), mapping_of(epoch_length_s=length_s))
    assert [one.label for one in found.epochs] == labels


def test_a_length_longer_than_the_recording_is_refused() -> None:
    with pytest.raises(UserError, match="less than one epoch of --epoch-length-s 30"):
        read(columns(), mapping_of(epoch_length_s=30.0))


def clocked(torque_s: np.ndarray, angle_s: np.ndarray) -> Columns:
    return Columns(
        "r",
        {
            "torque_nm": Column.of(torque_nm(torque_s, 1), clock="force"),
            "angle_rad": Column.of(angle_rad(angle_s, 1), clock="motion"),
        },
        {"force": torque_s, "motion": angle_s},
    )


def test_channels_with_clocks_of_their_own_have_their_own_stamps() -> None:
    slow_s = 0.0125 + np.arange(1998) / 100.0
    found = read(clocked(T, slow_s))
    (epoch,) = found.epochs
    assert np.array_equal(epoch.channels["torque_nm"].time_s, T)
    assert np.array_equal(epoch.channels["angle_rad"].time_s, slow_s)


def test_a_gap_of_one_clock_cuts_the_other_too() -> None:
    found = read(clocked(T, T[(T < 5) | (T > 8)] + 1e-4))
    ends = [one.channels["torque_nm"].time_s[[0, -1]] for one in found.epochs]
    assert np.allclose(ends, [[0.0, 4.995], [8.01, T[-1]]], atol=0.01)


def test_labels_by_time_hold_for_every_clock() -> None:
    file = clocked(T, T + 0.0021)
    spans = [(1.0, 6.0, "a"), (6.0, 9.0, ""), (9.5, 15.0, "b")]
    intervals = tuple(Interval(*span[:2], {"epoch": span[2]}) for span in spans)
    found = read(Columns(file.source, file.columns, file.clocks, intervals=intervals))
    assert [one.label for one in found.epochs] == ["a", "b"]
    for one, (start_s, stop_s) in zip(found.epochs, [(1.0, 6.0), (9.5, 15.0)], strict=True):
        for channel in one.channels.values():
            assert start_s - 1e-6 <= channel.time_s[0] < start_s + 0.01
            assert stop_s - 0.02 < channel.time_s[-1] <= stop_s + 1e-6


def test_a_time_that_goes_back_is_named_by_its_row() -> None:
    time_s = T.copy()
    time_s[1234] = time_s[1233]
    file = columns(time_s)
    lined = Columns(file.source, file.columns, lines=7)
    with pytest.raises(UserError, match=r"r, line 1241: time_s repeats 6\.165"):
        read(lined)


@pytest.mark.parametrize(
    ("file", "sentence"),
    [
        (columns(torque_nm=without(M, slice(None))), "torque_nm has no number in any row"),
        (columns(torque_nm=1e40 * M), "torque of .* is too large|the largest value of torque_nm"),
        (columns(epoch=np.full(T.size, "", dtype=object)), "the epoch column is empty"),
    ],
)
def test_what_makes_no_epoch_is_refused(file: Columns, sentence: str) -> None:
    with pytest.raises(UserError, match=sentence):
        read(file)


def test_emg_in_microvolts_is_said() -> None:
    emg = 500 * np.random.default_rng(1).normal(size=T.size)
    assert "looks like microvolts" in texts(read(columns(emg_v=emg)))


def test_a_label_on_one_clock_holds_until_the_next_on_it() -> None:
    every_s = np.arange(21.0)
    file = clocked(T, T + 0.0021)
    label = np.where(every_s < 9, "a", "b").astype(object)
    more = {**file.columns, "epoch": Column.of(label, clock="events")}
    found = read(Columns("r", more, {**file.clocks, "events": every_s}))
    assert [one.label for one in found.epochs] == ["a", "b"]
    starts = [one.channels["torque_nm"].time_s[0] for one in found.epochs]
    assert starts == pytest.approx([0.0, 9.0], abs=0.006)


def test_clocks_that_share_some_stamps_lose_no_sample() -> None:
    found = read(clocked(T, T[::2]))
    assert sizes(found) == {"1": 4000}
    assert sizes(found, "angle_rad") == {"1": 2000}
    assert found.notices == ()


def test_labels_of_a_long_recording() -> None:
    time_s = np.arange(160_000) / 1000.0
    label = np.repeat([1.0, 2.0], [130_000, 30_000])
    assert sizes(read(columns(time_s, epoch=label))) == {"1": 130_000, "2": 30_000}
