"""Settings of the checks that a rig must pass before a person's arm is put into it."""

from __future__ import annotations

from rigidimeter.core.settings.section import Section, quantity


class CommissioningSettings(Section):
    """What is tried on a rig, and what it must come to.

    `swing_deg` and `swing_speed_deg_s` are of the slow known motion, `nudge_deg` of the smaller one
    before it, `step_deg_s` of the quick small velocity steps. The known torque is held for
    `known_torque_s` by hand. Everything else that is compared is a limit of the guard, of the
    zeroing or of the margins.

    Of the daily check: `daily_rest_s` is listened without power and held with it, then the joint
    moves for `daily_motion_s` at up to `daily_speed_deg_s`. The inertia found is compared within
    `inertia_tolerance_percent`, the delay within `delay_tolerance_s` or a tick if that is longer.
    """

    validity_days: float = quantity(180.0, "days", 1.0, 3650.0)
    idle_s: float = quantity(10.0, "s", 0.5, 600.0)
    nudge_deg: float = quantity(0.3, "deg", 0.05, 5.0)
    swing_deg: float = quantity(2.0, "deg", 0.2, 20.0)
    swing_speed_deg_s: float = quantity(10.0, "deg/s", 0.5, 60.0)
    swings: int = quantity(2, "1", 1, 20)
    step_deg_s: float = quantity(8.0, "deg/s", 0.5, 60.0)
    steps_s: float = quantity(3.0, "s", 1.0, 60.0)
    scale_tolerance_percent: float = quantity(2.0, "%", 0.1, 20.0)
    known_tolerance_percent: float = quantity(5.0, "%", 0.1, 20.0)
    known_torque_s: float = quantity(3.0, "s", 0.5, 60.0)
    min_rate_percent: float = quantity(90.0, "%", 10.0, 100.0)
    lost_percent: float = quantity(0.1, "%", 0.0, 10.0)
    max_watchdog_s: float = quantity(0.5, "s", 0.01, 5.0)
    watchdog_margin_s: float = quantity(0.1, "s", 0.01, 2.0)
    emergency_stop_wait_s: float = quantity(15.0, "s", 1.0, 120.0)
    daily_validity_h: float = quantity(24.0, "h", 1.0, 168.0)
    daily_rest_s: float = quantity(2.0, "s", 0.5, 60.0)
    daily_motion_s: float = quantity(6.0, "s", 2.0, 60.0)
    daily_speed_deg_s: float = quantity(24.0, "deg/s", 1.0, 120.0)
    inertia_tolerance_percent: float = quantity(20.0, "%", 1.0, 40.0)
    delay_tolerance_s: float = quantity(0.01, "s", 0.001, 0.1)
