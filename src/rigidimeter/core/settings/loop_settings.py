"""Settings of what runs at every tick: controller, guard, lateness, and zeroing before the first.

The defaults of the controller are the paper's.
"""

from __future__ import annotations

from typing import Self

from pydantic import model_validator

from rigidimeter.core.settings.section import Section, quantity
from rigidimeter.core.units import per_rad_from_per_deg

GAP_S = 0.005
"""The position limit holds even when a step comes this late, or a tick late if ticks are longer.

A loop under a real-time schedule is late by at most this; against a program that stands still for
longer there are the drive's own watchdog and the mechanical stops.
"""

SOFTLY = 0.1
"""Where the speed of arrival at the position limit is bounded, what is faster brakes by this part
of the acceleration limit, before it comes so near that the rest takes all of it."""

LONGEST_STEP = 5
"""In ticks: after a late one the controller steps over no more, however many were missed."""


class ControllerSettings(Section):
    """The admittance M_PRBS − M_meas = J_c θ'' + B_c θ' (Eq. 5), per radian.

    The paper prints both values per degree in Sec. 2.4.2 (0.0008 and 0.028) and per radian in
    App. A. Only the reading per degree gives the position SD of about 4 deg that it reports.
    """

    inertia_kg_m2: float = quantity(per_rad_from_per_deg(0.0008), "kg·m²", 0.0, 10.0, above=True)
    damping_nm_s_rad: float = quantity(per_rad_from_per_deg(0.028), "N·m·s/rad", 0.0, 100.0)
    torque_cutoff_hz: float = quantity(20.0, "Hz", 0.5, 1000.0)
    tracking_gain_per_s: float = quantity(1.0, "1/s", 0.0, 50.0)


class GuardSettings(Section):
    """Limits that hold whatever the controller asks for.

    `reaction_time_s` is how long the drive may take to have followed a command, plus how far the
    stamp of an angle reading may be wrong; braking for the position limit begins that much earlier.

    Above `torque_limit_nm` or `power_limit_w` the rig holds still and the operator may go on. It
    stops, latched, above `torque_stop_nm`, when more than `energy_limit_j` goes to and fro between
    rig and joint within a second, when the angle is more than `following_limit_deg` from where the
    commands should have brought it, and when a reading is older than `stale_s`. The place where the
    commands should have brought it follows the angle by at most `drift_limit_deg_s`: so much may be
    the zero offset of the drive. While zero is commanded the joint may move by at most
    `hold_limit_deg`. `min_inertia_kg_m2` is less than the inertia of the lightest thing that can
    be mounted: an accelerated joint that shows less torque than that has no working sensor.

    The joint brakes for the position limit with `acceleration_limit_deg_s2`, from whatever speed it
    has. With `arrival_speed_deg_s` below `speed_limit_deg_s` that braking begins at no more than
    this speed; down to it the joint brakes with a tenth of that acceleration. The default is the
    largest speed limit, so no bound.
    """

    position_limit_deg: float = quantity(40.0, "deg", 1.0, 180.0)
    speed_limit_deg_s: float = quantity(200.0, "deg/s", 1.0, 1000.0)
    acceleration_limit_deg_s2: float = quantity(6000.0, "deg/s²", 10.0, 100000.0)
    arrival_speed_deg_s: float = quantity(1000.0, "deg/s", 1.0, 1000.0)
    reaction_time_s: float = quantity(0.02, "s", 0.0, 0.2)
    stale_s: float = quantity(0.1, "s", 0.002, 0.5)
    following_limit_deg: float = quantity(2.0, "deg", 0.1, 45.0)
    drift_limit_deg_s: float = quantity(0.02, "deg/s", 0.0, 1.0)
    hold_limit_deg: float = quantity(1.0, "deg", 0.1, 45.0)
    min_inertia_kg_m2: float = quantity(0.0005, "kg·m²", 0.0, 1.0)
    torque_limit_nm: float = quantity(10.0, "N·m", 0.01, 200.0)
    torque_stop_nm: float = quantity(20.0, "N·m", 0.01, 400.0)
    power_limit_w: float = quantity(20.0, "W", 0.01, 1000.0)
    energy_limit_j: float = quantity(5.0, "J", 0.01, 1000.0)

    @model_validator(mode="after")
    def _stop_above_hold(self) -> Self:
        if self.torque_stop_nm < self.torque_limit_nm:
            raise ValueError(
                f"torque_stop_nm = {self.torque_stop_nm:g} N·m must not be below torque_limit_nm "
                f"= {self.torque_limit_nm:g} N·m: the rig pauses at the one and stops at the other"
            )
        return self


class LoopSettings(Section):
    """When a loop that falls behind, or is left alone, stops the rig.

    It stops after `missed_in_a_row` late ticks in a row, or after one so late as `stall_s`, which
    must be shorter than the watchdog of the drive, or the drive has stopped before the loop says
    so; commissioning compares the two.

    For `console_lost_s` the arm goes on to move after the operator's console froze; a console
    that was killed is noticed at the next tick. For `recorder_lost_s` it goes on after the
    recorder was lost, or while samples that old wait because the disk takes nothing; they stay in
    memory, and the other processes write them down. With four busy programs and a disk under
    constant writing on two processors the console was silent for 0.11 s at most, the recorder for
    0.19 s, and samples waited for 0.26 s (one minute): the defaults are four and ten times that.
    """

    missed_in_a_row: int = quantity(20, "1", 1, 1000)
    stall_s: float = quantity(0.04, "s", 0.005, 1.0)
    console_lost_s: float = quantity(0.5, "s", 0.2, 5.0)
    recorder_lost_s: float = quantity(2.0, "s", 0.5, 20.0)


class ZeroingSettings(Section):
    """Before the first epoch of a run the joint is held still and the torque sensor zeroed.

    A mean above `bias_limit_nm` means that the sensor was zeroed under load or has another
    calibration; a standard deviation above `noise_limit_nm` that the subject moves or a wire is
    loose; an angle that changes by more than `motion_limit_deg` that the joint did not stand still,
    and its torque is not the sensor's zero. In each case the run does not begin.
    """

    duration_s: float = quantity(2.0, "s", 0.1, 60.0)
    bias_limit_nm: float = quantity(1.0, "N·m", 0.001, 100.0)
    noise_limit_nm: float = quantity(0.1, "N·m", 0.0001, 100.0)
    motion_limit_deg: float = quantity(0.2, "deg", 0.001, 45.0)
