"""Traces of epochs: few points, but enough; and what tables say of channels."""

import base64
import dataclasses

import numpy as np

from rigidimeter.analysis.report import Shown
from rigidimeter.analysis.traces import EpochTrace, channel_facts, epoch_traces
from rigidimeter.core.records import Channel

HIGHEST_HZ = 10.0
"""Of the perturbation."""


def traces_of(shown: Shown) -> list[EpochTrace]:
    return list(epoch_traces(shown.analysis, shown.as_analysed, shown.study.settings))


def points(series: tuple[float, str]) -> np.ndarray:
    unit, text = series
    return unit * np.frombuffer(base64.b64decode(text), "<i2")


def test_every_epoch_with_numbers_has_traces_whose_residual_is_torque_less_model(
    study: Shown,
) -> None:
    traces = traces_of(study)
    analysed = (*study.analysis.fits, *study.analysis.scores)
    assert [(one.source, one.epoch) for one in traces] == [(o.source, o.epoch) for o in analysed]
    for one in traces:
        torque = points(one.series["torque"])
        assert torque.size <= 800
        assert one.shown_s == one.length_s > 7.0
        assert one.step_s <= 1 / (3 * HIGHEST_HZ)
        if "residual" in one.series:  # the joint obeys Eq. 3
            assert np.std(points(one.series["residual"])) < 0.2 * np.std(torque)


def test_a_trace_is_the_signal_to_half_a_step_of_16_bits(study: Shown) -> None:
    one = next(trace for trace in traces_of(study) if "residual" not in trace.series)
    epoch = next(e for e in study.epochs if (e.source, e.label) == (one.source, one.epoch))
    unit, _ = one.series["angle"]
    angle_deg = points(one.series["angle"])
    time_s = one.start_s + one.step_s * np.arange(angle_deg.size)
    recorded = epoch.channels["angle_rad"]
    expected = np.interp(time_s, recorded.time_s - recorded.time_s[0], recorded.values)
    assert np.max(np.abs(angle_deg - np.degrees(expected))) < 0.3  # what the filter changes
    assert unit < 1e-4 * np.max(np.abs(angle_deg))


def test_more_than_the_points_can_show_is_left_away_at_the_end(make_study, study: Shown) -> None:
    epoch = study.epochs[1]
    again = {
        name: Channel(
            name,
            np.concatenate([one.time_s + 20.0 * k for k in range(4)]),
            np.tile(one.values, 4),
        )
        for name, one in epoch.channels.items()
    }
    (one,) = traces_of(make_study([dataclasses.replace(epoch, channels=again)]))
    assert points(one.series["torque"]).size == 800
    assert one.step_s <= 1 / (3 * HIGHEST_HZ)
    assert one.shown_s < one.length_s


def test_facts_of_channels_hold_without_samples(study: Shown) -> None:
    empty = Channel("angle_rad", np.empty(0), np.empty(0))
    gap = Channel("torque_nm", np.array([0.0, 1.0, 2.0]), np.array([1.0, np.nan, -3.0]))
    epoch = dataclasses.replace(study.epochs[0], channels={"angle_rad": empty, "torque_nm": gap})
    ((angle, torque),) = channel_facts([epoch])
    assert np.isnan([angle.span_s, angle.lowest, angle.highest]).all()
    assert (torque.span_s, torque.lowest, torque.highest) == (2.0, -3.0, 1.0)
