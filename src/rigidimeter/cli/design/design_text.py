"""The text of `rigidimeter design`: what will be commanded."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Iterator
from typing import TYPE_CHECKING

from rigidimeter.units import deg_from_rad, rad_from_deg

if TYPE_CHECKING:
    from rigidimeter.experiment import Overview

__all__ = ["commanded_lines", "wrapped"]


def commanded_lines(planned: Overview) -> Iterator[str]:
    """Yield the text on what will be commanded, section by section."""
    for section in (_prbs, _sinusoid, _controller, _bandwidth, _protocol):
        yield from section(planned)
        yield ""


def wrapped(text: str, indent: str = "  ") -> list[str]:
    """Return the text on lines of at most 96 letters."""
    return textwrap.wrap(text, 96, initial_indent=indent, subsequent_indent="  ")


def _prbs(planned: Overview) -> Iterator[str]:
    from rigidimeter.experiment import chip_count, period_s

    prbs, band = planned.settings.prbs, planned.band
    low_nm, high_nm = planned.perturbation_nm.min(), planned.perturbation_nm.max()
    yield "Torque perturbation (PRBS)"
    yield (
        f"  {prbs.register_bits} bits ({chip_count(prbs)} chips) at {prbs.clock_hz:g} Hz, period "
        f"{period_s(prbs):.4g} s; {prbs.duration_s:g} s at {planned.settings.rig.tick_rate_hz:g} "
        "ticks/s"
    )
    yield f"  ±{prbs.amplitude_nm:g} N·m; without its mean {low_nm:+.4g} and {high_nm:+.4g} N·m"
    yield (
        f"  lines every {band.line_spacing_hz:.4g} Hz; plateau {band.plateau_n2m2_hz:.4g} N²m²/Hz; "
        f"−3 dB at {band.half_power_hz:.2f} Hz"
    )
    yield (
        f"  in the wanted band: {band.lines_in_band} lines, {band.in_band_percent:.0f} % of the "
        "power"
    )
    yield from wrapped(band.verdict)
    yield "  predicted in the ideal loop   angle SD    peak angle    peak speed"
    for name, needs in planned.prbs_demand.items():
        yield (
            f"    {name:<22} {deg_from_rad(needs.angle_sd_rad):9.2f} deg"
            f" {deg_from_rad(needs.peak_angle_rad):9.2f} deg"
            f" {deg_from_rad(needs.peak_speed_rad_s):7.1f} deg/s"
        )


def _sinusoid(planned: Overview) -> Iterator[str]:
    sinusoid, guard = planned.settings.sinusoid, planned.settings.guard
    needs = planned.sinusoid_demand
    yield "Position perturbation (sinusoid)"
    yield (
        f"  ±{sinusoid.amplitude_deg:g} deg at {sinusoid.frequency_hz:g} Hz for "
        f"{sinusoid.motion_s:g} s of {sinusoid.duration_s:g} s, tapers of {sinusoid.taper_s:g} s"
    )
    for name, value, limit, unit in (
        ("peak speed", needs.peak_speed_rad_s, guard.speed_limit_deg_s, "deg/s"),
        (
            "peak acceleration",
            needs.peak_acceleration_rad_s2,
            guard.acceleration_limit_deg_s2,
            "deg/s²",
        ),
        ("angle with the room to stop", needs.reach_rad, guard.position_limit_deg, "deg"),
    ):
        yield f"  {name} {deg_from_rad(value):.4g} {unit} (guard: {limit:g} {unit})"


def _controller(planned: Overview) -> Iterator[str]:
    from rigidimeter.experiment import time_constant_s

    controller = planned.settings.controller
    J, B = controller.inertia_kg_m2, controller.damping_nm_s_rad
    tau_s = time_constant_s(controller)
    yield "Controller (admittance)"
    yield f"  J_c {J:.4g} kg·m²/rad ({rad_from_deg(J):.4g} kg·m²/deg)"
    yield f"  B_c {B:.4g} N·m·s/rad ({rad_from_deg(B):.4g} N·m·s/deg)"
    if math.isfinite(tau_s):
        yield f"  time constant of the free arm J_c/B_c {tau_s:.4g} s"
    else:
        yield "  no damping: the free arm's velocity never settles"


def _bandwidth(planned: Overview) -> Iterator[str]:
    table = planned.bandwidth
    yield f"Bandwidth (−3 dB) of the arm of App. A, J, B, K ±{table.uncertainty_percent:g} %"
    yield "  corner     J kg·m²  B N·m·s/rad  K N·m/rad      Hz"
    for corner in (table.nominal, *table.corners):
        name = "nominal" if not any(corner.signs) else "".join("−0+"[s + 1] for s in corner.signs)
        notes = {table.equation_8.signs: "  Eq. 8", table.widest.signs: "  widest"}
        yield (
            f"  {name:<9} {corner.joint.inertia_kg_m2:8.4f} {corner.joint.damping_nm_s_rad:12.3f}"
            f" {corner.joint.stiffness_nm_rad:10.2f} {corner.bandwidth_hz:7.2f}"
            f"{notes.get(corner.signs, '')}"
        )


def _protocol(planned: Overview) -> Iterator[str]:
    protocol = planned.protocol
    yield f"Protocol (seed {protocol.seed})"
    for (task, condition), epochs in protocol.counts.items():
        yield f"  {condition}, {task}: {epochs} {'epoch' if epochs == 1 else 'epochs'}"
    yield f"  {protocol.total_s:g} s ({protocol.total_s / 60:.1f} min) with the rests"
