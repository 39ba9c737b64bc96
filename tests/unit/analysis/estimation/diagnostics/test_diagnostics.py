"""Each check on an epoch that is sound, and on one in which what it looks for was put."""

import math
from dataclasses import replace

import numpy as np
import pytest
from tests.unit.analysis.estimation.diagnostics.sound_epoch import (
    SETTINGS,
    TRUTH,
    T,
    assert_failed,
    passed,
    perturbed,
    sound,
    with_channel,
)

from rigidimeter.analysis.estimation.diagnostics import (
    CHECKS,
    Case,
    Check,
    at_most,
    diagnose,
    fit_checks,
)
from rigidimeter.analysis.estimation.diagnostics.channel_checks import position_limit
from rigidimeter.analysis.estimation.diagnostics.fit_checks import (
    implausible_parameters,
    negative_parameters,
)
from rigidimeter.analysis.estimation.diagnostics.movement_checks import active_movement
from rigidimeter.analysis.estimation.found import found
from rigidimeter.analysis.study import estimate
from rigidimeter.core.findings import KINDS, STUDY_KINDS, Kind, explained
from rigidimeter.core.records import Channel

__all__ = ["sound"]


def test_a_sound_epoch_passes_every_check(sound):
    case = Case(*sound, SETTINGS, 1.0)
    assert diagnose(case) == ()
    assert sum(check.looks(case) is not None for check in CHECKS) > 12


def test_a_value_beyond_its_limit_does_not_read_as_the_limit():
    most, least = SETTINGS.max_position_percent, SETTINGS.min_r_squared
    assert (most, least) == (98.0, 0.3)
    near = Channel("angle_rad", T, np.full(T.size, 0.49021))
    look = position_limit(near, 0.5, SETTINGS)
    assert_failed(look)
    finding = found("position_limit", SETTINGS, look.value, look.limit, facts=look.facts)
    assert "98.04 % of the position limit of 28.6° (at most 98 %)" in finding.details
    low = found("r_squared", SETTINGS, 0.2996, 0.3)
    assert low.details.startswith("R² is 0.2996 (at least 0.3).")
    assert not fit_checks.r_squared(0.3, SETTINGS).failed


def test_negative_parameters_are_named_with_what_is_likely():
    assert passed(negative_parameters(TRUTH))
    one = negative_parameters((0.0045, -0.1, 1.7))
    assert_failed(one, names="B")
    turned = negative_parameters((-0.0045, -0.1, -1.7))
    assert_failed(turned, "reaction", names="J and B and K")
    assert negative_parameters((math.nan, 1.0, 1.0)).value == 1.0
    by_noise = negative_parameters((-4e-4, -0.007, -0.12), np.array([8e-4, 0.03, 0.14]))
    assert_failed(by_noise, "noise", names="J and B and K")


@pytest.mark.parametrize(
    ("parameters", "size", "side", "factor"),
    [
        ((5.0, 0.1, 1.0), "J 5 kg·m²", "large", 5.0),
        ((1e-6, 0.1, 1.0), "J 1e-06 kg·m²", "small", 10.0),
        ((-1e-6, 0.1, 1.0), "J -1e-06 kg·m²", "small", 10.0),
        ((0.01, 100.0, 1.0), "B 100 N·m·s/rad", "large", 2.0),
        ((0.01, 0.1, 6000.0), "K 6000 N·m/rad", "large", 3.0),
    ],
)
def test_sizes_that_no_joint_has_are_told(parameters, size, side, factor):
    look = implausible_parameters(parameters, SETTINGS)
    assert_failed(look, side=side)
    assert "{symbol} {size:g} {size_unit}".format(**look.facts) == size
    assert look.value == pytest.approx(factor)


LOUD = Kind(
    "loud",
    "peak",
    "Peak {value:.1f} N·m",
    "A peak.",
    "That is much.",
    "Push less.",
    "N·m",
    "exclude",
)


def test_a_check_from_outside_brings_its_kind(sound, monkeypatch):
    def loud(case):
        peak_nm = float(np.max(np.abs(case.epoch.channels["torque_nm"].values)))
        return at_most(peak_nm, 0.01)

    toy, never = Check("loud", ("torque_nm",), loud), Check("never", ("emg_v",), loud)
    monkeypatch.setitem(KINDS, "loud", LOUD)
    seen = {f.name: f for f in diagnose(Case(*sound, SETTINGS), checks=[*CHECKS, toy, never])}
    assert (seen["loud"].level, seen["loud"].unit) == ("exclude", "N·m")
    assert seen["loud"].remedy == "Push less."
    assert "never" not in seen


@pytest.mark.parametrize("late", [(2,), (2, 2), (0, 2)])
def test_what_all_epochs_share_is_said_of_their_pool_too(late):
    """A velocity 10 ms late takes K τ off B of each epoch, which does not average out."""
    epochs = []
    for seed, samples in enumerate(late):
        epoch = replace(perturbed(seed), label=str(seed))
        velocity = np.roll(epoch.channels["velocity_rad_s"].values, samples)
        epochs.append(with_channel(epoch, "velocity_rad_s", velocity))
    analysis = estimate(epochs, "iv")
    own, (pool,) = analysis.fits, analysis.pooled
    found = [one for one in pool.findings if one.name == "velocity_delay"]
    if not all(late):
        assert found == []
        return
    (finding,) = found
    of_each = [one for fit in own for one in fit.findings if one.name == "velocity_delay"]
    worst = max(of_each, key=lambda one: one.value)
    assert finding == replace(worst, epochs=tuple(fit.epoch for fit in own))


def test_sentences_of_findings_hold_for_an_axis_on_a_bench_too():
    """Only an EMG says that there is a person, and what compares recordings may name subjects."""
    for kind in KINDS.values():
        if kind.name != "emg_activity" and kind not in STUDY_KINDS:
            for _, words in explained(kind):
                assert "subject" not in " ".join(words)


def test_what_is_much_for_an_elbow_is_little_for_an_ankle(sound):
    signals = sound[1]
    own = 0.5 * np.sin(2 * np.pi * signals.time_s)
    assert active_movement(own, signals, SETTINGS).value > 80.0
    ankle = replace(signals, torque_nm=20 * signals.torque_nm)
    assert active_movement(own, ankle, SETTINGS).value == 0.0
