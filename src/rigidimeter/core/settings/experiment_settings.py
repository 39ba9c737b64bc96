"""Settings of the perturbations, the session, and what is predicted before it."""

from __future__ import annotations

from typing import ClassVar, Literal, Self

from pydantic import Field, model_validator

from rigidimeter.core.settings.section import Section, quantity


class PrbsSettings(Section):
    """The torque perturbation: a maximal-length pseudo-random binary sequence.

    By the torque's answer to it the guard finds a torque sensor of the wrong sign. Where the
    subject's own torque is larger than about a tenth of `amplitude_nm` it may not;
    `rigidimeter commission` and `check` print what it finds with the settings.
    """

    ascending: ClassVar = (("wanted_low_hz", "wanted_high_hz"),)

    register_bits: int = quantity(7, "1", 3, 20)
    clock_hz: float = quantity(20.0, "Hz", 0.1, 1000.0)
    amplitude_nm: float = quantity(1.0, "N·m", 0.0, 50.0, above=True)
    duration_s: float = quantity(20.0, "s", 1.0, 3600.0)
    wanted_low_hz: float = quantity(0.15, "Hz", 0.001, 100.0)
    wanted_high_hz: float = quantity(10.0, "Hz", 0.01, 500.0)


class SinusoidSettings(Section):
    """The position perturbation for the impulse and work scores."""

    frequency_hz: float = quantity(1.0, "Hz", 0.05, 10.0)
    amplitude_deg: float = quantity(20.0, "deg", 0.1, 90.0)
    motion_s: float = quantity(10.0, "s", 1.0, 600.0)
    duration_s: float = quantity(20.0, "s", 1.0, 3600.0)
    taper_s: float = quantity(1.0, "s", 0.0, 10.0)

    @model_validator(mode="after")
    def _fits(self) -> Self:
        if self.motion_s > self.duration_s:
            raise ValueError("motion_s must not exceed duration_s")
        if 2 * self.taper_s > self.motion_s:
            raise ValueError("taper_s must be at most half of motion_s")
        return self


class BlockSettings(Section):
    """A run of epochs of one task in one condition."""

    task: Literal["prbs", "sinusoid"] = "prbs"
    condition: str = Field("OFF", min_length=1, max_length=40)
    epochs: int = quantity(4, "1", 1, 1000)


class ProtocolSettings(Section):
    """Blocks of epochs in order, with random rests in between.

    After an epoch, and after a pause once it is resumed, the arm is led back to where epochs begin.
    That takes `return_s`, or longer where its peak speed would exceed `return_speed_deg_s` or the
    guard's speed limit. A rest begins after it. With `repeat_limited`, an epoch in which the arm
    came to a limit is run again at the end, once.
    """

    blocks: list[BlockSettings] = Field(
        default_factory=lambda: [BlockSettings(task="prbs"), BlockSettings(task="sinusoid")],
        min_length=1,
    )
    rests_s: list[float] = Field([10.0, 20.0], min_length=1, json_schema_extra={"unit": "s"})
    return_s: float = quantity(3.0, "s", 0.5, 60.0)
    return_speed_deg_s: float = quantity(20.0, "deg/s", 1.0, 200.0)
    repeat_limited: bool = False

    @model_validator(mode="after")
    def _rests_in_range(self) -> Self:
        for rest_s in self.rests_s:
            if not 0 <= rest_s <= 3600:
                raise ValueError(
                    f"rests_s holds {rest_s:g} s; each rest, which begins after the return, must "
                    "last from 0 to 3600 s"
                )
        return self


class DoseSettings(Section):
    """The most of one session, with those that it continues.

    No epoch begins beyond `epochs`, nor one that would take the motion, of epochs and returns,
    beyond `motion_min`. At the arrival of number `arrivals` at the position limit the session ends
    at once.
    """

    epochs: int = quantity(120, "1", 1, 100000)
    motion_min: float = quantity(60.0, "min", 0.1, 10000.0)
    arrivals: int = quantity(30, "1", 1, 100000)


class MarginsSettings(Section):
    """How far the loop must stay from instability, and for which joints.

    Each of J, B and K of every subject is varied by the two factors to find the worst case. A loop
    that is unstable or has smaller margins is refused for a condition's own joint, and brings a
    warning for the worst case.
    """

    gain_margin_db: float = quantity(6.0, "dB", 0.0, 60.0)
    phase_margin_deg: float = quantity(30.0, "deg", 0.0, 90.0)
    joint_factor_low: float = quantity(0.25, "1", 0.01, 1.0)
    joint_factor_high: float = quantity(4.0, "1", 1.0, 100.0)


class OptimiseSettings(Section):
    """Where `design --optimise` looks for a better PRBS.

    The amplitude of each candidate is the largest that keeps `limit_margin_percent` of the guard's
    limits in hand, and at most `amplitude_high_nm`.
    """

    clock_low_hz: float = quantity(5.0, "Hz", 0.1, 1000.0)
    clock_high_hz: float = quantity(60.0, "Hz", 0.1, 1000.0)
    clocks: int = quantity(9, "1", 1, 100)
    bits_low: int = quantity(5, "1", 3, 20)
    bits_high: int = quantity(10, "1", 3, 20)
    amplitude_high_nm: float = quantity(3.0, "N·m", 0.0, 50.0, above=True)
    limit_margin_percent: float = quantity(20.0, "%", 0.0, 90.0)

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if self.clock_low_hz > self.clock_high_hz:
            raise ValueError("clock_low_hz must not be above clock_high_hz")
        if self.bits_low > self.bits_high:
            raise ValueError("bits_low must not be above bits_high")
        return self


class MultisineSettings(Section):
    """A multisine in place of the PRBS: equal lines at multiples of 1 / `period_s`.

    It lies in the wanted band of `[prbs]`, lasts as long, and has the same peak torque. Without
    `period_s`, which is 0, its period is that of the epoch.
    """

    period_s: float = quantity(0.0, "s", 0.0, 3600.0)
    phases: Literal["schroeder", "random"] = "schroeder"
    crest_steps: int = quantity(200, "1", 0, 10000)
