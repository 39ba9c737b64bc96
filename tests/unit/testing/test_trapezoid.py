"""The trajectory generator against the closed form of a trapezoid."""

from __future__ import annotations

import pytest

from rigidimeter.testing import Ramps, Trapezoid

STEP_S = 0.0005
RAMPS = Ramps(up=2000.0, down=1000.0)


def moving(generator: Trapezoid) -> list[float]:
    """Step until it stands; return the speeds."""
    speeds = []
    while generator.position != generator.target:
        generator.step(RAMPS, STEP_S)
        speeds.append(generator.speed)
    return speeds


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_move_takes_as_long_as_its_trapezoid(way: float) -> None:
    generator = Trapezoid(10.0, 10.0)
    generator.move(10.0 + way * 500.0, 200.0)
    speeds = moving(generator)
    # Up in 0.1 s over 10 counts, down in 0.2 s over 20 counts, the rest at 200 counts/s.
    assert len(speeds) * STEP_S == pytest.approx(0.1 + 0.2 + (500.0 - 30.0) / 200.0, rel=0.01)
    assert max(abs(speed) for speed in speeds) == pytest.approx(200.0)
    assert min(way * speed for speed in speeds) >= 0.0, "it never turns back"


def test_an_abort_brakes_and_stays() -> None:
    generator = Trapezoid(0.0, 0.0)
    generator.move(1e6, 200.0)
    for _ in range(1000):
        generator.step(RAMPS, STEP_S)
    position, generator.aborting = generator.position, True
    for _ in range(1000):
        generator.step(RAMPS, STEP_S)
    assert generator.speed == 0.0
    assert generator.position - position == pytest.approx(200.0**2 / (2.0 * RAMPS.down), rel=0.01)


def test_a_velocity_has_no_end() -> None:
    generator = Trapezoid(0.0, 0.0)
    for _ in range(2000):
        generator.run(-300.0, RAMPS, STEP_S)
    assert generator.speed == -300.0
    assert generator.position == pytest.approx(-300.0 * (1.0 - 0.15 / 2.0), rel=0.01)
