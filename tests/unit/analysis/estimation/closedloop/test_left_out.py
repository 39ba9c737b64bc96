"""The methods of the closed loop without a stretch in which the sensor hung or samples are lost."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rigidimeter.analysis.estimation.closedloop.drive_fit import SETTLED_S, fit_drive
from rigidimeter.analysis.estimation.closedloop.drive_motion import driven
from rigidimeter.analysis.estimation.diagnostics import checked
from rigidimeter.analysis.estimation.methods import method_named
from rigidimeter.analysis.estimation.prepared import prepare
from rigidimeter.analysis.estimation.stretches import bridged
from rigidimeter.core.records import LOST_SAMPLES, Channel, Epoch, LeftOut
from rigidimeter.model import DriveModel


def hung(epoch, after_s, for_s):
    torque = epoch.channels["torque_nm"]
    values = torque.values.copy()
    since_s = torque.time_s - torque.time_s[0]
    rows = (since_s >= after_s) & (since_s <= after_s + for_s)
    values[rows] = values[rows][0]
    changed = Channel("torque_nm", torque.time_s, values)
    return replace(epoch, channels={**epoch.channels, "torque_nm": changed})


@pytest.mark.parametrize("method", ["iv", "spectral"])
def test_the_rest_of_the_epoch_gives_the_joint(simulated, truth, method):
    settings, (epoch,) = simulated(1)
    (prepared,) = prepare([hung(epoch, 1.5, 0.5)], settings)
    (fit,), _ = method_named(method).fit([prepared], None, lambda _: None, False)
    fit = checked(prepared, fit)
    assert fit.outcome.included, fit.outcome.reason
    assert fit.value == pytest.approx(truth, rel=0.01)
    assert [found.level for found in fit.findings if found.name == "frozen"] == ["note"]
    whole = len(epoch.channels["torque_nm"])
    assert 0.5 * whole < fit.n_samples < 0.98 * whole


def without_samples(epoch, start_s, stop_s):
    """Return the epoch as it is read where a batch of it is damaged: no channel has anything."""
    channels = {}
    for name, channel in epoch.channels.items():
        kept = (channel.time_s <= start_s) | (channel.time_s >= stop_s)
        channels[name] = Channel(name, channel.time_s[kept], channel.values[kept])
    lost = LeftOut(start_s, stop_s, "batch 7 of samples.arrows is damaged", LOST_SAMPLES)
    return replace(epoch, channels=channels, left_out=(lost,))


@pytest.mark.parametrize("after_s", [1.0, 9.4])
@pytest.mark.parametrize(("method", "voluntary"), [("iv", 0.0), ("iv", 0.2), ("bandlimited", 0.0)])
def test_an_epoch_without_a_tenth_of_a_second_gives_what_the_whole_gives(
    simulated, method, voluntary, after_s
):
    settings, (epoch,) = simulated(1, voluntary)
    start_s = epoch.channels["torque_nm"].time_s[0] + after_s
    fits = []
    for each in (epoch, without_samples(epoch, start_s, start_s + 0.1)):
        (prepared,) = prepare([each], settings)
        (fit,), _ = method_named(method).fit([prepared], None, lambda _: None, False)
        fits.append(checked(prepared, fit))
    whole, part = fits
    assert part.outcome.included
    assert np.all(np.abs(part.value - whole.value) < 0.5 * (part.high - part.low))
    assert np.all(part.high - part.low < 2.0 * (whole.high - whole.low))
    named = {found.name: found for found in part.findings}
    assert named.keys() - {found.name for found in whole.findings} <= {LOST_SAMPLES}
    lost = named[LOST_SAMPLES]
    assert (lost.level, lost.facts["variant"], lost.limit) == ("note", "left_out", 50.0)
    assert (lost.value, lost.facts["lost_s"]) == pytest.approx((0.5, 0.1), rel=0.01)
    assert lost.facts["reason"].startswith("batch 7")
    assert lost.facts["spans"] == f"from {start_s:.4g} to {start_s + 0.1:.4g} s"
    assert lost.facts["used_s"] == pytest.approx(19.9, abs=0.01)


def test_an_epoch_of_which_most_is_lost_is_excluded(simulated):
    settings, (epoch,) = simulated(1)
    start_s = epoch.channels["torque_nm"].time_s[0] + 4.0
    (prepared,) = prepare([without_samples(epoch, start_s, start_s + 11.0)], settings)
    (fit,), _ = method_named("iv").fit([prepared], None, lambda _: None, False)
    fit = checked(prepared, fit)
    assert fit.outcome.kind == "excluded"
    assert "55 % of the epoch's samples are lost" in fit.outcome.reason


def test_periods_are_found_although_the_perturbation_is_not_known_throughout(simulated, truth):
    settings, (epoch,) = simulated(1)
    start_s = epoch.channels["torque_nm"].time_s[0] + 3.0
    (prepared,) = prepare([without_samples(epoch, start_s, start_s + 0.1)], settings)
    (fit,), _ = method_named("spectral").fit([prepared], None, lambda _: None, False)
    assert fit.value == pytest.approx(truth, rel=0.01)


@pytest.mark.parametrize("start_s", [0.7, 1.9])
def test_the_drive_is_found_although_commands_are_lost(start_s):
    """What a command that is not known did to the velocity is over after some poles' times."""
    commands = np.cumsum(np.random.default_rng(3).standard_normal(4000)) * 0.01
    ticks_s = np.arange(4000) / 1000.0
    command = Channel("velocity_command_rad_s", ticks_s, commands)
    velocity = driven(DriveModel.second_order(23.0, 0.6, 0.0042), command, ticks_s).velocity_rad_s
    moved = Channel("velocity_rad_s", ticks_s, velocity)
    epoch = Epoch("file", "1", {each.name: each for each in (command, moved)})
    found = fit_drive(
        bridged(without_samples(epoch, start_s, start_s + 0.1)),
        DriveModel.second_order(50.0, 0.7071),
    )
    (pole,) = found.model.poles_rad_s
    (true,) = DriveModel.second_order(23.0, 0.6).poles_rad_s
    # After SETTLED_S no more is left of what is not known than its share of the velocity.
    assert np.exp(true.real * SETTLED_S) < 1e-11
    assert pole == pytest.approx(true, rel=1e-6)
    assert found.model.delay_s == pytest.approx(0.0042, abs=1e-8)
