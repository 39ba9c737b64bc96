"""Up to which own torque a wrong sign is found, by the equation and in simulated epochs."""

from __future__ import annotations

import math
import re
from typing import Any

import numpy as np
import pytest
from benchmarks.torque_sign import turned_epoch
from tests.unit.rig.acquisition.exact_rig import LateClock

from rigidimeter.core.settings import Settings, SubjectSettings, parse_settings
from rigidimeter.model import Loop, median_joint
from rigidimeter.planning import prbs_nm
from rigidimeter.rig.commissioning import NOISE, below, hiding_torque_nm, sign_words, wrong_sign
from rigidimeter.rig.guard import Cause, max_left


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


ELBOW = {
    "controller": {"inertia_kg_m2": 0.15, "damping_nm_s_rad": 3.0},
    "subject": {
        "OFF": {"inertia_kg_m2": 0.07, "damping_nm_s_rad": 0.5, "stiffness_nm_rad": 5.0},
        "DBS": {},
    },
}


def test_twice_the_perturbation_hides_twice_the_own_torque() -> None:
    """S grows as a² and N as σ² where the sensor has no noise, while the same windows are full."""
    once, twice = (
        hiding_torque_nm(chosen(amplitude_nm, 0.0), "OFF") for amplitude_nm in (0.1, 0.2)
    )
    assert twice == pytest.approx(2.0 * once, rel=1e-6)


def test_an_answer_with_the_colour_of_the_noise_has_their_ratio(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """With Φ_sub = S/a² of a torque of 1 N·m, R = (a/σ)² whatever whitens it, and σ is known."""
    settings = chosen(0.5, 0.0, stiffness_nm_rad=0.0, inertia_kg_m2=1e-9)
    controller = settings.controller.model_copy(update={"inertia_kg_m2": 1e-6})
    settings = settings.model_copy(update={"controller": controller})
    chip_s = 1.0 / settings.prbs.clock_hz

    def alike(subject: SubjectSettings, frequency_hz: Any, tick_rate_hz: float) -> Any:
        loop = Loop(settings.controller, settings.rig).at_frequency(frequency_hz)
        z = loop.gain(median_joint(subject).parameters) / loop.forward * loop.admittance
        held = chip_s * np.sinc(frequency_hz * chip_s) ** 2
        return subject.voluntary_sd_nm**2 * np.abs(z) ** 2 * held

    monkeypatch.setattr(wrong_sign, "subject_density", alike)
    monkeypatch.setattr(wrong_sign, "_at_limit_s", lambda *_: math.inf)
    free = 96 - 4 - 2 * 4
    needed = free / 96 * (1.0 / max_left(96, 4).at_once - 1.0)
    assert hiding_torque_nm(settings, "OFF") == pytest.approx(0.5 / math.sqrt(16.0 * needed))


@pytest.mark.parametrize(("size", "amplitude_nm"), [({}, 1.0), ({}, 2.0), (ELBOW, 2.0)])
def test_up_to_it_the_sign_is_found_and_well_above_it_is_not(
    size: dict[str, Any], amplitude_nm: float
) -> None:
    settings = chosen(amplitude_nm)
    settings = parse_settings({**settings.model_dump(exclude_unset=True), **size})
    own_nm = hiding_torque_nm(settings, "OFF")
    assert own_nm > 0.0
    assert found(settings, own_nm) == 10
    assert found(settings, 8.0 * own_nm) <= 2


def found(settings: Settings, own_nm: float) -> int:
    """Return in how many of 10 simulated epochs with so much own torque the sign is found."""
    subject = settings.subject["OFF"].model_copy(update={"voluntary_sd_nm": own_nm})
    settings = settings.model_copy(update={"subject": {"OFF": subject}})
    ends = [turned_epoch(settings, "OFF", seed, 0.0, 4.0).cause for seed in range(10)]
    return ends.count(Cause.TORQUE_SIGN)


def test_an_arm_that_is_at_its_limit_before_a_window_is_full_hides_the_sign() -> None:
    settings = chosen(1.0, **ELBOW["subject"]["OFF"])  # as stiff as the small one's controller
    assert hiding_torque_nm(settings, "OFF") == 0.0
    assert found(settings, 0.0) < 10


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


def test_what_protects_is_said_with_the_noise_that_was_measured() -> None:
    words = sign_words(chosen(), ())
    assert (
        f"stays below (SD): OFF {hiding_torque_nm(chosen(), 'OFF'):.2g} N·m. Above that, and in"
        in words
    )
    assert "an imposed sinusoid, the daily check alone protects: repeat `rigidimeter ch" in words
    noisy = sign_words(chosen(), [below(NOISE, 0.5, "N·m", 0.1, "")])
    assert "OFF perhaps none at all" in noisy
    assert sign_words(chosen(), [below(NOISE, math.inf, "N·m", 0.1, "")]) == words


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
    assert re.findall("[A-Z]+ (?=[0-9])", sign_words(settings, ())) == ["DBS ", "OFF "]


def test_a_protocol_without_perturbation_is_said_to_show_no_sign() -> None:
    settings = parse_settings({"protocol": {"blocks": [{"task": "sinusoid"}]}})
    words = sign_words(settings, ())
    assert words.startswith("This protocol has no torque perturbation: the guard cannot find a ")
    assert "rigidimeter check" in words


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
