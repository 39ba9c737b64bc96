"""What a trial of the emulated rig needs: settings that a busy machine keeps, and a clock."""

from __future__ import annotations

from typing import Any

from rigidimeter.core.settings import Settings, parse_settings
from rigidimeter.rig.acquisition import DeadlineClock
from rigidimeter.rig.commissioning import Operator, Setup, Timebase
from rigidimeter.rig.devices import RigFile, drive_bounds


def settings(rate_hz: float, **tables: Any) -> Settings:
    sensor = {"rate_hz": rate_hz}
    return parse_settings(
        {
            "rig": {"tick_rate_hz": rate_hz, "torque": sensor, "motion": sensor},
            "guard": {
                "reaction_time_s": 0.15,
                "stale_s": 0.3,
                "speed_limit_deg_s": 60.0,
                "acceleration_limit_deg_s2": 1500.0,
            },
            # A machine shared with other tests is late at times; the drives' watchdogs are 0.1 s.
            "loop": {"missed_in_a_row": 50, "stall_s": 0.09},
            **tables,
        }
    )


def setup(rigfile: RigFile, chosen: Settings, operator: Operator, **options: Any) -> Setup:
    clock = DeadlineClock()
    bounds = drive_bounds(chosen)
    rig = rigfile.build(clock.now_s, chosen.rig.tick_rate_hz, bounds=bounds, **options)
    return Setup(rig, chosen, Timebase(clock.now_s, clock.wait_until), operator)
