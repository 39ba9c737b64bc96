"""The drive that a recording shows, where the drives of the rigs in `tests/scenarios` do not reach.

Uneven commands, motion that is sampled slowly, a log that misses commands, and rivals.
"""

import math
from dataclasses import replace

import numpy as np
import pytest

from rigidimeter.analysis.estimation import prepare
from rigidimeter.core.records import Channel, Epoch, LeftOut, Ticks
from rigidimeter.core.settings import settings_from
from rigidimeter.model import DriveModel

SECOND_ORDER = DriveModel.second_order(23.0, 0.6)
# ((p + q) s + p q) / ((s + p) (s + q)): its acceleration jumps by p + q at an edge of the command.
PI = DriveModel((complex(-220.0), complex(-90.0)), (complex(372.3), complex(-62.3)), 2e-4)


def sent(n, rate_hz, seed=6):
    values = 0.01 * np.cumsum(np.random.default_rng(seed).standard_normal(n))
    return Channel("velocity_command_rad_s", np.arange(n) / rate_hz, values)


def driven(model, command, time_s):
    """Return what each command moves until the next, at the times: v' = λ v + ρ c, from rest."""
    edges_s = command.time_s + model.delay_s
    tick = np.maximum(np.searchsorted(edges_s, time_s, side="right") - 1, 0)
    after_s = np.maximum(time_s - edges_s[tick], 0.0)
    velocity = np.zeros(time_s.size)
    for pole, residue in zip(model.poles_rad_s, model.residues, strict=True):
        grown = np.exp(pole * np.diff(edges_s, append=edges_s[-1]))
        state = np.zeros(len(command), dtype=complex)
        for k, c in enumerate(command.values[:-1]):
            state[k + 1] = grown[k] * state[k] + c * (grown[k] - 1) / pole
        since = np.exp(pole * after_s)
        now = residue * (since * state[tick] + command.values[tick] * (since - 1) / pole)
        velocity += (2 if pole.imag else 1) * now.real
    return velocity


def recorded(command, velocity, time_s=None, **more):
    """Return an epoch; its torque is noise, which shows no drive."""
    time_s = command.time_s if time_s is None else time_s
    noise = np.random.default_rng(1).standard_normal(time_s.size)
    channels = [
        command,
        Channel("velocity_rad_s", time_s, velocity),
        Channel("torque_nm", time_s, noise),
    ]
    return Epoch("file", "1", {one.name: one for one in channels}, task="prbs", **more)


def drive_of(*epochs):
    settings = settings_from()
    short = settings.estimation.model_copy(update={"min_epoch_s": 1.0, "trim_s": 0.2})
    ready = prepare(epochs, settings.model_copy(update={"estimation": short}), clocks=False)
    return ready.perturbed[0].drive


def noisy(values, share, seed=8):
    noise = np.random.default_rng(seed).standard_normal(values.size)
    return values + share * np.std(values) * noise


@pytest.mark.parametrize("delay_s", [0.0, 0.0042])
def test_a_drive_without_noise_is_the_model_also_between_the_samples(delay_s):
    """The velocity comes 50 times a second, the command 1000 times and not evenly."""
    command, rng = sent(4000, 1000.0), np.random.default_rng(5)
    command = replace(command, time_s=command.time_s + rng.uniform(0.0, 4e-4, 4000))
    model, stamps_s = replace(SECOND_ORDER, delay_s=delay_s), np.arange(0.1, 3.9, 0.0201)
    epoch = recorded(command, driven(model, command, stamps_s), stamps_s)
    found = drive_of(epoch)
    assert found.model.poles_rad_s == pytest.approx(model.poles_rad_s, rel=1e-4)
    assert found.model.delay_s == pytest.approx(delay_s, abs=1e-6)
    between_s = rng.uniform(0.5, 3.5, 500)
    made, true = found.motion(command, between_s)[1], driven(model, command, between_s)
    assert np.max(np.abs(made - true)) < 1e-3 * np.std(true)


def test_a_pi_drive_is_found_in_noise_and_ticks_that_were_missed():
    command = sent(3000, 500.0)
    ran = np.random.default_rng(1).random(3000) > 0.02
    command = Channel(command.name, command.time_s[ran], command.values[ran])
    clean = driven(PI, command, command.time_s)
    ticks = Ticks(len(command), 0, 3000 - len(command))
    found = drive_of(recorded(command, noisy(clean, 1e-5), ticks=ticks))
    assert len(found.model.poles_rad_s) == 2
    assert found.model.jump == pytest.approx(310.0, rel=0.01)
    assert found.model.delay_s == pytest.approx(2e-4, abs=1e-5)


@pytest.mark.parametrize("seed", range(4))
def test_in_noise_a_pole_and_a_delay_do_not_pass_for_two_poles(seed):
    """In noise of 5 % they leave 3 % more power; repeated recordings scatter by 4 % in a pole."""
    command, model = sent(3000, 1000.0), DriveModel.second_order(50.0, 0.7)
    clean = driven(model, command, command.time_s)
    found = drive_of(recorded(command, noisy(clean, 0.05, seed))).model
    assert found.poles_rad_s == pytest.approx(model.poles_rad_s, rel=0.1)
    assert found.delay_s == 0.0


def test_noise_is_averaged_over_the_epochs_that_show_the_same_drive():
    """The pole of four epochs scatters half as much as that of one; others add nothing."""
    model, errors = DriveModel.second_order(50.0, 0.7), []
    for seed in range(0, 40, 4):
        epochs = []
        for number in range(seed, seed + 4):
            command = sent(3000, 1000.0, number)
            clean = driven(model, command, command.time_s)
            epochs.append(recorded(command, noisy(clean, 0.05, number)))
        alone, together = (drive_of(*some) for some in (epochs[:1], epochs))
        poles = [one.model.poles_rad_s[0] - model.poles_rad_s[0] for one in (alone, together)]
        errors.append(np.abs(poles))
    one, four = np.sqrt(np.mean(np.square(errors), axis=0))
    assert four < 0.75 * one
    unlike = recorded(command, np.random.default_rng(4).standard_normal(3000))
    slower = recorded(sent(3000, 500.0, 39), clean)
    assert drive_of(epochs[0], unlike, slower).model == alone.model


def test_a_velocity_that_the_command_does_not_explain_shows_no_drive_but_the_next_epoch_may():
    command, rng = sent(2000, 1000.0), np.random.default_rng(4)
    other = recorded(command, rng.standard_normal(2000))
    assert drive_of(other) is None
    shown = recorded(command, driven(SECOND_ORDER, command, command.time_s))
    assert drive_of(other, shown) is not None


def test_a_command_that_was_logged_more_slowly_than_it_was_sent_shows_no_drive():
    slow = sent(2000, 200.0)
    time_s = np.arange(20000) / 2000.0
    fine = Channel(slow.name, time_s, np.interp(time_s, slow.time_s, slow.values))
    epoch = recorded(slow, driven(SECOND_ORDER, fine, fine.time_s)[::10])
    assert drive_of(epoch) is None
    # A loop of ours logs each command, so there the stairs are known.
    assert drive_of(replace(epoch, ticks=Ticks(2000, 0, 0))) is not None


def test_after_lost_samples_the_state_of_the_drive_is_not_used():
    slow, noise = DriveModel.second_order(8.0, 0.6), np.random.default_rng(6)
    command = replace(sent(3000, 500.0), values=noise.standard_normal(3000))
    velocity = driven(slow, command, command.time_s)
    kept = (command.time_s < 2.0) | (command.time_s > 2.5)
    command = Channel(command.name, command.time_s[kept], command.values[kept])
    lost = (LeftOut(2.0, 2.5, check="lost_samples"),)
    found = drive_of(recorded(command, velocity[kept], left_out=lost))
    assert found.model.poles_rad_s == pytest.approx(slow.poles_rad_s, rel=2e-3)


def test_rivals_are_two_standard_errors_of_repeated_recordings_away():
    command, model = sent(1500, 200.0), replace(PI, delay_s=1e-3)
    clean = driven(model, command, command.time_s)
    found = [drive_of(recorded(command, noisy(clean, 1e-4, seed))) for seed in range(16)]
    scatter_s = np.std([one.model.delay_s for one in found], ddof=1)
    moved = [one.delay_s - found[0].model.delay_s for one in found[0].rivals]
    # Each axis either way: the squares of the axes add up to those of two standard errors.
    assert math.sqrt(np.sum(np.square(moved)) / 2) == pytest.approx(2 * scatter_s, rel=0.4)
