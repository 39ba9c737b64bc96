"""What is asked of the joint, tick for tick: to give way, to follow, to return, to stand still.

After missed ticks the controller steps over the time that did pass (at most `LONGEST_STEP` ticks of
it), and perturbation and position go on where the time is.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from rigidimeter.acquisition.clock import Clock
from rigidimeter.acquisition.run_states import Order
from rigidimeter.acquisition.supervision import Outside
from rigidimeter.acquisition.tick import REST, Passage, Recorder, Ticks
from rigidimeter.control import Admittance, admittance, admittance_step, minimum_jerk, tracking_step
from rigidimeter.devices.base import Reading, Rig
from rigidimeter.settings import Settings

__all__ = ["REST", "ControlLoop", "Passage"]

LONGEST_STEP = 5
"""The controller steps over at most so many ticks at once, however many were missed."""


class ControlLoop(Ticks):
    """Run stretches of ticks on a rig: the perturbed admittance, or following a position.

    The arguments are those of `Ticks`.
    """

    def __init__(
        self,
        settings: Settings,
        rig: Rig,
        clock: Clock,
        record: Recorder,
        progress: Callable[[float], None] = lambda _: None,
        outside: Outside | None = None,
        ordered: Callable[[Order], bool] = lambda _: False,
    ) -> None:
        super().__init__(settings, rig, clock, record, progress, outside, ordered)
        controller = settings.controller
        self._steps = self._admittances(controller.inertia_kg_m2, controller.damping_nm_s_rad)
        self._tracking_gain = controller.tracking_gain_per_s
        self.scale = 1.0

    def _admittances(self, inertia_kg_m2: float, damping_nm_s_rad: float) -> list[Admittance]:
        """Return the steps over one tick, two, and so on."""
        return [
            admittance(inertia_kg_m2, damping_nm_s_rad, ticks * self._interval_s)
            for ticks in range(1, LONGEST_STEP + 1)
        ]

    def change_controller(self, inertia_kg_m2: float, damping_nm_s_rad: float) -> None:
        """Go on with another admittance; the velocity, its only memory, stays as it is."""
        self._steps = self._admittances(inertia_kg_m2, damping_nm_s_rad)

    def perturb(self, epoch: int, perturbation_nm: Sequence[float]) -> Passage:
        """Let the subject move freely while the torque perturbation runs, one value a tick."""

        def command(_: Reading, torque_nm: float, k: int) -> tuple[float, float, float]:
            value = self.scale * perturbation_nm[k]
            step = self._steps[min(self._elapsed, LONGEST_STEP) - 1]
            velocity = self._guard.velocity_rad_s
            return admittance_step(step, velocity, value, torque_nm), value, math.nan

        return self._run(epoch, len(perturbation_nm), command)

    def follow(
        self, epoch: int, angle_rad: Sequence[float], velocity_rad_s: Sequence[float]
    ) -> Passage:
        """Impose a position, one value a tick."""

        def command(reading: Reading, _: float, k: int) -> tuple[float, float, float]:
            target = angle_rad[k]
            # The reading is compared with where the target was when it was taken.
            then = angle_rad[max(k - self._age_ticks(reading), 0)]
            request = tracking_step(self._tracking_gain, then, velocity_rad_s[k], reading.angle_rad)
            return request, 0.0, target

        return self._run(epoch, len(angle_rad), command)

    def rest(self, duration_s: float, return_s: float) -> Passage:
        """Return to the initial position along the smoothest way, then hold it."""
        start_rad = self._angle_rad

        def command(reading: Reading, _: float, k: int) -> tuple[float, float, float]:
            target, velocity = minimum_jerk(start_rad, return_s, k * self._interval_s)
            before_s = max(k - self._age_ticks(reading), 0) * self._interval_s
            then, _ = minimum_jerk(start_rad, return_s, before_s)
            request = tracking_step(self._tracking_gain, then, velocity, reading.angle_rad)
            return request, 0.0, target

        return self._run(REST, round(duration_s * self._rate_hz), command)

    def hold(self, duration_s: float, heard: Callable[[Reading], None] = lambda _: None) -> Passage:
        """Stand still; `heard` takes every reading."""

        def command(reading: Reading, _: float, __: int) -> tuple[float, float, float]:
            heard(reading)
            return 0.0, 0.0, math.nan

        return self._run(REST, round(duration_s * self._rate_hz), command, latched=True)

    def _age_ticks(self, reading: Reading) -> int:
        return round(self._tick - reading.motion_time_s * self._rate_hz)
