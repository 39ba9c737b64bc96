import math

import pytest

from rigidimeter.model import admittance, admittance_step


def test_a_step_of_torque_gives_the_closed_form():
    # v(t) = M/B_c (1 − e^(−B_c t / J_c)) for a constant perturbation and no reaction
    J, B, dt = 0.0458, 1.604, 0.001
    step = admittance(J, B, dt)
    v = 0.0
    for _ in range(250):
        v = admittance_step(step, v, 1.0, 0.0)
    assert v == pytest.approx((1 - math.exp(-B * 0.25 / J)) / B, rel=1e-12)


def test_without_damping_the_torque_is_integrated():
    step = admittance(0.05, 0.0, 0.001)
    v = 0.0
    for _ in range(100):
        v = admittance_step(step, v, 0.0, -2.0)
    assert v == pytest.approx(2.0 * 0.1 / 0.05, rel=1e-12)


def test_the_drive_yields_to_a_push():
    # A push toward positive angle makes the measured torque negative (M_meas = ... − M_sub).
    assert admittance_step(admittance(0.0458, 1.604, 0.001), 0.0, 0.0, -0.5) > 0


@pytest.mark.parametrize("values", [(0.0, 1.0, 0.001), (0.1, -1.0, 0.001), (0.1, 1.0, 0.0)])
def test_an_impossible_admittance_is_refused(values):
    with pytest.raises(ValueError, match="admittance needs"):
        admittance(*values)
