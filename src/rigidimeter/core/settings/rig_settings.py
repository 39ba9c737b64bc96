"""Settings of the virtual rig, its loop rate, drive and sensors, and of the virtual subject."""

from __future__ import annotations

from typing import ClassVar

from rigidimeter.core.settings.section import Section, quantity


class TorqueSensorSettings(Section):
    """The virtual torque sensor. `stamp_latency_s` is the part of the latency its stamps know."""

    rate_hz: float = quantity(1000.0, "Hz", 1.0, 20000.0)
    noise_sd_nm: float = quantity(0.005, "N·m", 0.0, 10.0)
    resolution_nm: float = quantity(0.0005, "N·m", 0.0, 1.0)
    latency_s: float = quantity(0.001, "s", 0.0, 0.1)
    stamp_latency_s: float = quantity(0.001, "s", 0.0, 0.1)
    jitter_s: float = quantity(0.0, "s", 0.0, 0.1)


class MotionSensorSettings(Section):
    """The virtual encoder: angle and velocity sampled together."""

    rate_hz: float = quantity(1000.0, "Hz", 1.0, 20000.0)
    angle_resolution_deg: float = quantity(2.25e-4, "deg", 0.0, 1.0)
    velocity_resolution_deg_s: float = quantity(0.01, "deg/s", 0.0, 10.0)
    latency_s: float = quantity(0.001, "s", 0.0, 0.1)
    stamp_latency_s: float = quantity(0.001, "s", 0.0, 0.1)
    jitter_s: float = quantity(0.0, "s", 0.0, 0.1)


class DriveSideSettings(Section):
    """The motor and gear of the virtual drive, at the joint, and the torque that it reports.

    `friction_ripple_deg` is the angle of the joint in which the friction goes through one ripple.
    The true torque of the motor is `torque_scale` times the reported one, which is that of
    `torque_latency_ticks` before.
    """

    reflected_inertia_kg_m2: float = quantity(0.05, "kg·m²", 0.0, 20.0)
    friction_nm: float = quantity(0.3, "N·m", 0.0, 50.0)
    friction_ripple_percent: float = quantity(20.0, "%", 0.0, 90.0)
    friction_ripple_deg: float = quantity(3.6, "deg", 0.1, 360.0)
    reports_torque: bool = True
    rated_torque_nm: float = quantity(10.0, "N·m", 0.01, 1000.0)
    torque_resolution_percent: float = quantity(0.1, "%", 0.0, 10.0)
    torque_latency_ticks: int = quantity(1, "ticks", 0, 100)
    torque_scale: float = quantity(0.9, "1", 0.1, 10.0)


class RigSettings(Section):
    """The virtual rig: loop rate, drive and sensors."""

    tick_rate_hz: float = quantity(1000.0, "Hz", 50.0, 5000.0)
    drive_bandwidth_hz: float = quantity(50.0, "Hz", 1.0, 2000.0)
    drive_damping_ratio: float = quantity(0.7071, "1", 0.6, 0.99)
    torque: TorqueSensorSettings = TorqueSensorSettings()
    motion: MotionSensorSettings = MotionSensorSettings()
    drive_side: DriveSideSettings = DriveSideSettings()


class SubjectSettings(Section):
    """A virtual subject in one condition.

    Each epoch draws J, B and K log-normally about the medians given here, with the coefficients of
    variation given here.
    """

    ascending: ClassVar = (("voluntary_low_hz", "voluntary_high_hz"),)

    inertia_kg_m2: float = quantity(0.0045, "kg·m²", 0.0, 10.0, above=True)
    damping_nm_s_rad: float = quantity(0.1368, "N·m·s/rad", 0.0, 100.0)
    stiffness_nm_rad: float = quantity(1.751, "N·m/rad", 0.0, 10000.0)
    inertia_cv_percent: float = quantity(0.0, "%", 0.0, 100.0)
    damping_cv_percent: float = quantity(0.0, "%", 0.0, 100.0)
    stiffness_cv_percent: float = quantity(0.0, "%", 0.0, 100.0)
    voluntary_sd_nm: float = quantity(0.0, "N·m", 0.0, 10.0)
    voluntary_low_hz: float = quantity(0.3, "Hz", 0.01, 20.0)
    voluntary_high_hz: float = quantity(4.0, "Hz", 0.05, 50.0)
    tremor_amplitude_nm: float = quantity(0.0, "N·m", 0.0, 10.0)
    tremor_frequency_hz: float = quantity(5.0, "Hz", 1.0, 20.0)

    @property
    def relaxed(self) -> SubjectSettings:
        """The same arm with no torque of the subject's own: neither voluntary nor tremor."""
        return self.model_copy(update={"voluntary_sd_nm": 0.0, "tremor_amplitude_nm": 0.0})
