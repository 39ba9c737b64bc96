import numpy as np
import pytest

from rigidimeter.dynamics import DriveModel
from rigidimeter.estimation.closedloop.drive_fit import loop_of


def model(settings, epoch):
    rig = settings.rig
    assumed = DriveModel(rig.drive_bandwidth_hz, rig.drive_damping_ratio)
    return loop_of(settings, epoch.channels["torque_nm"].rate_hz, assumed)


def test_without_noise_the_response_is_what_the_loop_recorded(simulated, quiet, truth):
    settings, (epoch,) = simulated(**quiet)
    loop = model(settings, epoch)
    made = loop.response(epoch.channels["perturbation_nm"].values, 1000.0, tuple(truth))
    # Readings are one tick old.
    for name, part in (("angle_rad", made.angle_rad), ("velocity_rad_s", made.velocity_rad_s)):
        recorded = epoch.channels[name].values[1:]
        np.testing.assert_allclose(part[: recorded.size], recorded, atol=2e-7)


def test_the_slopes_are_the_differences(simulated, truth):
    settings, (epoch,) = simulated()
    loop = model(settings, epoch)
    perturbation = epoch.channels["perturbation_nm"].values[:6000]

    def torque(parameters):
        return sum(
            p * s
            for p, s in zip(
                parameters, loop.response(perturbation, 1000.0, tuple(parameters)), strict=True
            )
        )

    motion = loop.response(perturbation, 1000.0, tuple(truth))
    for i, slope in enumerate(loop.sensed(motion, 1000.0, tuple(truth))):
        step = 1e-4 * truth * (np.arange(3) == i)
        difference = (torque(truth + step) - torque(truth - step)) / (2 * step[i])
        np.testing.assert_allclose(slope, difference, atol=1e-4 * np.abs(difference).max())


def test_at_rest_a_constant_torque_is_held_by_the_spring(simulated, truth):
    settings, (epoch,) = simulated()
    made = model(settings, epoch).response(np.full(20000, 0.1), 1000.0, tuple(truth))
    assert made.angle_rad[-1] == pytest.approx(0.1 / truth[2], rel=1e-6)
