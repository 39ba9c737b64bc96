"""The numbers of `rigidimeter design` as JSON."""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from rigidimeter.units import rad_from_deg

if TYPE_CHECKING:
    from rigidimeter.dynamics import Margins
    from rigidimeter.experiment import (
        Alternative,
        Candidate,
        Corner,
        Detection,
        Errors,
        Foresight,
        Overview,
        Precision,
    )

__all__ = ["SCHEMA", "document"]

SCHEMA = "rigidimeter.design/1"


def document(
    planned: Overview,
    seen: Foresight,
    ranked: tuple[Candidate, ...] | None,
    alternative: Alternative | None,
    detections: list[Detection],
) -> dict[str, Any]:
    """Return all numbers as plain values, units in the names; what was not asked for is null."""
    return {
        "schema": SCHEMA,
        **_commanded(planned),
        "stability": {
            "conditions": {n: _margins(m) for n, m in seen.stability.conditions.items()},
            "worst": {n: _margins(m) for n, m in seen.stability.worst.items()},
        },
        "precision": {
            name: _precision(planned, name, found) for name, found in seen.precision.items()
        },
        "optimised": None if ranked is None else [_candidate(found) for found in ranked],
        "multisine": None if alternative is None else _alternative(alternative),
        "detection": [_detection(found) for found in detections],
        "warnings": [*planned.warnings, *seen.stability.warnings],
        "remarks": list(seen.remarks),
    }


def _number(value: float) -> float | None:
    """Return a number, or None for what JSON has no word for."""
    return value if math.isfinite(value) else None


def _margins(margins: Margins) -> dict[str, Any]:
    values = asdict(margins)
    joint = values.pop("joint")
    numbers = {
        name: value if isinstance(value, bool) else _number(value) for name, value in values.items()
    }
    return {**joint, **numbers}


def _named(values: tuple[float, ...]) -> dict[str, float]:
    from rigidimeter.experiment import PARAMETERS

    return dict(zip(PARAMETERS[-len(values) :], values, strict=True))


def _errors(errors: Errors) -> dict[str, Any]:
    return {"free": _named(errors.free), "fixed_inertia": _named(errors.fixed_inertia)}


def _precision(planned: Overview, name: str, found: Precision) -> dict[str, Any]:
    from rigidimeter.experiment import planned_epochs

    epochs = planned_epochs(planned.settings)[name]
    return {
        "joint": vars(found.joint),
        "iv_band_hz": list(found.iv_band_hz),
        "least_squares_band_hz": list(found.least_squares_band_hz),
        "bound": _errors(found.bound),
        "iv": _errors(found.iv),
        "least_squares": _errors(found.least_squares),
        "least_squares_bias": _named(found.least_squares_bias),
        "angle_sd_rad": found.angle_sd_rad,
        "peak_angle_rad": found.peak_angle_rad,
        "planned_epochs": epochs,
        "iv_pooled": (
            _named(tuple(error / math.sqrt(epochs) for error in found.iv.free)) if epochs else None
        ),
    }


def _candidate(found: Candidate) -> dict[str, Any]:
    prbs = found.prbs
    return {
        "register_bits": prbs.register_bits,
        "clock_hz": prbs.clock_hz,
        "amplitude_nm": prbs.amplitude_nm,
        "cost_percent": found.cost_percent,
        "errors_percent": {n: _named(errors) for n, errors in found.errors_percent.items()},
        "angle_sd_rad": found.angle_sd_rad,
        "peak_angle_rad": found.peak_angle_rad,
        "covered": found.covered,
    }


def _alternative(found: Alternative) -> dict[str, Any]:
    return {
        "crest_factor": found.crest,
        "standard_errors": {
            name: {what: _named(values) for what, values in errors.items()}
            for name, errors in found.errors.items()
        },
    }


def _detection(found: Detection) -> dict[str, Any]:
    return {
        "parameter": found.wanted.parameter,
        "condition": found.condition,
        "difference": found.effect.difference,
        "epoch_sd": [found.effect.sd_x, found.effect.sd_y],
        "cv_percent": found.cv_percent,
        "epochs_needed": found.needed.epochs,
        "power": found.needed.power,
        "powers": {str(n): power for n, power in found.powers.items()},
        "planned_epochs": None if found.planned is None else list(found.planned),
        "planned_power": _number(found.planned_power),
    }


def _commanded(planned: Overview) -> dict[str, Any]:
    """Return what will be commanded as plain values, units in the names."""
    from rigidimeter.experiment import period_s, time_constant_s

    settings, band, table = planned.settings, planned.band, planned.bandwidth
    controller = settings.controller
    tau_s = time_constant_s(controller)
    return {
        "prbs": {
            **settings.prbs.model_dump(),
            "tick_rate_hz": settings.rig.tick_rate_hz,
            "period_s": period_s(settings.prbs),
            "level_low_nm": float(planned.perturbation_nm.min()),
            "level_high_nm": float(planned.perturbation_nm.max()),
            **{name: value for name, value in vars(band).items() if not name.startswith("enough")},
            "enough": {
                "register_bits": band.enough.register_bits,
                "clock_hz": band.enough.clock_hz,
                "duration_s": band.enough.duration_s,
                "tick_rate_hz": band.enough_rate_hz,
            },
            "response": {name: vars(needs) for name, needs in planned.prbs_demand.items()},
        },
        "bandwidth": {
            "uncertainty_percent": table.uncertainty_percent,
            "nominal": _corner(table.nominal),
            "corners": [_corner(corner) for corner in table.corners],
            "equation_8": _corner(table.equation_8),
            "widest": _corner(table.widest),
        },
        "sinusoid": {
            **settings.sinusoid.model_dump(),
            "response": vars(planned.sinusoid_demand),
        },
        "protocol": {
            "seed": planned.protocol.seed,
            "total_s": planned.protocol.total_s,
            "counts": [
                {"task": task, "condition": condition, "epochs": epochs}
                for (task, condition), epochs in planned.protocol.counts.items()
            ],
            "epochs": [vars(epoch) for epoch in planned.protocol.epochs],
        },
        "controller": {
            **controller.model_dump(),
            "inertia_kg_m2_per_deg": rad_from_deg(controller.inertia_kg_m2),
            "damping_nm_s_deg": rad_from_deg(controller.damping_nm_s_rad),
            "time_constant_s": tau_s if math.isfinite(tau_s) else None,
        },
        "guard": settings.guard.model_dump(),
    }


def _corner(corner: Corner) -> dict[str, Any]:
    return {
        "signs": list(corner.signs),
        **vars(corner.joint),
        "bandwidth_hz": corner.bandwidth_hz,
    }
