"""A design as lines for a terminal."""

from __future__ import annotations

import math
from collections.abc import Iterator
from decimal import Decimal

from rigidimeter.cli.design_screen import days_needed
from rigidimeter.cli.terminal_tables import Block, Heading, Table
from rigidimeter.core.units import deg_from_rad, rad_from_deg
from rigidimeter.model import Margins
from rigidimeter.planning import (
    Candidate,
    Design,
    MultisineComparison,
    chip_count,
    prbs_period_s,
    prbs_toml,
    time_constant_s,
)

_SHOWN = 8
_HEADS = ("J\n10⁻³ kg·m²", "B\nN·m·s/rad", "K\nN·m/rad")
_SCALES = (1e3, 1.0, 1.0)
"""To the units of `_HEADS`, as J is written everywhere."""

_EQUAL = {
    "prbs": "PRBS",
    "same_peak_torque": "same peak torque",
    "same_angle_sd": "same angle SD",
    "same_peak_angle": "same peak angle",
}


def design_blocks(design: Design) -> Iterator[Block]:
    """Yield the text, section by section."""
    sections = [
        part(design)
        for part in (_prbs, _sinusoid, _controller, _bandwidth, _protocol, _stability, _precision)
    ]
    if design.detections:
        sections.append(days_needed(design.detections))
    if design.ranked is not None:
        sections.append(_ranking(design, design.ranked))
    if design.multisine is not None:
        sections.append(_multisine(design.multisine))
    for section in sections:
        yield from section
        yield ""
    if not design.warnings:
        yield "Everything stays within the guard's limits."
    for warning in (*design.warnings, *design.stability.warnings):
        yield f"Warning: {warning}."


def _prbs(design: Design) -> Iterator[Block]:
    prbs, band = design.settings.prbs, design.band
    low_nm, high_nm = design.perturbation_nm.min(), design.perturbation_nm.max()
    yield Heading("Torque perturbation (PRBS)")
    yield (
        f"  {prbs.register_bits} bits ({chip_count(prbs)} chips) at {prbs.clock_hz:g} Hz, period "
        f"{prbs_period_s(prbs):.4g} s; {prbs.duration_s:g} s at "
        f"{design.settings.rig.tick_rate_hz:g} ticks/s"
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
    yield f"  {band.verdict}"
    rows = []
    for name, needs in design.prbs_demand.items():
        angles = (needs.angle_sd_rad, needs.peak_angle_rad)
        rows.append(
            (
                name,
                *(f"{deg_from_rad(angle):.2f}" for angle in angles),
                f"{deg_from_rad(needs.peak_speed_rad_s):.1f}",
            )
        )
    headings = ("in the ideal loop", "angle SD\ndeg", "peak angle\ndeg", "peak speed\ndeg/s")
    yield Table(headings, rows, "<>>>")


def _sinusoid(design: Design) -> Iterator[Block]:
    sinusoid, guard = design.settings.sinusoid, design.settings.guard
    needs = design.sinusoid_demand
    yield Heading("Position perturbation (sinusoid)")
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


def _controller(design: Design) -> Iterator[Block]:
    controller = design.settings.controller
    J, B = controller.inertia_kg_m2, controller.damping_nm_s_rad
    tau_s = time_constant_s(controller)
    yield Heading("Controller (admittance)")
    yield f"  J_c {J:.4g} kg·m²/rad ({rad_from_deg(J):.4g} kg·m²/deg)"
    yield f"  B_c {B:.4g} N·m·s/rad ({rad_from_deg(B):.4g} N·m·s/deg)"
    if math.isfinite(tau_s):
        yield f"  time constant of the free arm J_c/B_c {tau_s:.4g} s"
    else:
        yield "  no damping: the free arm's velocity never settles"


def _bandwidth(design: Design) -> Iterator[Block]:
    table, forearm = design.bandwidth, design.forearm
    yield Heading(
        f"Bandwidth (−3 dB) of the arm of App. A, J, B, K ±{table.uncertainty_percent:g} %"
    )
    if forearm is not None:
        yield (
            f"  body mass {forearm.body_mass_kg:g} kg, forearm {forearm.length_m:g} m: J is "
            f"the forearm's {forearm.inertia_kg_m2:.3g} kg·m² with the robot's and the "
            "controller's of App. A, B and K are as there"
        )
    eight = "Eq. 8" if forearm is None else "as Eq. 8"
    notes = {table.equation_8.signs: eight, table.widest.signs: "widest"}
    rows = [
        (
            "".join("−0+"[sign + 1] for sign in corner.signs) if any(corner.signs) else "nominal",
            f"{1e3 * corner.joint.inertia_kg_m2:.1f}",
            f"{corner.joint.damping_nm_s_rad:.3f}",
            f"{corner.joint.stiffness_nm_rad:.2f}",
            f"{corner.bandwidth_hz:.2f}",
            notes.get(corner.signs, ""),
        )
        for corner in (table.nominal, *table.corners)
    ]
    yield Table(("corner", *_HEADS, "bandwidth\nHz", ""), rows, "<>>>><")


def _protocol(design: Design) -> Iterator[Block]:
    protocol = design.protocol
    yield Heading(f"Protocol (seed {protocol.seed})")
    for (task, condition), epochs in protocol.counts.items():
        yield f"  {condition}, {task}: {epochs} {'epoch' if epochs == 1 else 'epochs'}"
    yield f"  {protocol.total_s:g} s ({protocol.total_s / 60:.1f} min) with the rests"


def _stability(design: Design) -> Iterator[Block]:
    """Yield the margins of the loop."""
    ours = design.settings.margins
    yield Heading("Stability of the admittance on the arm")
    rows = []
    for name, margins in design.stability.conditions.items():
        rows.append((f"subject {name}", *_margins(margins)))
        rows.append(("worst joint around it", *_margins(design.stability.worst[name])))
    headings = ("", "gain\nmargin", "phase\nmargin", "delay\nmargin", "modulus", "verdict")
    yield Table(headings, rows, "<>>>><")
    yield (
        f"  worst: each of J, B, K from {ours.joint_factor_low:g} to {ours.joint_factor_high:g} "
        "times its value"
    )


def _margins(found: Margins) -> tuple[str, ...]:
    margins = (
        (found.gain_margin_db, f"{found.gain_margin_db:.1f} dB"),
        (found.phase_margin_deg, f"{found.phase_margin_deg:.1f} deg"),
        (found.delay_margin_s, f"{1000.0 * found.delay_margin_s:.4g} ms"),
    )
    return (
        *("never" if math.isinf(value) else text for value, text in margins),
        f"{found.modulus_margin:.2f}",
        "stable" if found.stable else "UNSTABLE",
    )


def _precision(design: Design) -> Iterator[Block]:
    """Yield the standard errors of one epoch, and of all planned ones."""
    counts = design.planned_epochs
    yield Heading("Predicted standard errors of one epoch")
    for name, found in design.precision.items():
        errors = [
            ("bound, every frequency", found.bound.free),
            (f"iv, {_band(found.iv_band_hz)}", found.iv.free),
            (
                f"least squares, passive arm, {_band(found.least_squares_band_hz)}",
                found.least_squares.free,
            ),
        ]
        if counts[name] > 1:
            errors.insert(2, (f"iv, {counts[name]} epochs pooled", found.iv_pooled(counts[name])))
        rows = [(what, *map(_error, values, found.values, _SCALES)) for what, values in errors]
        yield Table((f"subject {name}", *_HEADS), rows, "<>>>")
        if any(found.least_squares_bias):
            off = ", ".join(
                f"{symbol} by {100.0 * bias / value:+.0f} %"
                for symbol, bias, value in zip(
                    "JBK", found.least_squares_bias, found.values, strict=True
                )
                if value
            )
            yield f"  the subject's own torque would bias least squares: {off}"
    for remark in design.remarks:
        yield f"  {remark}"


def _band(band_hz: tuple[float, float]) -> str:
    low, high = band_hz
    return f"{low:.2g}–{high:.2g} Hz"


def _error(error: float, value: float, scale: float) -> str:
    share = f" ({100.0 * error / value:.2g} %)" if value else ""
    return _plain(scale * error) + share


def _plain(value: float, digits: int = 2) -> str:
    """Return a number of so many digits without an exponent.

    Examples
    --------
    >>> _plain(0.00009163), _plain(0.01234, 3)
    ('0.000092', '0.0123')
    """
    return f"{Decimal(f'{value:.{digits}g}'):f}"


def _ranking(design: Design, ranked: tuple[Candidate, ...]) -> Iterator[Block]:
    """Yield the best sequences of the search, beside the present one."""
    now = design.present
    yield Heading(
        f"Search for a PRBS ({len(ranked)} sequences, criterion {design.criterion}, iv, one epoch)"
    )
    rows = []
    best = [(f"{k}", found) for k, found in enumerate(ranked[:_SHOWN], start=1)]
    for label, found in [*best, *([("present", now)] if now else [])]:
        largest = (max(values) for values in zip(*found.errors_percent.values(), strict=True))
        rows.append(
            (
                label,
                f"{found.prbs.register_bits}",
                f"{found.prbs.clock_hz:.4g}",
                f"{found.prbs.amplitude_nm:.3g}",
                f"{found.cost_percent:.3g}",
                *(f"{percent:.3g}" for percent in largest),
                f"{deg_from_rad(found.angle_sd_rad):.1f}",
                f"{deg_from_rad(found.peak_angle_rad):.1f}",
                "" if found.covered else "misses the band",
            )
        )
    headings = ("", "bits", "clock\nHz", "±N·m", "cost\n%", "J\n%", "B\n%", "K\n%",
                "angle SD\ndeg", "peak\ndeg", "")  # fmt: skip
    yield Table(headings, rows, "<>>>>>>>>><")
    yield "  the best one, as settings:"
    yield from (f"    {line}" for line in prbs_toml(ranked[0].prbs).splitlines())


def _multisine(found: MultisineComparison) -> Iterator[Block]:
    """Yield the standard errors of the multisine beside those of the PRBS."""
    yield Heading(
        f"Multisine (crest factor {found.crest_factor:.3g}), standard errors of iv, one epoch"
    )
    for name, errors in found.errors.items():
        rows = [
            (
                _EQUAL[what],
                *(_plain(scale * value, 3) for scale, value in zip(_SCALES, values, strict=True)),
            )
            for what, values in errors.items()
        ]
        yield Table((f"subject {name}", *_HEADS), rows, "<>>>")
