"""How a torque sensor of the wrong sign is found in simulated epochs."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from tests.unit.acquisition.exact_rig import LateClock

from rigidimeter.commissioning import turned_sign
from rigidimeter.commissioning.turned_sign import (
    EPOCHS,
    LONGEST_S,
    perturbed_conditions,
    search_for_turned_sign,
    turned_epoch,
    turned_epochs,
)
from rigidimeter.experiment import prbs_nm
from rigidimeter.guard import Cause
from rigidimeter.settings import Settings, parse_settings


def chosen(amplitude_nm: float = 1.0, noise_nm: float = 0.005, **subject: float) -> Settings:
    """Return settings at 100 ticks/s, with sensors that do not round."""
    return parse_settings(
        {
            "rig": {
                "tick_rate_hz": 100.0,
                "torque": {"rate_hz": 100.0, "noise_sd_nm": noise_nm, "resolution_nm": 0.0},
                "motion": {
                    "rate_hz": 100.0,
                    "angle_resolution_deg": 0.0,
                    "velocity_resolution_deg_s": 0.0,
                },
            },
            "prbs": {"amplitude_nm": amplitude_nm},
            "subject": {"OFF": subject, "DBS": {}},
            "guard": {"reaction_time_s": 0.05},
        }
    )


def test_only_the_ratio_of_torques_matters_while_no_limit_is_reached() -> None:
    """The loop is linear: twice the perturbation, own torque and noise move it twice as far."""
    once = turned_epochs(chosen(0.1, 0.0005), "OFF", 0.004)
    twice = turned_epochs(chosen(0.2, 0.0010), "OFF", 0.008)
    assert once.all_found
    assert twice.found_s == once.found_s
    assert twice.farthest_deg == pytest.approx(2.0 * once.farthest_deg, rel=1e-6)
    assert (twice.condition, twice.own_torque_nm, twice.amplitude_nm) == ("OFF", 0.008, 0.2)
    assert once.epochs == EPOCHS


def test_the_arm_goes_away_as_the_admittance_less_the_joint() -> None:
    """Under a constant M_p, θ + M_p/K grows as e^(s t), (J_c − J) s² + (B_c − B) s − K = 0, s > 0.

    The drive, a tick and the filter of the torque are left out of that.
    """
    settings = chosen(0.05)
    controller, joint = settings.controller, settings.subject["OFF"]
    a = controller.inertia_kg_m2 - joint.inertia_kg_m2
    b, k = controller.damping_nm_s_rad - joint.damping_nm_s_rad, joint.stiffness_nm_rad
    root = (-b + math.sqrt(b * b + 4.0 * a * k)) / (2.0 * a)
    assert root == pytest.approx(k / b, rel=0.05)
    still = settings.prbs.model_copy(update={"clock_hz": 0.4})  # the first 7 chips are alike
    settings = settings.model_copy(update={"prbs": still})
    pushed_nm = prbs_nm(still, 100.0)[0]
    epoch = turned_epoch(settings, "OFF", 1, 0.0, 2.0)
    assert epoch.cause is Cause.NONE  # a constant torque shows no sign
    start = math.degrees(pushed_nm / k)
    grown = (epoch.angle_deg[180] + start) / (epoch.angle_deg[100] + start)
    assert math.log(grown) / 0.8 == pytest.approx(root, rel=0.05)


def test_a_sign_in_order_is_never_found_and_one_that_turns_is_found_after_it() -> None:
    settings = chosen()
    right = turned_epoch(settings, "OFF", 1, math.inf, 2.0)
    assert (right.cause, right.ended_s, len(right.angle_deg)) == (Cause.NONE, 2.0, 200)
    turned = turned_epoch(settings, "OFF", 1, 1.0, 3.0)
    assert turned.cause is Cause.TORQUE_SIGN
    assert 1.3 < turned.ended_s < 2.5
    n = 100
    assert turned.angle_deg[:n] == pytest.approx(right.angle_deg[:n], abs=0.0)


def test_a_noise_that_was_measured_takes_the_place_of_the_settings(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(turned_sign, "LARGER", ())
    settings = chosen()
    assert search_for_turned_sign(settings).tried[0].all_found
    noisy = search_for_turned_sign(settings, 0.5)
    assert len(noisy.tried) == 1  # nothing more is tried of what is hidden already
    assert not noisy.tried[0].all_found
    assert noisy.tried[0].ended_s == search_for_turned_sign(chosen(noise_nm=0.5)).tried[0].ended_s


def test_more_and_more_own_torque_is_tried_until_one_hides_the_sign() -> None:
    found = search_for_turned_sign(chosen(voluntary_sd_nm=0.02))
    own = [epochs.own_torque_nm for epochs in found.tried]
    assert own == [0.0, 0.02, 0.05, 0.1, 0.2][: len(own)]
    assert all(epochs.all_found for epochs in found.tried[:-1])
    assert not found.tried[-1].all_found
    medians = [sorted(epochs.found_s)[EPOCHS // 2] for epochs in found.tried[:-1]]
    assert medians == sorted(medians)  # it takes the longer


@pytest.mark.parametrize("enough", [2.0, 3.0, 5.0])
def test_a_larger_perturbation_is_named_only_if_the_sign_is_then_always_found(
    monkeypatch: pytest.MonkeyPatch, enough: float
) -> None:
    asked: list[tuple[float, float]] = []

    def epochs(settings: Settings, condition: str, own_nm: float) -> Any:
        amplitude = settings.prbs.amplitude_nm
        asked.append((amplitude, own_nm))
        cause = Cause.TORQUE_SIGN if own_nm < 0.1 or amplitude >= enough else Cause.NONE
        return turned_sign.TurnedEpochs(condition, own_nm, amplitude, 1.0, {cause: [LONGEST_S]})

    monkeypatch.setattr(turned_sign, "turned_epochs", epochs)
    settings = chosen()
    guard = settings.guard.model_copy(update={"torque_limit_nm": 3.5})
    found = search_for_turned_sign(settings.model_copy(update={"guard": guard}))
    assert asked[:3] == [(1.0, 0.0), (1.0, 0.05), (1.0, 0.1)]
    assert asked[3:] == [(2.0, 0.1), (3.0, 0.1)][: 1 if enough == 2.0 else 2]
    assert (found.larger.amplitude_nm if found.larger else 5.0) == enough


def test_conditions_are_those_that_are_perturbed() -> None:
    blocks = [
        {"task": "sinusoid", "condition": "ON"},
        {"task": "prbs", "condition": "DBS"},
        {"task": "prbs", "condition": "OFF"},
        {"task": "prbs", "condition": "DBS"},
    ]
    settings = parse_settings(
        {"protocol": {"blocks": blocks}, "subject": {name: {} for name in ("ON", "OFF", "DBS")}}
    )
    assert perturbed_conditions(settings) == ["DBS", "OFF"]


def late_epoch(rate_hz: float, own_nm: float, seed: int, turned_s: float) -> tuple[Cause, float]:
    """Return how 12 s ended in which about one tick a second is 20 to 39 ms late."""
    rng = np.random.default_rng(seed)
    ticks = np.flatnonzero(rng.random(round(12.0 * rate_hz)) < 1.0 / rate_hz).tolist()
    late = dict(zip(ticks, rng.uniform(0.02, 0.039, len(ticks)).tolist(), strict=True))
    settings = parse_settings(
        {
            "rig": {
                "tick_rate_hz": rate_hz,
                "torque": {"rate_hz": rate_hz},
                "motion": {"rate_hz": rate_hz},
            },
            "controller": {"torque_cutoff_hz": 10.0},
            "guard": {"reaction_time_s": 0.1},
            "subject": {"OFF": {"voluntary_sd_nm": own_nm}},
        }
    )
    epoch = turned_epoch(settings, "OFF", seed, turned_s, 12.0, LateClock(late, 1.0 / rate_hz))
    return epoch.cause, epoch.ended_s


def test_the_sign_of_a_rig_in_order_is_not_called_wrong_for_late_ticks() -> None:
    """A missed tick of 20 ms makes a row that is larger than the others, in all columns alike."""
    for seed in (1, 6, 8, 9, 10, 17):
        assert late_epoch(50.0, 1.0, seed, math.inf)[0] is Cause.NONE


@pytest.mark.parametrize("turned_s", [0.0, 1.3])
def test_a_rig_of_the_wrong_sign_is_stopped_between_late_ticks(turned_s: float) -> None:
    """The sign is found, or the arm has been at its limit for a second."""
    found = 0
    for seed in range(5):
        cause, ended_s = late_epoch(50.0, 0.0, seed, turned_s)
        found += cause is Cause.TORQUE_SIGN
        assert cause in (Cause.TORQUE_SIGN, Cause.HELD_AT_LIMIT)
        assert ended_s - turned_s < 3.0
    assert found >= 4
