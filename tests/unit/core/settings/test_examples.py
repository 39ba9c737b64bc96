"""The settings for a human elbow: stable, within the guard, with room for someone who resists."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from rigidimeter.core.settings import GuardSettings, Settings, SubjectSettings, load_settings
from rigidimeter.model import loop_stability, near_instability
from rigidimeter.planning import design, sinusoid
from rigidimeter.rig.guard import energy_after

HUMAN_ELBOW = Path(__file__).parents[4] / "examples" / "settings" / "human-elbow.toml"
RESISTS_NM = 5.0


@pytest.fixture(scope="module")
def human() -> Settings:
    return load_settings(HUMAN_ELBOW)


def test_the_design_of_a_human_elbow_is_accepted(human: Settings) -> None:
    assert design(human).warnings == ()
    stability = loop_stability(human)
    for name, margins in stability.conditions.items():
        assert not near_instability(name, margins, human)
    assert all(margins.stable for margins in stability.worst.values())


def test_the_controller_of_a_small_joint_is_not_for_it(human: Settings) -> None:
    light = human.model_copy(update={"controller": Settings().controller})
    margins = loop_stability(light).conditions["OFF"]
    assert "gain margin" in " ".join(near_instability("OFF", margins, light))


def peaks(settings: Settings, arm: SubjectSettings, resists_nm: float) -> tuple[float, ...]:
    """Return the largest torque, power and energy within a second of the imposed sinusoid."""
    rate_hz = settings.rig.tick_rate_hz
    angle, velocity = sinusoid(settings.sinusoid, rate_hz)
    acceleration = np.gradient(velocity) * rate_hz
    torque = (
        arm.inertia_kg_m2 * acceleration
        + arm.damping_nm_s_rad * velocity
        + arm.stiffness_nm_rad * angle
        + resists_nm * np.sign(velocity)
    )
    energy_j, most_j = 0.0, 0.0
    for power_w in torque * velocity:
        energy_j = energy_after(energy_j, float(power_w), 1.0 / rate_hz)
        most_j = max(most_j, energy_j)
    return float(np.max(np.abs(torque))), float(np.max(np.abs(torque * velocity))), most_j


def fits(found: tuple[float, ...], guard: GuardSettings) -> bool:
    limits = (guard.torque_limit_nm, guard.power_limit_w, guard.energy_limit_j)
    return all(value < limit for value, limit in zip(found, limits, strict=True))


def test_the_guard_leaves_room_for_someone_who_resists(human: Settings) -> None:
    """The numbers are those of docs/how-to/limit-the-motion.md."""
    arm = human.subject["OFF"]
    relaxed, resisting = peaks(human, arm, 0.0), peaks(human, arm, RESISTS_NM)
    assert relaxed == pytest.approx((3.35, 6.1, 3.1), abs=0.05)
    assert resisting == pytest.approx((8.35, 16.5, 10.0), abs=0.05)
    assert fits(relaxed, GuardSettings())
    assert not fits(resisting, GuardSettings())
    assert fits(resisting, human.guard)
