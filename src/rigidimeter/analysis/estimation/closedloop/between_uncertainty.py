"""Whether J, B and K hang on what the drive did between the samples, where nothing was measured.

The drive is known by how it explains the velocity at its samples. Drives that explain it as well
give other parameters where the samples are too few to tell them apart. The largest change is δ;
where it is more than a tenth of the parameter, what the drive tells is itself uncertain, its sign
included, and δ is at least twice what it changes. δ is added to both ends of the interval,

    low = p̂ − t s − δ        high = p̂ + t s + δ

with s the standard error and t Student's quantile; pooled epochs share the drive, so δ does not
fall with their number. Where δ is more than a share of the parameter, and more than its standard
error, it has the finding.
"""

from __future__ import annotations

import numpy as np

from rigidimeter.analysis.estimation.closedloop.between_samples import assumed_ticks_hz
from rigidimeter.analysis.estimation.closedloop.normal_equations import solution, sums
from rigidimeter.analysis.estimation.closedloop.observation import Observation
from rigidimeter.analysis.estimation.closedloop.refine import LineFit
from rigidimeter.analysis.estimation.found import found
from rigidimeter.analysis.estimation.signals import Array
from rigidimeter.core.findings import Effect, Finding
from rigidimeter.core.records import Epoch
from rigidimeter.core.settings import Settings

NAME = "between_samples"

UNSETTLED = 0.1
"""A parameter that another drive changes by more than this share hangs on the drive."""


def moved_elsewhere(fit: LineFit) -> Array:
    """Return δ of a fit, shape (p,)."""
    values, moved = fit.values, [problem.observation.otherwise for problem in fit.problems]
    count = max(map(len, moved))
    if not count:
        return np.zeros(values.size)
    grams = np.repeat(fit.gram[None], count, axis=0)
    moments = grams @ values
    # Another motion adds its difference to the sums.
    for problem, power, more in zip(fit.problems, fit.powers, moved, strict=True):
        held = len(problem.held)
        target = -(more[:, :, :held] @ np.array(problem.held)) if held else 0 * problem.target
        change = problem._replace(regressors=more[:, :, held:], target=target)
        added, more_moment, _ = sums([change], [power])
        grams[: len(more)] += added
        moments[: len(more)] += more_moment
    without, *others = np.abs(solution(grams, moments) - values)
    most = np.max(others, axis=0)
    return np.asarray(
        np.where(most > UNSETTLED * np.abs(values), np.maximum(most, 2 * without), most)
    )


def between_samples(
    epoch: Epoch,
    observation: Observation,
    values: Array,
    between: Array,
    standard_errors: Array,
    settings: Settings,
) -> tuple[Finding, ...]:
    """Return the finding `between_samples` of a fit; none where it hangs on nothing unknown.

    Parameters
    ----------
    epoch : Epoch
    observation : Observation
    values, between : array, shape (p,)
        The parameters, J first unless it was held, and how far they may be elsewhere.
    standard_errors : array, shape (p,)
        Where δ is below them the interval is hardly wider by it.
    settings : Settings
    """
    diagnostics, rig = settings.diagnostics, settings.rig
    most, known = diagnostics.max_between_samples_percent, observation.drive_known
    condition = epoch.condition
    in_loop = observation.perturbation is not None or "velocity_command_rad_s" in epoch.channels
    if in_loop and not known:
        return ()  # `drive_check` says more
    share, held = 100.0 * between / np.abs(values), np.zeros(3 - values.size)  # is not moved
    percent = np.concatenate([held, share])
    shows = np.concatenate([held, np.where(between > standard_errors, share, 0.0)])
    # Of a drive that is not known J says most: it is what the torque does not see between samples.
    about = int(np.argmax(shows)) if known else 0
    if shows[about] <= most:
        return ()
    J, B, K = percent.tolist()
    return (
        found(
            NAME,
            diagnostics,
            float(percent[about]),
            most,
            condition=condition,
            effect=Effect((J, B, K)),
            facts={
                "symbol": "JBK"[about],
                "bandwidth_hz": rig.drive_bandwidth_hz,
                "ticks_hz": assumed_ticks_hz(rig, epoch.channels["torque_nm"]),
            },
            variant="" if known else "of_settings",
        ),
    )
