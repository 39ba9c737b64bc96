"""The tests of the lack of fit: Fisher's distribution for noise, and what was put in is found."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy import signal, stats

from rigidimeter.analysis.estimation import fit_epochs, method_named
from rigidimeter.analysis.estimation.closedloop.grid import epoch_grid
from rigidimeter.analysis.estimation.closedloop.lack_of_fit import (
    Answer,
    periodic,
    proportional,
    repeated,
    same_sequence,
)
from rigidimeter.analysis.estimation.closedloop.observation import Observation
from rigidimeter.analysis.estimation.diagnostics.together import checked_together, misfits
from rigidimeter.analysis.estimation.prepared import prepare
from rigidimeter.core.records import Channel, Epoch

TIME_S = np.arange(2000) / 100.0


def grid():
    channels = {n: Channel(n, TIME_S, np.zeros(2000)) for n in ("torque_nm", "angle_rad")}
    return epoch_grid(Epoch("made", "1", channels), (0.15, 20.0), 1.0)


def observed(layout):
    """Return an epoch of which nothing but its lines matters."""
    return Observation(layout, None, None)


def noise(rng, size, slope=0.0):
    lines = rng.standard_normal(size) + 1j * rng.standard_normal(size)
    return lines * np.arange(1, size + 1) ** slope


def answers(rng, count, factor=0.0, own=0.0, slope=0.0):
    """Return answers to one sequence with a share in proportion and one of the sequence's own."""
    layout = grid()
    seen = observed(layout)
    m = layout.omega_rad_s.size
    response, again = 10.0 * noise(rng, m), own * noise(rng, m)
    return [
        Answer(seen, response, factor * response + again + noise(rng, m, slope))
        for _ in range(count)
    ]


TESTS = {
    "proportional": proportional,
    "repeated": repeated,
    "periodic": lambda made: periodic(made[0], np.arange(made[0].grid.line.size) % 3 == 0),
}


@pytest.mark.parametrize("slope", [0.0, -1.0])
@pytest.mark.parametrize("test", TESTS)
def test_of_noise_the_probability_is_evenly_distributed(test, slope):
    rng = np.random.default_rng(5)
    p = [part.p for _ in range(100) for part in TESTS[test](answers(rng, 3, slope=slope))]
    assert len(p) == 300
    assert stats.kstest(p, "uniform").pvalue > 1e-3


def test_what_answers_in_proportion_is_measured():
    parts = proportional(answers(np.random.default_rng(1), 2, factor=0.2j))
    assert [part.share for part in parts] == pytest.approx([0.2] * 3, rel=0.15)
    assert max(part.p for part in parts) < 1e-6


def test_what_comes_again_without_proportion_needs_the_sequence_again():
    made = answers(np.random.default_rng(1), 4, own=2.0)
    assert [part.share for part in repeated(made)] == pytest.approx([0.2] * 3, rel=0.2)
    assert max(part.p for part in repeated(made)) < 1e-6


def with_hum(answer, rng):
    """A hum of one frequency between two lines, at a phase of its own in each epoch."""
    own = answer.residual_nm.copy()
    own[199:202] += 60.0 * np.exp(2j * np.pi * rng.random()) * np.array([-0.5, 1.0, -0.5])
    return answer._replace(residual_nm=own)


def with_drift(answer, rng):
    """A torque that drifts along a parabola of its own in each epoch."""
    along = np.linspace(-1.0, 1.0, answer.grid.time_s.size)
    first, second = rng.standard_normal(2)
    drift = answer.grid.transform(3.0 * first * along + 1.5 * second * along**2)
    return answer._replace(residual_nm=answer.residual_nm + drift)


@pytest.mark.parametrize("with_it", [with_hum, with_drift])
def test_a_hum_or_a_drift_does_not_come_again(with_it):
    rng = np.random.default_rng(4)
    made = [[with_it(one, rng) for one in answers(rng, 4)] for _ in range(150)]
    p = np.array([min(part.p for part in repeated(one)) for one in made])
    assert np.mean(p < 1e-3) <= 0.02  # 12 to 16 % with nothing done about them
    assert (
        max(part.p for part in repeated([with_it(a, rng) for a in answers(rng, 4, own=1.0)])) < 1e-6
    )


def test_the_share_is_that_where_it_can_be_seen():
    rng = np.random.default_rng(6)
    tremor = np.ones(grid().line.size)
    tremor[80:95] = 1e4
    made = [
        one._replace(residual_nm=0.05 * one.response_nm + tremor * noise(rng, tremor.size))
        for one in answers(rng, 4)
    ]
    assert [part.share for part in proportional(made)] == pytest.approx([0.05] * 3, rel=0.15)


def test_a_sequence_that_begins_a_moment_later_is_the_same():
    rng = np.random.default_rng(2)
    first, other = answers(rng, 1, own=2.0)[0], answers(rng, 1)[0]
    late = np.exp(-1j * first.grid.omega_rad_s * 0.0123)
    moved = Answer(first.observation, first.response_nm * late, first.residual_nm * late)
    louder = Answer(first.observation, 1.001 * first.response_nm, first.residual_nm)
    groups = same_sequence([first, other, moved, louder])
    assert [len(group) for group in groups] == [3, 1]
    assert all(part.share > 0.15 for part in repeated(groups[0]))


def softened(epoch, cutoff_hz=12.0):
    """Pass the torque through a low-pass that its stamps do not know of."""
    torque = epoch.channels["torque_nm"]
    sos = signal.butter(1, cutoff_hz, fs=torque.rate_hz, output="sos")
    smooth = Channel("torque_nm", torque.time_s, signal.sosfilt(sos, torque.values))
    return replace(epoch, channels={**epoch.channels, "torque_nm": smooth})


def jittered(epoch, number):
    """Move all stamps by a part of a tick, and each of them by up to 0.1 µs."""
    rng = np.random.default_rng(number)
    channels = {}
    for name, channel in epoch.channels.items():
        stamps = channel.time_s + 1e-4 * number + rng.uniform(-1e-7, 1e-7, len(channel))
        channels[name] = Channel(name, stamps, channel.values)
    return replace(epoch, channels=channels)


def found(prepared, method):
    estimator = method_named(method)
    fits, pooled = estimator.fit(prepared, None, lambda _: None, True)
    return checked_together(prepared, fits, pooled, estimator)[:2]


@pytest.mark.parametrize("method", ["iv", "bandlimited"])
@pytest.mark.parametrize("voluntary_sd_nm", [0.0, 0.2])
def test_a_joint_of_three_parameters_leaves_noise(simulated, voluntary_sd_nm, method):
    settings, epochs = simulated(3, voluntary_sd_nm=voluntary_sd_nm, seed=4)
    for fits in found(prepare(epochs, settings), method):
        assert {f.name for fit in fits for f in fit.findings} <= {"loop_bias"}


@pytest.fixture(scope="module")
def softened_epochs(simulated):
    """Return epochs whose drive and delay the methods find once for all of them."""
    settings, epochs = simulated(3, voluntary_sd_nm=0.1, seed=4)
    return prepare([softened(epoch) for epoch in epochs], settings)


@pytest.mark.parametrize("method", ["iv", "spectral", "bandlimited"])
def test_what_is_not_the_joint_is_told_in_each_epoch_and_of_all(softened_epochs, method):
    fits, pooled = found(softened_epochs, method)
    for fit in (*fits, *pooled):
        (finding,) = (f for f in fit.findings if f.name == "lack_of_fit")
        assert finding.level == "caution"
        assert finding.value > finding.limit
        assert finding.p < 1e-4
        assert all(math.isfinite(finding.facts[f"half_{name}"]) for name in "JBK")
        assert (finding.condition, len(finding.epochs)) == (fit.condition, len(fits))
        assert "band_sensitivity" in fit.cautions


@pytest.mark.parametrize("count", [1, 4])
def test_stamps_of_real_time_change_nothing(simulated, count):
    settings, epochs = simulated(count, seed=4)
    soft = [softened(epoch) for epoch in epochs]
    values = []
    for kind in (soft, [jittered(epoch, k) for k, epoch in enumerate(soft)]):
        fits, _ = found(prepare(kind, settings), "iv")
        found_in = [f for fit in fits for f in fit.findings if f.name == "lack_of_fit"]
        values.append([f.value for f in found_in])
        assert len(values[-1]) == count
    assert values[1] == pytest.approx(values[0], rel=0.05)


def test_an_epoch_that_does_not_count_has_no_findings_of_the_others(simulated):
    settings, epochs = simulated(2, seed=4)
    prepared = prepare([softened(epoch) for epoch in epochs], settings)
    fits, _ = fit_epochs([p.epoch for p in prepared], "iv", settings)
    out = replace(fits[0].outcome, kind="excluded", reason="by hand")
    iv = method_named("iv")
    first, second = checked_together(prepared, [replace(fits[0], outcome=out), fits[1]], [], iv)[0]
    assert first.findings == ()
    assert [f.name for f in second.findings] == ["lack_of_fit", "band_sensitivity"]


def test_without_a_perturbation_there_is_nothing_to_test(simulated):
    settings, (epoch,) = simulated(1)
    bare = {k: v for k, v in epoch.channels.items() if k != "perturbation_nm"}
    (prepared,) = prepare([replace(softened(epoch), channels=bare)], settings)
    (fit,), _ = fit_epochs([prepared.epoch], "bandlimited", settings)
    assert misfits([(prepared, fit)], method_named("bandlimited")) == ([], [])
