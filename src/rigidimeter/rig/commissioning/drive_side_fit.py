"""The drive's side as moves show it: the model by which the guard compares two torques.

    M = a T + α T' − J_d θ'' − F_c sgn θ' − D θ' + c          (`rig.guard.drive_torque`)

a is found from the same slow swing without and with a known torque on the joint. Inertia, friction
and its variation with the angle are the same in both, so that a is the mean change of M over that
of T. The other parameters are a least-squares fit of M − a T, with J_d, F_c and D not below zero,
where the drive is known to slip.

The signals are those of the guard's own steps. The scatter of e is its root mean square in the slow
and the fast move, where the friction shows; its share is that of the drive's own torques in the
quick moves, where the inertia does.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from scipy.optimize import lsq_linear

from rigidimeter.core.settings import Settings
from rigidimeter.rig.commissioning.trials import Array, Readings
from rigidimeter.rig.guard import (
    SETTLED_S,
    DriveModel,
    Terms,
    beyond,
    drive_torque_limits,
    drive_torque_state,
    drive_torque_step,
    from_drive,
)

KNOWN = 0.15
"""With more of the time unknown friction, a step is not fitted."""

MIN_STEPS = 40
NO_LIMIT_NM = 1e9
NAMES = tuple(f"drive_side_{name}" for name in DriveModel._fields)
"""The model in the numbers of a record."""

ZERO = "drive_side_zero_nm"


class Moved(NamedTuple):
    """What the guard's steps made of a move: filtered signals, e, and the drive's own torques."""

    terms: Array
    beyond_nm: Array
    own_nm: Array


class ScaleFound(NamedTuple):
    """a with its standard error, and the change of M that it is from."""

    scale: float
    scale_se: float
    change_nm: float


def stepped(settings: Settings, readings: Readings, model: DriveModel | None = None) -> Moved:
    """Take the guard's steps over a move, without its decision.

    Returns
    -------
    Moved
        Of the steps after the filters have settled; `terms` has shape (steps, 7), in the order of
        `Terms`.
    """
    model = (model or DriveModel())._replace(scatter_nm=NO_LIMIT_NM)
    limits = drive_torque_limits(settings, model)
    state = drive_torque_state(limits)
    due_s = readings.time_s - readings.lateness_s
    elapsed = np.ones(len(due_s), dtype=int)
    elapsed[1:] = np.rint(np.diff(due_s) * settings.rig.tick_rate_hz)
    columns = (
        *(readings.torque_nm, due_s - readings.torque_time_s, readings.angle_rad),
        *(readings.velocity_rad_s, due_s - readings.motion_time_s),
        *(readings.drive_torque_nm, due_s - readings.drive_torque_time_s),
    )
    found: list[Terms] = []
    for row in zip(*(column.tolist() for column in columns), elapsed.tolist(), strict=True):
        state, _ = drive_torque_step(limits, state, *row)
        if state.readings == 0 and state.steps.settled_s > SETTLED_S:
            found.append(state.steps.terms)
    terms = np.array(found, dtype=float).reshape(-1, len(Terms._fields))
    left = [beyond(model, one, from_drive(model, one)) for one in found]
    own = [
        math.hypot(model.scale * one.drive_nm, model.inertia_kg_m2 * one.acceleration_rad_s2)
        for one in found
    ]
    return Moved(terms, np.array(left), np.array(own))


def found_scale(without: Array, loaded: Array) -> ScaleFound | None:
    """Return a from the terms of the same swing without and with a torque; None if none shows.

    Both end with it.
    """
    n = min(len(without), len(loaded))
    without, loaded = without[-n:], loaded[-n:]
    slips = np.maximum(without[:, -1], loaded[:, -1]) < KNOWN
    if np.count_nonzero(slips) < MIN_STEPS // 2:
        return None
    of_sensor, of_drive = (loaded - without)[slips, :2].T
    change_nm, by_drive_nm = float(np.mean(of_sensor)), float(np.mean(of_drive))
    if by_drive_nm == 0.0:
        return None
    scale = change_nm / by_drive_nm
    # Neighbouring steps are alike: what is independent is as many as windows.
    apart = of_sensor - scale * of_drive
    windows = max(np.count_nonzero(slips) / MIN_STEPS, 1.0)
    return ScaleFound(
        scale, float(np.std(apart)) / math.sqrt(windows) / abs(by_drive_nm), change_nm
    )


def fitted(scale: float, moves: Sequence[Array]) -> DriveModel | None:
    """Return the model, without scatter, from the terms of moves; None if the drive hardly slid."""
    terms = np.concatenate(moves)
    terms = terms[terms[:, -1] < KNOWN]
    if len(terms) < MIN_STEPS:
        return None
    torque, drive, drive_per_s, acceleration, sign, velocity, _ = terms.T
    table = np.stack(
        [scale * drive_per_s, -acceleration, -sign, -velocity, np.ones_like(sign)], axis=1
    )
    bounds = ([-np.inf, 0.0, 0.0, 0.0, -np.inf], np.inf)
    late_s, inertia, friction, damping, zero = lsq_linear(
        table, torque - scale * drive, bounds=bounds
    ).x.tolist()
    return DriveModel(scale, late_s, inertia, friction, damping, zero)


def with_scatter(
    settings: Settings, model: DriveModel, wide: Sequence[Readings], quick: Sequence[Readings]
) -> DriveModel:
    """Return the model with the scatter of e in wide moves, and its share in quick ones."""
    shares = []
    for readings in quick:
        moved = stepped(settings, readings, model)
        shares.append(_rms(moved.beyond_nm) / max(_rms(moved.own_nm), 1e-9))
    return model._replace(
        scatter_nm=max(_rms(stepped(settings, readings, model).beyond_nm) for readings in wide),
        scatter_share=max(shares),
    )


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2))) if len(values) else 0.0


def as_numbers(model: DriveModel) -> dict[str, float]:
    """Return the model as numbers of a record."""
    return dict(zip(NAMES, model, strict=True))


def model_in(numbers: Mapping[str, float]) -> DriveModel | None:
    """Return the model that a record's numbers hold; None if there is none."""
    if not all(name in numbers for name in NAMES):
        return None
    return DriveModel(*(numbers[name] for name in NAMES))


def with_zero(settings: Settings, model: DriveModel, moves: Sequence[Readings]) -> DriveModel:
    """Return the model with the zero that these moves show, where the drive is known to slip."""
    left = []
    for readings in moves:
        for row in stepped(settings, readings, model).terms:
            terms = Terms(*row)
            if terms.unknown < KNOWN:
                left.append(terms.torque_nm - from_drive(model, terms))
    return model._replace(zero_nm=model.zero_nm + float(np.mean(left)) if left else model.zero_nm)


def model_of_today(
    commissioned: Mapping[str, float], today: Mapping[str, float]
) -> DriveModel | None:
    """Return the model in the numbers of a commissioning record, with the zero of the daily check.

    None if the record holds none: the law is off.
    """
    model = model_in(commissioned)
    if model is None:
        return None
    return model._replace(zero_nm=today.get(ZERO, model.zero_nm))
