"""How late the torque of a recording is, before anything is fitted or scored.

An amplifier's filter or a bus that stamps late shifts one channel against the other: 10 ms take 7 %
off the work of a cycle and turn stiffness into damping. With the delay τ as a further parameter

    y = e^(−iωτ) X p        columns e^(−iωτ) X and −iω e^(−iωτ) X p

it is solved for like J, B and K, by the perturbation where that was recorded. Friction, a reflex
and a soft cuff turn the torque against the motion as a delay does: the torque is moved only where
the test of all terms (`answer`) names the delay first, or none.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import scipy

from rigidimeter.analysis.estimation.answer import answer
from rigidimeter.analysis.estimation.checks import found as said
from rigidimeter.analysis.estimation.checks import half_widths
from rigidimeter.analysis.estimation.grid import Array
from rigidimeter.analysis.estimation.methods import (
    Ready,
    direct,
    instrumental,
    start_of,
    torque_earlier,
)
from rigidimeter.analysis.estimation.observation import Observation, no_instrument
from rigidimeter.analysis.estimation.solve import (
    Pose,
    Problem,
    Solution,
    noise_powers,
    shortest,
    solve,
    sums,
)
from rigidimeter.core.findings import Effect, Finding
from rigidimeter.core.records import Delay, Epoch, Fit

MOST_EPOCHS = 12
"""A delay is common to its recording; from so many epochs it is known well enough."""

SCAN_STEP_S, SCAN_HIGH_HZ, CLEARLY = 0.005, 20.0, 0.97
"""The search begins at the valleys of steps this far apart, a quarter of a period at 50 Hz, below
this frequency; a valley leaves less than so much of what is left without a delay."""

ROUNDS, SETTLED_S = 6, 1e-5
"""The torque is moved and the rest estimated again until less is left: between coarse samples the
first estimate sees the torque against motion that was not recorded."""

MOST_STRETCH = 6.0
"""A secant may go so many times as far as what is left."""

SIGNIFICANT, LEAST_S = 3.0, 1e-4
"""A delay within so many standard errors of zero is not corrected, nor one below this: it changes B
by less than 1e-4 K seconds."""

TURNS_S = 0.005
"""A delay that is longer turns the upper lines so far that it is no small change of the torque."""


Observe = Callable[[Sequence[Ready]], list[Observation]]


def delay_of(
    source: str, epochs: Sequence[Ready], observed: Sequence[Observation], again: Observe
) -> Delay:
    """Return how late the torque of a recording is, and whether that is corrected.

    Parameters
    ----------
    source : str
    epochs : sequence of Ready
        Of the recording, those that can be fitted.
    observed : sequence of Observation
        The same at their lines, with what the perturbation causes where that was recorded.
    again : callable
        Observes epochs whose torque was moved; ValueError says why it cannot.
    """
    used, plain = epochs[:MOST_EPOCHS], observed[:MOST_EPOCHS]
    if not used:
        return Delay(source, remark="no perturbation epoch tells the channels' delay")
    estimation, pose = used[0].settings.estimation, direct
    if plain[0].cause is not None:
        pose = instrumental
    longest_s = estimation.max_delay_s
    try:
        late = _settled(used, plain, pose, again, longest_s)
    except ValueError as error:
        return Delay(source, remark=f"the delay of the torque was not estimated: {error}")
    if late is None or abs(late[0]) > longest_s - SCAN_STEP_S / 2:
        return Delay(
            source,
            remark=f"no delay of the torque within ±{1e3 * longest_s:g} ms explains it "
            "(estimation.max_delay_s)",
        )
    delay = Delay(source, *late)
    if not matters(*late):
        why = f"shorter than {1e3 * LEAST_S:g} ms or not significantly different from zero"
        return replace(delay, remark=f"not corrected: {why}")
    if why := _of_other_terms(plain, pose, late[0]):
        return replace(delay, remark=f"not corrected: {why}")
    if not estimation.correct_delay:
        return replace(delay, remark="not corrected: estimation.correct_delay is false")
    return replace(delay, corrected=True)


def matters(delay_s: float, error_s: float) -> bool:
    """Return whether a delay is significant, and long enough to be worth a shift."""
    return abs(delay_s) >= max(SIGNIFICANT * error_s, LEAST_S)


def aligned(epoch: Epoch, delays: Sequence[Delay]) -> Epoch:
    """Return the epoch with its torque moved by the delay of its source, if that is corrected."""
    return torque_earlier(epoch, corrected_s(epoch.source, delays))


def corrected_s(source: str, delays: Sequence[Delay]) -> float:
    """Return by how much the torque of a source is moved, in s."""
    return sum(one.delay_s for one in delays if one.source == source and one.corrected)


def with_clock_error(
    epochs: Sequence[Ready],
    fits: Sequence[Fit],
    pooled: Sequence[Fit],
    delays: Sequence[Delay],
    again: Callable[[Sequence[float]], list[Fit]],
) -> tuple[list[Fit], list[Fit]]:
    """Return fits whose errors and intervals contain that of the clocks of torque and motion.

    Torque that is late by δ makes J wrong by −B δ and B by −K δ + J δ ω², of which band and method
    decide what remains: the epochs are fitted again with the torque moved by the standard error of
    the offset forth and back. At the ticks the acceleration alone is late, by half a tick with a
    motor that holds its torque between them: where the drive is not known, that much of a delay
    that was taken out may have been the acceleration's, and one within it that was not taken out
    may be all the acceleration's or all the torque's. All epochs of a source share the error.

    Parameters
    ----------
    epochs : sequence of Ready
    fits, pooled : sequence of Fit
        Of each epoch, and of several.
    delays : sequence of Delay
        Where one was corrected, its standard error counts: of two clocks, in place of the offset's.
    again : callable
        Fits the epochs with the torque of each so much earlier, in s.
    """
    of = {delay.source: delay for delay in delays}
    sources = [one.epoch.source for one in epochs]
    own = [of.get(source, Delay(source)) for source in sources]
    errors_s = np.array([_error_s(one, late) for one, late in zip(epochs, own, strict=True)])
    if not np.any(errors_s):
        return list(fits), list(pooled)
    early, late = again(errors_s.tolist()), again((-errors_s).tolist())
    by_error = [(a.value - b.value) / 2 for a, b in zip(early, late, strict=True)]
    by_drive = [
        _of_drive(one, fit) if delay.corrected else np.zeros(3)
        for one, fit, delay in zip(epochs, fits, own, strict=True)
    ]
    alone = [widened(fit, both) for fit, *both in zip(fits, by_error, by_drive, strict=True)]
    changes = [(fits, by_error, sources), (fits, by_drive, sources)]
    together = [
        widened(one, [change for each in changes for change in _of_sources(one, *each)])
        for one in pooled
    ]
    return alone, together


def late_torque(observation: Observation, fit: Fit, delay: Delay | None) -> list[Finding]:
    """Return that a delay which was not taken out moves J, B or K beyond their intervals.

    Moved to its place the torque gains (e^(iωτ) − 1) y, and p̂ gains G⁻¹ Σ Re(Zᴴ (e^(iωτ) − 1) y)/S.
    Where the perturbation was recorded its cause is known. Where the drive is not known, as much as
    half a tick of it may be the drive's, which is in the intervals.
    """
    if delay is None or delay.corrected or not matters(delay.delay_s, delay.delay_s_se):
        return []
    if not no_instrument(observation.epoch):
        return []
    problems = direct([observation], fit.value)
    turn = np.exp(1j * observation.grid.omega_rad_s * delay.delay_s) - 1.0
    added = [one._replace(target=turn * one.target) for one in problems]
    bias = -shortest(*sums(added, noise_powers(problems, fit.value)))
    half, late_ms = half_widths(fit), 1e3 * abs(delay.delay_s)
    share = float(np.max(np.abs(bias) / half))
    if not share > 1.0:
        return []
    return [
        said(
            "torque_delay",
            observation.settings.diagnostics,
            late_ms,
            late_ms / share,
            condition=fit.condition,
            effect=Effect.of(bias, fit.value, half),
            facts={"late_ms": 1e3 * delay.delay_s},
        )
    ]


def _followed(ready: Ready) -> bool:
    """Return whether the motion between the samples is that of a known drive and its command."""
    return ready.drive is not None and "velocity_command_rad_s" in ready.epoch.channels


def _error_s(ready: Ready, delay: Delay) -> float:
    """Return the standard error of the offset between torque and motion, in s."""
    late_s, error_s = delay.delay_s, delay.delay_s_se
    if delay.corrected:
        return error_s
    most_s = 0.5 / ready.settings.rig.tick_rate_hz + SIGNIFICANT * error_s
    unknown = matters(late_s, error_s) and 0.0 < late_s < most_s and not _followed(ready)
    return max(ready.epoch.clock_error_s, late_s / math.sqrt(3.0) if unknown else 0.0)


def _of_drive(ready: Ready, fit: Fit) -> Array:
    """Return what the standard error of half a tick changes; nothing where the drive is known."""
    if _followed(ready):
        return np.zeros(3)
    delay_s = 0.5 / ready.settings.rig.tick_rate_hz / math.sqrt(3.0)
    _, B, K = fit.value
    return np.where(fit.se > 0, np.array([B, K, 0.0]) * delay_s, 0.0)


def _of_sources(
    pooled: Fit, alone: Sequence[Fit], changes: Sequence[Array], sources: Sequence[str]
) -> list[Array]:
    """Return what the error of each source changes in a pooled fit.

    A pooled fit is nearly the mean of its epochs, each weighted by the inverse of its covariance.
    """
    total = np.zeros((3, 3))
    weighted: dict[str, Array] = {}
    for one, change, source in zip(alone, changes, sources, strict=True):
        free = one.se > 0  # an inertia that is held has no error
        known = np.all(np.isfinite(one.covariance)) and np.all(np.isfinite(change))
        if pooled.condition in ("", one.condition) and one.outcome.included and known:
            weight = np.zeros((3, 3))
            weight[np.ix_(free, free)] = np.linalg.pinv(one.covariance[np.ix_(free, free)])
            total += weight
            weighted[source] = weighted.get(source, np.zeros(3)) + weight @ change
    return [np.linalg.pinv(total) @ one for one in weighted.values()]


def widened(fit: Fit, changes: Sequence[Array]) -> Fit:
    """Return a fit with changes of one standard error each, which are independent, added."""
    if not changes or not np.all(np.isfinite(changes)):
        return fit
    together = np.sqrt(np.sum(np.square(changes), axis=0))
    return replace(
        fit,
        se=np.hypot(fit.se, together),
        low=fit.value - np.hypot(fit.value - fit.low, scipy.special.ndtri(0.975) * together),
        high=fit.value + np.hypot(fit.high - fit.value, scipy.special.ndtri(0.975) * together),
        covariance=fit.covariance + sum(np.outer(change, change) for change in changes),
    )


def _settled(
    used: Sequence[Ready],
    plain: Sequence[Observation],
    pose: Pose,
    observed: Observe,
    longest_s: float,
) -> tuple[float, float] | None:
    """Return the delay at which none is left, with its standard error; None where there is none.

    Its zero is sought by secants, and its error is that of what is left over its slope.
    """
    first = _searched(plain, pose, longest_s)
    if first is None:
        return None
    left_s, error_s = float(first.values[-1]), float(first.se[-1])
    jumps = any(one.drive is not None and one.drive.model.jump for one in used)
    if not matters(left_s, error_s) and (jumps or pose is direct):
        return left_s, error_s  # it shows without a move
    tried, total_s, stretch, solution = [(0.0, left_s)], left_s, 1.0, first
    for _ in range(ROUNDS):
        if abs(left_s) < SETTLED_S or abs(total_s) > longest_s:
            break
        moved = observed([one.moved(total_s) for one in used])
        solution = solve(moved, delayed(pose), np.append(solution.values[:-1], 0.0))
        left_s, error_s = float(solution.values[-1]), float(solution.se[-1])
        gone_s = tried[-1][1] - left_s
        if abs(gone_s) > error_s:  # else its slope is noise
            stretch = (total_s - tried[-1][0]) / gone_s
            stretch = float(np.clip(stretch, -MOST_STRETCH, MOST_STRETCH))
        tried.append((total_s, left_s))
        total_s += stretch * left_s
    if abs(left_s) > max(error_s, LEAST_S) and abs(total_s) <= longest_s:
        raise ValueError(
            f"it did not settle in {ROUNDS} rounds: {1e3 * left_s:.2g} ms are left at "
            f"{1e3 * total_s:.3g} ms"
        )
    return total_s, error_s * max(abs(stretch), 1.0)


def _searched(observations: Sequence[Observation], pose: Pose, longest_s: float) -> Solution | None:
    """Return J, B, K and the delay of the torque, the likeliest within ± `longest_s`."""
    begin = start_of(observations)
    problems = pose(observations, begin)
    powers = noise_powers(problems, begin)
    delays_s = np.linspace(-longest_s, longest_s, 2 * max(round(longest_s / SCAN_STEP_S), 1) + 1)
    left = _unexplained(problems, powers, delays_s)
    # The valleys of the scan that are clearly deeper than none, and none.
    inner = np.r_[True, left[1:] < left[:-1]] & np.r_[left[:-1] < left[1:], True]
    inner &= left < CLEARLY * left[delays_s.size // 2]
    found = []
    for near_s in dict.fromkeys([0.0, *(round(float(one), 9) for one in delays_s[inner])]):
        turned = [_turned(one, near_s) for one in problems]
        near = shortest(*sums(turned, powers))
        try:
            there = solve(observations, delayed(pose), np.append(near, near_s))
        except ValueError:
            continue  # nothing settles from there
        if abs(there.values[-1]) <= longest_s and there.values[0] > 0:  # as any inertia
            found.append(there)
    return max(found, key=likelihood, default=None)


def likelihood(found: Solution) -> float:
    """Return −Σ log S over the lines of all epochs: Whittle's log-likelihood, but a constant.

    Every line counts by the logarithm of what is left in it, so a subject who pushes slowly and
    strongly does not outvote the lines above.
    """
    return -float(sum(np.sum(np.log(power)) for power in found.powers))


def delayed(pose: Pose) -> Pose:
    """Return the problems with the delay as the last parameter."""

    def with_delay(observations: Sequence[Observation], values: Array) -> list[Problem]:
        joint, delay_s = values[:-1], values[-1]
        problems = []
        for one in pose(observations, joint):
            omega = one.observation.grid.omega_rad_s
            turn = np.exp(-1j * omega * delay_s)[:, None]
            own, seen = (
                np.hstack([turn * part, -1j * omega[:, None] * turn * (part @ joint)[:, None]])
                for part in (one.instruments, one.regressors)
            )
            target = one.target + seen[:, -1] * delay_s
            problems.append(one._replace(instruments=own, regressors=seen, target=target))
        return problems

    return with_delay


def _turned(one: Problem, delay_s: float) -> Problem:
    """Return the problem with its torque earlier by a delay."""
    turn = np.exp(1j * one.observation.grid.omega_rad_s * delay_s)
    return one._replace(target=one.target * turn)


def _unexplained(problems: Sequence[Problem], powers: Sequence[Array], delays_s: Array) -> Array:
    """Return the power of the torque over its noise that is left at each delay, shape (k,)."""
    left = np.zeros(delays_s.size)
    for one, power in zip(problems, powers, strict=True):
        omega, scale = one.observation.grid.omega_rad_s, 1 / np.sqrt(power)
        low = omega < 2 * np.pi * SCAN_HIGH_HZ
        rows = one.instruments[low] * scale[low, None]
        basis = np.linalg.qr(np.vstack([rows.real, rows.imag]))[0]
        turned = (one.target * scale)[low, None] * np.exp(1j * omega[low, None] * delays_s)
        both = np.vstack([turned.real, turned.imag])
        left += np.sum(both**2, axis=0) - np.sum((basis.T @ both) ** 2, axis=0)
    return left


def _of_other_terms(used: Sequence[Observation], pose: Pose, delay_s: float) -> str:
    """Return that something else explains the torque at least as well, or an empty text."""
    by_s = delay_s if abs(delay_s) > TURNS_S else 0.0
    turned = [one.late(by_s) for one in used] if by_s else used
    try:
        person = used[0].settings.diagnostics.subject_present
        told = answer(solve(turned, pose, start_of(turned)), person=person, most=1)
    except ValueError as error:
        return str(error)
    named = told.found or (told.straight.found if told.straight else ())
    first = next((one.term for one in named), None)
    if first is not None and first.finding != "torque_delay":
        return (
            f"{first.label} explains the torque better; `rigidimeter model --compare` fits "
            "such terms"
        )
    if not told.answered:
        return "beside it something else is left that follows the motion"
    return ""
