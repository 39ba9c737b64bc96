"""Traces from the ring: least and largest of each few ticks, none twice, none torn."""

import math

import numpy as np
import pytest

from rigidimeter.core.session import Sample
from rigidimeter.core.settings import OnlineSettings
from rigidimeter.rig.acquisition.processes import SampleRing
from rigidimeter.rig.console import AT_ONCE, BandTorque, TraceReader

RATE_HZ = 1000.0


@pytest.fixture
def ring():
    ring = SampleRing.create(capacity=200)
    yield ring
    ring.memory.unlink()
    ring.close()


def push(ring, first, stop, torque=lambda k: float(k), epoch=None):
    for k in range(first, stop):
        ring.recorded = ring.written
        of = k // 50 if epoch is None else epoch
        values = (k, k / RATE_HZ, 0.0, of, 0.0, torque(k), 0.0, 0.1, *[0.0] * 5, 0)
        assert ring.push(Sample(*values))


def test_each_piece_has_its_least_and_largest_value_and_comes_once(ring):
    reader = TraceReader(ring, RATE_HZ, points_per_s=250.0)
    push(ring, 0, 10, lambda k: (-1.0) ** k * k)
    traces = reader.read()
    assert traces.time_s.tolist() == [0.0, 0.004]  # ticks 8 and 9 wait for theirs
    assert traces.low["torque_nm"].tolist() == [-3.0, -7.0]
    assert traces.high["torque_nm"].tolist() == [2.0, 6.0]
    push(ring, 10, 12)
    traces = reader.read()
    assert traces.time_s.tolist() == [0.008]
    assert traces.low["torque_nm"].tolist() == [-9.0]
    assert reader.read().time_s.size == 0


def test_in_pieces_or_at_once_it_is_the_same(ring):
    torque = np.random.default_rng(1).normal(size=120).tolist()
    whole, parts = TraceReader(ring, RATE_HZ), TraceReader(ring, RATE_HZ)
    found = []
    for k in range(120):
        push(ring, k, k + 1, torque.__getitem__)
        if k % 7 == 0:
            found.append(parts.read())
    found.append(parts.read())
    at_once = whole.read()
    for name in ("torque_nm", "angle_rad"):
        np.testing.assert_array_equal(
            np.concatenate([traces.low[name] for traces in found]), at_once.low[name]
        )
    low = np.reshape(torque, (30, 4)).min(axis=1)
    np.testing.assert_array_equal(at_once.low["torque_nm"], low)
    assert at_once.epoch[[0, 11, 12, 29]].tolist() == [0, 0, 1, 2]  # of the last sample


def test_a_tick_that_was_left_out_leaves_its_piece_shorter(ring):
    reader = TraceReader(ring, RATE_HZ)
    push(ring, 0, 2)
    push(ring, 6, 8)
    traces = reader.read()
    assert traces.time_s.tolist() == [0.0, 0.006]
    assert traces.high["torque_nm"].tolist() == [1.0, 7.0]


def test_no_number_is_a_gap_in_the_trace_and_not_a_peak(ring):
    reader = TraceReader(ring, RATE_HZ)
    push(ring, 0, 4, lambda k: math.nan)
    push(ring, 4, 8, lambda k: math.inf if k == 5 else 1.0)
    traces = reader.read()
    assert math.isnan(traces.low["torque_nm"][0])
    assert traces.high["torque_nm"][1] == 1.0


def test_one_that_comes_too_late_says_how_much_it_missed_and_goes_on(ring):
    reader = TraceReader(ring, RATE_HZ)
    push(ring, 0, 6)
    reader.read()
    push(ring, 6, 1000)
    traces = reader.read()
    assert traces.missed == 1000 - 199 - 6
    assert traces.time_s[0] == pytest.approx(0.801)  # not joined to what it had kept
    assert traces.time_s[-1] == pytest.approx(0.996)


def test_the_past_that_is_still_there_comes_with_the_first_call(ring):
    push(ring, 0, 100)
    assert TraceReader(ring, RATE_HZ).read().time_s.size == 0
    traces = TraceReader(ring, RATE_HZ, back_s=0.04).read()
    assert traces.time_s[[0, -1]].tolist() == [0.06, 0.096]
    assert traces.missed == 0
    assert TraceReader(ring, RATE_HZ, back_s=60.0).read().time_s[0] == 0.0


def test_what_is_drawn_one_over_the_other_is_of_one_sample(ring):
    band = BandTorque(OnlineSettings(), RATE_HZ)
    reader = TraceReader(ring, RATE_HZ, band=band)
    push(ring, 0, 10, lambda k: (-1.0) ** k * k)
    first = reader.read().first
    assert set(first) == set(AT_ONCE)
    assert first["torque_nm"].tolist() == [0.0, 4.0]
    assert np.isfinite(first["measured_nm"]).all()
    assert band.since_s == 0.0


def test_after_a_gap_the_filters_begin_anew(ring):
    """Also where the samples after it wait for the rest of their piece."""
    band = BandTorque(OnlineSettings(), RATE_HZ)
    reader = TraceReader(ring, RATE_HZ, points_per_s=5.0, band=band)
    push(ring, 0, 200, epoch=1)
    assert reader.read().time_s.size == 1
    begun_s = band.since_s
    push(ring, 200, 799, epoch=1)
    assert reader.read().missed > 0
    assert band.since_s == begun_s < 0.2  # nothing that came after it was complete
    push(ring, 799, 800, epoch=1)
    reader.read()
    assert band.since_s == 0.6
