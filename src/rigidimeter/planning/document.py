"""A design as one document of plain values, units in the names (`rigidimeter.design/3`)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from rigidimeter.core.files import plain_values
from rigidimeter.core.records import PARAMETERS
from rigidimeter.core.units import rad_from_deg
from rigidimeter.model import Margins
from rigidimeter.planning.days_needed import Detection, Needed
from rigidimeter.planning.joint_bandwidth import Corner
from rigidimeter.planning.motion_demand import time_constant_s
from rigidimeter.planning.overview import Design
from rigidimeter.planning.perturbations import prbs_period_s
from rigidimeter.planning.plan_sentence import plan_sentence
from rigidimeter.planning.precision import PARAMETER_NAMES, Errors, PredictedPrecision
from rigidimeter.planning.search import Candidate

DESIGN_SCHEMA = "rigidimeter.design/3"


def design_document(design: Design) -> dict[str, Any]:
    """Return all numbers of a design; what was not asked for, and what is not finite, is None."""
    multisine, ranked = design.multisine, design.ranked
    document = {
        "schema": DESIGN_SCHEMA,
        **_commanded(design),
        "stability": {
            "conditions": {n: _margins(m) for n, m in design.stability.conditions.items()},
            "worst": {n: _margins(m) for n, m in design.stability.worst.items()},
        },
        "precision": {
            name: _precision(found, design.planned_epochs[name])
            for name, found in design.precision.items()
        },
        "optimised": None if ranked is None else [_candidate(found) for found in ranked],
        "multisine": multisine
        and {
            "crest_factor": multisine.crest_factor,
            "standard_errors": {
                name: {what: _named(values) for what, values in errors.items()}
                for name, errors in multisine.errors.items()
            },
        },
        "detection": [_detection(found) for found in design.detections],
        "warnings": [*design.warnings, *design.stability.warnings],
        "remarks": design.remarks,
    }
    return dict(plain_values(document))


def _commanded(design: Design) -> dict[str, Any]:
    settings, band, table, protocol = (
        design.settings,
        design.band,
        design.bandwidth,
        design.protocol,
    )
    controller, enough = settings.controller, band.enough
    return {
        "prbs": {
            **settings.prbs.model_dump(),
            "tick_rate_hz": settings.rig.tick_rate_hz,
            "period_s": prbs_period_s(settings.prbs),
            "level_low_nm": float(design.perturbation_nm.min()),
            "level_high_nm": float(design.perturbation_nm.max()),
            **{name: value for name, value in vars(band).items() if not name.startswith("enough")},
            "enough": {
                "register_bits": enough.register_bits,
                "clock_hz": enough.clock_hz,
                "duration_s": enough.duration_s,
                "tick_rate_hz": band.enough_rate_hz,
            },
            "response": {name: vars(needs) for name, needs in design.prbs_demand.items()},
        },
        "bandwidth": {
            "uncertainty_percent": table.uncertainty_percent,
            "forearm": design.forearm and design.forearm._asdict(),
            "nominal": _corner(table.nominal),
            "corners": [_corner(corner) for corner in table.corners],
            "equation_8": _corner(table.equation_8),
            "widest": _corner(table.widest),
        },
        "sinusoid": {**settings.sinusoid.model_dump(), "response": vars(design.sinusoid_demand)},
        "protocol": {
            "seed": protocol.seed,
            "total_s": protocol.total_s,
            "counts": [
                {"task": task, "condition": condition, "epochs": epochs}
                for (task, condition), epochs in protocol.counts.items()
            ],
            "epochs": [vars(epoch) for epoch in protocol.epochs],
        },
        "controller": {
            **controller.model_dump(),
            "inertia_kg_m2_per_deg": rad_from_deg(controller.inertia_kg_m2),
            "damping_nm_s_deg": rad_from_deg(controller.damping_nm_s_rad),
            "time_constant_s": time_constant_s(controller),
        },
        "guard": settings.guard.model_dump(),
    }


def _corner(corner: Corner) -> dict[str, Any]:
    return {
        "signs": corner.signs,
        **vars(corner.joint),
        "bandwidth_hz": corner.bandwidth_hz,
    }


def _margins(margins: Margins) -> dict[str, Any]:
    values = asdict(margins)
    return {**values.pop("joint"), **values}


def _named(values: Sequence[float]) -> dict[str, float]:
    """Return the last parameters by their names: all three, or B and K."""
    return dict(zip(PARAMETER_NAMES[-len(values) :], values, strict=True))


def _errors(errors: Errors) -> dict[str, Any]:
    return {"free": _named(errors.free), "fixed_inertia": _named(errors.fixed_inertia)}


def _precision(found: PredictedPrecision, epochs: int) -> dict[str, Any]:
    pooled = _named(found.iv_pooled(epochs)) if epochs else None
    return {
        "joint": vars(found.joint),
        "iv_band_hz": found.iv_band_hz,
        "least_squares_band_hz": found.least_squares_band_hz,
        "bound": _errors(found.bound),
        "iv": _errors(found.iv),
        "least_squares": _errors(found.least_squares),
        "least_squares_bias": _named(found.least_squares_bias),
        "angle_sd_rad": found.angle_sd_rad,
        "peak_angle_rad": found.peak_angle_rad,
        "planned_epochs": epochs,
        "iv_pooled": pooled,
    }


def _candidate(found: Candidate) -> dict[str, Any]:
    prbs, values = found.prbs, {**vars(found)}
    values.pop("prbs")
    return {
        "register_bits": prbs.register_bits,
        "clock_hz": prbs.clock_hz,
        "amplitude_nm": prbs.amplitude_nm,
        **values,
        "errors_percent": {n: _named(errors) for n, errors in found.errors_percent.items()},
    }


def _detection(found: Detection) -> dict[str, Any]:
    return {
        "parameter": found.wanted.parameter,
        "condition": found.condition,
        "unit": next(one.unit for one in PARAMETERS if one.name.startswith(found.wanted.parameter)),
        "value": found.value,
        "difference": found.difference,
        "power": found.power,
        "alpha": found.alpha,
        "primary": {"measures": list(found.primary.measures), "rule": found.primary.rule},
        "level": found.level,
        "after": [one.wanted.parameter for one in found.before],
        "epoch_se": found.epoch_se,
        "scatter": vars(found.scatter),
        "needed": [_needed(each) for each in found.needed],
        "planned": found.planned and _needed(found.planned),
        "sentence": plan_sentence(found),
    }


def _needed(found: Needed) -> dict[str, Any]:
    return {
        "epochs_a_day": found.epochs,
        "days_needed": found.days,
        "days_needed_alone": found.days_alone,
        "subjects_needed": found.subjects,
        "day_sd": found.day_sd,
    }
