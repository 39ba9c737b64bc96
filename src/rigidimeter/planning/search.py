"""Search for the PRBS with the smallest predicted errors: clock, register bits and amplitude.

Standard errors fall as one over the amplitude, so each sequence is made as strong as the guard
allows: angle with the room to stop, speed and acceleration of the command, each less the margin
that `optimise.limit_margin_percent` keeps in hand, and less three standard deviations of what the
subject's own torque adds. Then the sequences are ranked, smallest first, by the worst over the
joints of

- minimax: the largest relative standard error of J, B and K;
- A: the root mean square of the three;
- D: their geometric mean with the correlations, det(covariance)^(1/6).

All three are those of `iv` for one epoch, and all are in percent of the joint's values. Sequences
that cover the wanted band come before those that miss it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from rigidimeter.core.errors import UserError
from rigidimeter.core.files import toml_text
from rigidimeter.core.settings import PrbsSettings, Settings
from rigidimeter.core.units import rad_from_deg
from rigidimeter.model import (
    Array,
    ClosedLoopMotion,
    closed_loop_motion,
    median_joint,
    voluntary_motion_sd,
)
from rigidimeter.planning.motion_demand import demand
from rigidimeter.planning.perturbation_band import check_band
from rigidimeter.planning.perturbations import prbs_nm
from rigidimeter.planning.precision import predicted_precision

_VOLUNTARY_SDS = 3.0
_HALVINGS = 30


@dataclass(frozen=True)
class Candidate:
    """One sequence, as strong as the guard allows.

    Attributes
    ----------
    prbs : PrbsSettings
    cost_percent : float
        The criterion.
    errors_percent : dict of str to (float, float, float)
        Relative standard errors of J, B and K for each condition.
    angle_sd_rad, peak_angle_rad : float
        The largest over the conditions, of the motion that the perturbation causes.
    covered : bool
        Whether the sequence covers the wanted band.
    """

    prbs: PrbsSettings
    cost_percent: float
    errors_percent: dict[str, tuple[float, float, float]]
    angle_sd_rad: float
    peak_angle_rad: float
    covered: bool


CRITERIA: Mapping[str, Callable[[Array], float]] = {
    "minimax": lambda relative: math.sqrt(float(np.max(np.diag(relative)))),
    "A": lambda relative: math.sqrt(float(np.mean(np.diag(relative)))),
    "D": lambda relative: float(np.linalg.det(relative)) ** (1.0 / 6.0),
}
"""From the covariance of the relative errors to one number in %; the default comes first."""


def prbs_toml(prbs: PrbsSettings) -> str:
    """Return the values that a search varies as a table of settings, in TOML."""
    return toml_text(
        {"prbs": prbs.model_dump(include={"register_bits", "clock_hz", "amplitude_nm"})}
    )


def check_criterion(criterion: str) -> None:
    """Refuse a criterion that is not one of `CRITERIA`.

    Raises
    ------
    UserError
    """
    if criterion not in CRITERIA:
        raise UserError(
            f"the criterion {criterion!r} is unknown; it must be one of {', '.join(CRITERIA)}"
        )


def assess(settings: Settings, criterion: str = "minimax") -> Candidate | None:
    """Return the settings' own PRBS at its own amplitude; None if no error can be predicted."""
    unit = settings.prbs.model_copy(update={"amplitude_nm": 1.0})
    return _candidate(settings, unit, criterion, lambda _: settings.prbs.amplitude_nm)


def optimise(
    settings: Settings,
    criterion: str = "minimax",
    progress: Callable[[float], None] = lambda _: None,
) -> tuple[Candidate, ...]:
    """Return the sequences of the search, best first.

    The first entry may be worse than the settings' own sequence if that is stronger than the
    margins of the search allow. `progress` is called with the share of the sequences that was done
    since, 1 in all.

    Raises
    ------
    UserError
        If the criterion is unknown, a joint has a value of 0, or no sequence fits the guard.
    """
    check_criterion(criterion)
    for name, subject in settings.subject.items():
        if 0.0 in (subject.damping_nm_s_rad, subject.stiffness_nm_rad):
            raise UserError(
                f"subject.{name} has a damping or stiffness of 0, so no error can be a "
                "percentage; give both a value greater than 0"
            )
    moved = {
        name: voluntary_motion_sd(settings, subject) for name, subject in settings.subject.items()
    }

    def strongest(unit_torque_nm: Array) -> float:
        motions = [
            (
                closed_loop_motion(unit_torque_nm, settings, median_joint(settings.subject[name])),
                *sds,
            )
            for name, sds in moved.items()
        ]
        # Rounded down to the digits that are printed and written.
        return math.floor(1000.0 * strongest_amplitude_nm(motions, settings)) / 1000.0

    sequences = list(_sequences(settings))
    found = []
    for prbs in sequences:
        candidate = _candidate(settings, prbs, criterion, strongest)
        if candidate is not None:
            found.append(candidate)
        progress(1.0 / len(sequences))
    if not found:
        raise UserError(
            "no sequence within [optimise] stays within the guard's limits at any amplitude"
        )
    return tuple(
        sorted(found, key=lambda candidate: (not candidate.covered, candidate.cost_percent))
    )


def strongest_amplitude_nm(
    motions: list[tuple[ClosedLoopMotion, float, float]], settings: Settings
) -> float:
    """Return how strong a perturbation may be, in N·m; 0 where nothing is left of the limits.

    Parameters
    ----------
    motions : list of (motion, angle_sd_rad, velocity_sd_rad_s)
        For each joint, the motion of 1 N·m and the SD of what the subject adds.
    settings : Settings
        For the guard and for the margin.
    """
    guard, search = settings.guard, settings.optimise
    left = 1.0 - search.limit_margin_percent / 100.0

    def fits(amplitude_nm: float) -> bool:
        for motion, angle_sd, velocity_sd in motions:
            needs = demand(
                amplitude_nm * motion.angle_rad,
                amplitude_nm * motion.command_rad_s,
                settings.rig.tick_rate_hz,
                guard,
            )
            angle = needs.reach_rad + _VOLUNTARY_SDS * angle_sd
            speed = needs.peak_speed_rad_s + _VOLUNTARY_SDS * velocity_sd
            if (
                angle > left * rad_from_deg(guard.position_limit_deg)
                or speed > left * rad_from_deg(guard.speed_limit_deg_s)
                or needs.peak_acceleration_rad_s2
                > left * rad_from_deg(guard.acceleration_limit_deg_s2)
            ):
                return False
        return True

    if fits(search.amplitude_high_nm):
        return search.amplitude_high_nm
    low, high = 0.0, search.amplitude_high_nm
    for _ in range(_HALVINGS):
        middle = (low + high) / 2.0
        low, high = (middle, high) if fits(middle) else (low, middle)
    return low


def _sequences(settings: Settings) -> Iterator[PrbsSettings]:
    """Yield the sequences of the search with an amplitude of 1 N·m."""
    search = settings.optimise
    clocks = np.geomspace(search.clock_low_hz, search.clock_high_hz, search.clocks)
    for clock_hz in np.unique(np.round(clocks, 1)).tolist():
        if clock_hz > settings.rig.tick_rate_hz or clock_hz < 0.1:
            continue
        for bits in range(search.bits_low, search.bits_high + 1):
            yield settings.prbs.model_copy(
                update={"clock_hz": clock_hz, "register_bits": bits, "amplitude_nm": 1.0}
            )


def _candidate(
    settings: Settings,
    unit: PrbsSettings,
    criterion: str,
    amplitude_of: Callable[[Array], float],
) -> Candidate | None:
    """Return a sequence at the amplitude that its torque of 1 N·m calls for; None if it cannot run.

    The relative errors of 1 N·m are divided by the amplitude.
    """
    rate_hz = settings.rig.tick_rate_hz
    try:
        torque = prbs_nm(unit, rate_hz)
        precisions = {
            name: predicted_precision(torque, settings, subject)
            for name, subject in settings.subject.items()
        }
    except UserError:
        return None  # over before it changes level, or too few lines in the band
    amplitude = amplitude_of(torque)
    if amplitude == 0.0:
        return None
    relative = {  # covariances in %²
        name: found.covariance * 1e4 / np.outer(found.values, found.values) / amplitude**2
        for name, found in precisions.items()
    }
    prbs = unit.model_copy(update={"amplitude_nm": amplitude})
    errors = {name: np.sqrt(np.diag(matrix)).tolist() for name, matrix in relative.items()}
    return Candidate(
        prbs=prbs,
        cost_percent=max(CRITERIA[criterion](matrix) for matrix in relative.values()),
        errors_percent={name: (J, B, K) for name, (J, B, K) in errors.items()},
        angle_sd_rad=amplitude * max(found.angle_sd_rad for found in precisions.values()),
        peak_angle_rad=amplitude * max(found.peak_angle_rad for found in precisions.values()),
        covered=check_band(prbs, rate_hz).covered,
    )
