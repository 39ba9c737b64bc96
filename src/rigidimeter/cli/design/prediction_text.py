"""The text of `rigidimeter design`: what will come of it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

from rigidimeter.cli.design.design_files import snippet
from rigidimeter.cli.design.design_text import wrapped
from rigidimeter.units import deg_from_rad

if TYPE_CHECKING:
    from rigidimeter.dynamics import Margins
    from rigidimeter.experiment import Alternative, Candidate, Detection, Foresight, Overview

__all__ = [
    "alternative_lines",
    "detection_lines",
    "precision_lines",
    "ranking_lines",
    "stability_lines",
]

_SHOWN = 8
_HEADS = ("J kg·m²", "B N·m·s/rad", "K N·m/rad")
_UNITS = {"inertia": "kg·m²", "damping": "N·m·s/rad", "stiffness": "N·m/rad"}
_EQUAL = {
    "prbs": "PRBS",
    "same_peak_torque": "same peak torque",
    "same_angle_sd": "same angle SD",
    "same_peak_angle": "same peak angle",
}


def stability_lines(planned: Overview, seen: Foresight) -> Iterator[str]:
    """Yield the margins of the loop."""
    ours = planned.settings.margins
    yield "Stability of the admittance on the arm"
    yield "                           gain margin   phase margin   delay margin   modulus   verdict"
    for name, margins in seen.stability.conditions.items():
        yield _margins(f"subject {name}", margins)
        yield _margins("  worst joint around it", seen.stability.worst[name])
    yield (
        f"  worst: each of J, B, K from {ours.joint_factor_low:g} to {ours.joint_factor_high:g} "
        "times its value"
    )
    yield ""


def _margins(name: str, found: Margins) -> str:
    columns = (
        ("never", 9) if math.isinf(found.gain_margin_db) else (f"{found.gain_margin_db:.1f} dB", 9),
        (
            ("never", 12)
            if math.isinf(found.phase_margin_deg)
            else (f"{found.phase_margin_deg:.1f} deg", 12)
        ),
        (
            ("never", 12)
            if math.isinf(found.delay_margin_s)
            else (f"{1000.0 * found.delay_margin_s:.4g} ms", 12)
        ),
        (f"{found.modulus_margin:.2f}", 7),
    )
    text = "   ".join(value.rjust(width) for value, width in columns)
    return f"  {name:<24}  {text}   {'stable' if found.stable else 'UNSTABLE'}"


def precision_lines(planned: Overview, seen: Foresight) -> Iterator[str]:
    """Yield the standard errors of one epoch, and of all planned ones."""
    from rigidimeter.experiment import planned_epochs

    counts = planned_epochs(planned.settings)
    yield "Predicted standard errors of one epoch"
    for name, found in seen.precision.items():
        yield f"  subject {name}".ljust(44) + "".join(head.rjust(21) for head in _HEADS)
        rows = [
            ("bound, every frequency", found.bound.free),
            (f"iv, {_band(found.iv_band_hz)}", found.iv.free),
            (
                f"least squares, passive arm, {_band(found.least_squares_band_hz)}",
                found.least_squares.free,
            ),
        ]
        if counts[name] > 1:
            pooled = math.sqrt(counts[name])
            J, B, K = (error / pooled for error in found.iv.free)
            rows.insert(2, (f"iv, {counts[name]} epochs pooled", (J, B, K)))
        for what, errors in rows:
            yield f"    {what:<40}" + "".join(
                _error(error, value) for error, value in zip(errors, found.values, strict=True)
            )
        if any(found.least_squares_bias):
            off = ", ".join(
                f"{symbol} by {100.0 * bias / value:+.0f} %"
                for symbol, bias, value in zip(
                    "JBK", found.least_squares_bias, found.values, strict=True
                )
                if value
            )
            yield from wrapped(f"  the subject's own torque would put least squares off: {off}")
    for remark in seen.remarks:
        yield from wrapped(f"  {remark}")
    yield ""


def _band(band_hz: tuple[float, float]) -> str:
    low, high = band_hz
    return f"{low:.2g}–{high:.2g} Hz"


def _error(error: float, value: float) -> str:
    percent = f"({100.0 * error / value:.3g} %)" if value else ""
    return f"{error:.3g} {percent}".rjust(21)


def ranking_lines(
    now: Candidate | None, ranked: tuple[Candidate, ...], criterion: str
) -> Iterator[str]:
    """Yield the best sequences of the search, beside the present one."""
    yield f"Search for a PRBS ({len(ranked)} sequences, criterion {criterion}, iv, one epoch)"
    yield (
        "           bits  clock Hz  ±N·m      cost %   J %      B %      K %      angle SD   peak "
        "angle"
    )
    rows = [(f"{k}", found) for k, found in enumerate(ranked[:_SHOWN], start=1)]
    for label, found in [*rows, *([("present", now)] if now else [])]:
        J, B, K = (max(values) for values in zip(*found.errors_percent.values(), strict=True))
        yield (
            f"  {label:<8}{found.prbs.register_bits:5d} {found.prbs.clock_hz:9.4g}"
            f" {found.prbs.amplitude_nm:6.3g} {found.cost_percent:10.3g}   "
            f"{J:<8.3g} {B:<8.3g} {K:<8.3g} {deg_from_rad(found.angle_sd_rad):5.1f} deg"
            f" {deg_from_rad(found.peak_angle_rad):8.1f} deg"
            f"{'' if found.covered else '  misses the band'}"
        )
    yield "  the best one, as settings:"
    yield from (f"    {line}" for line in snippet(ranked[0]).splitlines())
    yield ""


def alternative_lines(found: Alternative) -> Iterator[str]:
    """Yield the standard errors of the multisine beside those of the PRBS."""
    yield f"Multisine (crest factor {found.crest:.3g}), standard errors of iv, one epoch"
    for name, errors in found.errors.items():
        yield f"  subject {name}".ljust(32) + "".join(head.rjust(14) for head in _HEADS)
        for what, values in errors.items():
            yield f"    {_EQUAL[what]:<28}" + "".join(f"{value:14.3g}" for value in values)
    yield ""


def detection_lines(found: Detection, power: float, alpha: float) -> Iterator[str]:
    """Yield how many epochs a difference needs."""
    wanted, effect = found.wanted, found.effect
    unit = _UNITS[wanted.parameter]
    share = f" ({wanted.amount:g} %)" if wanted.percent else ""
    yield (
        f"To detect a {wanted.parameter} different by {abs(effect.difference):.4g} {unit}{share} "
        f"from subject {found.condition}"
    )
    yield f"  an epoch's value scatters by {effect.sd_x:.3g} and {effect.sd_y:.3g} {unit}"
    yield (
        f"  (standard error of iv, and {found.cv_percent:g} % from epoch to epoch: "
        f"subject.{found.condition}.{wanted.parameter}_cv_percent)"
    )
    yield (
        f"  {found.needed.epochs} epochs in each condition give a power of "
        f"{found.needed.power:.2f} (wanted {power:g}; rank-sum test at {alpha:g})"
    )
    yield "  power with " + ", ".join(f"{n}: {value:.2f}" for n, value in found.powers.items())
    if found.planned is not None:
        yield (
            f"  the protocol's {found.planned[0]} and {found.planned[1]} epochs give "
            f"{found.planned_power:.2f}"
        )
    yield ""
