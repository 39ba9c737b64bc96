"""What holds for every maximal-length sequence, band, sinusoid and protocol."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rigidimeter.core.settings import (
    BlockSettings,
    GuardSettings,
    PrbsSettings,
    ProtocolSettings,
    SinusoidSettings,
)
from rigidimeter.model import JointDynamics
from rigidimeter.planning import (
    check_band,
    corners,
    demand,
    line_spacing_hz,
    plan,
    plateau_n2m2_hz,
    power_spectrum,
    prbs_levels,
    prbs_nm,
    sinusoid,
)

bits = st.integers(3, 12)


@given(bits)
def test_balance_one_more_high_than_low(n: int) -> None:
    levels = prbs_levels(n)
    assert levels.size == 2**n - 1
    assert set(levels.tolist()) == {-1.0, 1.0}
    assert levels.sum() == 1.0


@given(bits)
def test_run_lengths_halve(n: int) -> None:
    levels = prbs_levels(n)
    start = int(np.flatnonzero(np.diff(levels))[0]) + 1  # a run begins here, also around the end
    runs = [(level, len(list(run))) for level, run in itertools.groupby(np.roll(levels, -start))]
    for length in range(1, n - 1):
        for level in (-1.0, 1.0):
            assert runs.count((level, length)) == 2 ** (n - 2 - length)
    assert runs.count((1.0, n)) == 1
    assert runs.count((-1.0, n - 1)) == 1
    assert len(runs) == 2 ** (n - 1)


@given(bits)
def test_autocorrelation_is_one_level_off_its_peak(n: int) -> None:
    levels = prbs_levels(n)
    spectrum = np.abs(np.fft.fft(levels)) ** 2
    correlation = np.fft.ifft(spectrum).real / levels.size
    assert correlation[0] == pytest.approx(1.0)
    np.testing.assert_allclose(correlation[1:], -1.0 / levels.size, atol=1e-9)


@given(bits)
def test_every_window_of_n_chips_occurs_once(n: int) -> None:
    high = prbs_levels(n) > 0
    windows = sum(np.roll(high, -shift).astype(int) << shift for shift in range(n))
    assert sorted(windows.tolist()) == list(range(1, 2**n))


@given(
    bits,
    st.floats(0.5, 100.0),
    st.floats(100.0, 2000.0),
    st.floats(0.01, 50.0),
    st.floats(25.0, 40.0),
)
def test_two_levels_of_zero_mean(
    n: int, clock_hz: float, rate_hz: float, amplitude_nm: float, duration_s: float
) -> None:
    settings = PrbsSettings(
        register_bits=n, clock_hz=clock_hz, amplitude_nm=amplitude_nm, duration_s=duration_s
    )
    torque = prbs_nm(settings, rate_hz)
    assert abs(torque.size - duration_s * rate_hz) <= 0.5 + 1e-6
    low, high = np.unique(torque)
    assert high - low == pytest.approx(2 * amplitude_nm, rel=1e-12)
    assert abs(math.fsum(torque)) <= 1e-12 * amplitude_nm * torque.size
    # chips last a whole number of ticks, one more or less than the clock says
    changes = np.flatnonzero(np.diff(torque)) + 1
    chips = np.diff(changes) * clock_hz / rate_hz
    assert np.all(np.abs(chips - np.round(chips)) <= clock_hz / rate_hz + 1e-9)


@given(bits, st.integers(1, 20), st.floats(0.1, 10.0))
def test_the_lines_of_whole_periods_follow_the_plateau(
    n: int, ticks_per_chip: int, amplitude_nm: float
) -> None:
    chips = 2**n - 1
    settings = PrbsSettings(
        register_bits=n, clock_hz=chips / 16, amplitude_nm=amplitude_nm, duration_s=16.0
    )
    rate_hz = settings.clock_hz * ticks_per_chip
    spectrum = power_spectrum(prbs_nm(settings, rate_hz), rate_hz)
    assert spectrum.frequency_hz[1] == pytest.approx(line_spacing_hz(settings))
    variance = np.sum(spectrum.density_n2m2_hz) * spectrum.frequency_hz[1]
    assert variance == pytest.approx(amplitude_nm**2 * (1 - 1 / chips**2))
    x = 1 / chips
    hold = np.sinc(x) / np.sinc(x / ticks_per_chip)
    assert spectrum.density_n2m2_hz[1] == pytest.approx(plateau_n2m2_hz(settings) * hold**2)


@given(
    bits,
    st.floats(1.0, 100.0),
    st.floats(20.0, 60.0),
    st.floats(0.02, 5.0),
    st.floats(1.01, 20.0),
)
def test_what_the_verdict_suggests_covers_the_band(
    n: int, clock_hz: float, duration_s: float, low_hz: float, factor: float
) -> None:
    settings = PrbsSettings(
        register_bits=n,
        clock_hz=clock_hz,
        duration_s=duration_s,
        wanted_low_hz=low_hz,
        wanted_high_hz=low_hz * factor,
    )
    check = check_band(settings, 200.0)
    assert check.covered == ("To cover it" not in check.verdict)
    assert check.covered == (check.enough == settings and check.enough_rate_hz == 200.0)
    assert check_band(check.enough, check.enough_rate_hz).covered
    PrbsSettings.model_validate(check.enough.model_dump())


@given(st.floats(0.001, 1.0), st.floats(0.01, 1.0), st.floats(0.1, 10.0), st.floats(1.0, 99.0))
def test_one_factor_on_all_three_leaves_the_bandwidth(
    inertia: float, damping: float, stiffness: float, uncertainty: float
) -> None:
    table = corners(JointDynamics(inertia, damping, stiffness), uncertainty)
    nominal_hz = table.nominal.bandwidth_hz
    assert table.equation_8.bandwidth_hz == pytest.approx(nominal_hz)
    assert table.corners[-1].bandwidth_hz == pytest.approx(nominal_hz)
    assert min(one.bandwidth_hz for one in table.corners) <= nominal_hz * (1 + 1e-12)
    assert table.widest.bandwidth_hz >= nominal_hz * (1 - 1e-12)


@given(st.floats(0.1, 5.0), st.floats(0.5, 60.0), st.floats(0.2, 5.0))
def test_a_tapered_sinusoid_never_jumps(
    frequency_hz: float, amplitude_deg: float, taper_s: float
) -> None:
    settings = SinusoidSettings(
        frequency_hz=frequency_hz, amplitude_deg=amplitude_deg, taper_s=taper_s
    )
    rate_hz = 1000.0
    angle, velocity = sinusoid(settings, rate_hz)
    amplitude = math.radians(amplitude_deg)
    omega, taper = 2 * math.pi * frequency_hz, math.pi / taper_s
    most = amplitude * (omega**2 + omega * taper + taper**2 / 2)
    needs = demand(angle, velocity, rate_hz, GuardSettings())
    assert needs.peak_acceleration_rad_s2 <= most
    assert np.max(np.abs(np.diff(angle))) * rate_hz <= amplitude * (omega + taper / 2)
    assert needs.peak_angle_rad <= amplitude


@given(
    st.lists(
        st.tuples(
            st.sampled_from(["prbs", "sinusoid"]),
            st.sampled_from(["OFF", "DBS"]),
            st.integers(1, 20),
        ),
        min_size=1,
        max_size=6,
    ),
    st.integers(0, 2**32 - 1),
)
def test_a_plan_keeps_every_epoch_and_can_be_made_again(
    blocks: list[tuple[str, str, int]], seed: int
) -> None:
    settings = ProtocolSettings(
        blocks=[
            BlockSettings.model_validate({"task": task, "condition": condition, "epochs": epochs})
            for task, condition, epochs in blocks
        ]
    )
    session = plan(settings, PrbsSettings(), SinusoidSettings(), seed)
    assert session == plan(settings, PrbsSettings(), SinusoidSettings(), seed)
    assert sum(session.counts.values()) == len(session.epochs) == sum(b[2] for b in blocks)
    assert [epoch.label for epoch in session.epochs] == [
        str(number) for number in range(1, len(session.epochs) + 1)
    ]
    assert {epoch.rest_s for epoch in session.epochs} <= set(settings.rests_s)
    assert session.total_s == pytest.approx(
        sum(epoch.duration_s + settings.return_s + epoch.rest_s for epoch in session.epochs)
    )
