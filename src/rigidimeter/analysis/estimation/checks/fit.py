"""Whether the fit explains the torque, whether a joint can have these numbers, and the loop.

A residual that is white within the band carries nothing more to be explained, and textbook standard
errors hold for it. One that still follows the perturbation says that the model lacks something: a
delay between the channels, a reflex, a joint that is not linear.

**Least squares.** Torque u that something but the robot adds pulls least squares by b
(`methods.loop_pull`). Where each line counts by its noise, b is small and in the interval; where
lines count alike it is not. Weights do not change what noise and the loop alone leave: with p₀ the
solution in which lines count alike, b₀ its pull and p̂ the weighted one, p₀ − b₀ − p̂ is zero but for
the standard error of p₀, which is the larger (Hausman 1978). What the model lacks, such as a
reflex, has other sizes at other frequencies, so the two solutions differ.

**Controller.** Perturbation p and measured torque M' make the velocity command, c = A (p − F M'),
with the admittance A and the low-pass F of the settings. From one tick of T to the next

    p − F M' = B_c c(k) + β (c(k) − c(k − 1)),    β = B_c d / (1 − d),    d = e^(−B_c T/J_c)

so inertia and damping follow from a recorded command by least squares. A movement that is imposed
beside the perturbation adds a line to the command that no torque asked for: the line at which the
two differ most is left out, for a wrong controller is as wrong at all the others. It does not bias
instruments, which follow from the perturbation alone; the pull on least squares is computed with
the controller that the recording shows. A loop that would be unstable with the joint that was
estimated cannot have moved it.

**Drive.** It holds a command from tick to tick. Torque that is sampled at the ticks sees the
acceleration there, which is this share of its mean (`published.acceleration_seen`):

    first order, bandwidth λ      λT / (e^(λT) − 1), and the torque seems half a tick late
    second order, bandwidth ω     1 − (ωT)²/12, and it hardly seems late

J comes out low by as much. Torque and motion alone do not show λ or ω, but where the torque is not
late its acceleration does not jump at the ticks, and a drive of first order is ruled out, unless a
command was recorded that no drive explains. The range of J is that over the drives which are left,
of all bandwidths up to that of the settings.

A motor that holds a torque has no such drive. The torque seems half a tick late and misses nothing,
for the acceleration stays as it is for the whole tick. That shows where the perturbation was
recorded: after a step of it an inertia gains as much velocity in the first tick as in the fourth,
behind a drive of bandwidth ω only some √2 ωT of that.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from rigidimeter.analysis.estimation.checks import Pull, at_least, at_most, found, half_widths
from rigidimeter.analysis.estimation.checks.motion import (
    checked_lines,
    coherence,
    gain,
    held_lines,
    hertz,
    in_band,
    in_time,
    perturbation_lines,
    residual_perturbation,
)
from rigidimeter.analysis.estimation.drive import EACH, Drive, past_sums
from rigidimeter.analysis.estimation.grid import Complex
from rigidimeter.analysis.estimation.methods import direct, loop_pull
from rigidimeter.analysis.estimation.observation import Observation, loop_of
from rigidimeter.analysis.estimation.published import acceleration_seen
from rigidimeter.analysis.estimation.signals import band_hz, values_at
from rigidimeter.analysis.estimation.solve import (
    inverse_of,
    noise_powers,
    shortest,
    solve_once,
    sums,
)
from rigidimeter.analysis.estimation.stretches import motion_channels, moves
from rigidimeter.core.findings import Effect, Fact, Finding
from rigidimeter.core.records import PARAMETERS, Delay, Epoch, Fit
from rigidimeter.core.settings import ControllerSettings, DiagnosticsSettings, Settings
from rigidimeter.core.units import per_rad_from_per_deg, rad_from_deg
from rigidimeter.model import (
    DriveModel,
    JointDynamics,
    Loop,
    admittance,
    butterworth_lowpass,
    spectral_radius,
)

LINES_TOGETHER = 8

STANDARD_ERRORS, PULL_SHARE = 4.0, 0.5
"""So far may the two solutions be apart by chance, of whichever of J, B and K; and by this share of
b₀, which is computed from the residual of one epoch."""

MOST_NOISE = 50.0
"""In %. Then as much of what decides J or B is noise as is motion."""

PER_DEGREE_WITHIN = 1.5
"""Values that are wrong by 57.3, within this factor, were given per degree."""

COMPARED_HZ = (0.5, 10.0)
"""Below, the start of the epoch still counts; above, how the torque is held between its samples."""

LINE_BINS, LEAST_LEFT = 2, 0.01
"""Half the width of a line in the window. Where less of the command's power is beside the line in
which the two differ most, that line is compared too."""

LATE = 0.1
"""A drive of first order is ruled out where the torque is late by less than this share of a tick.
On rigs of 200 to 1000 ticks/s it was .34 to .50 late with velocity PI drives, with drives of second
order at most .06 where these take less than 2 % off J."""

FEWEST_TICKS = 1000  # from fewer the gain in one tick is not known well enough
AT_ONCE, ERRORS, SHORT = (0.75, 1.25), 2.0, 0.5
"""What is gained in the first tick after a step of a motor's torque, over what is gained in the
fourth (`EACH`), is above the first by so many standard errors, and not above the second. Measured
were .9 to 1.1, and .4 at most with drives whose bandwidth times the tick is below the last."""


def residual(observation: Observation, fit: Fit, pull: Pull) -> list[Finding]:
    """Return what the torque that J, B and K leave says of the model.

    **Whether it is white** within the band, by its spectral flatness: the geometric over the
    arithmetic mean of the power, lines taken eight together; their mean logarithm is that of white
    noise less ln 8 − ψ(8), which is made up for. **Whether J, B and K of the first half** explain
    the second half's torque.
    """
    seen, settings = checked_lines(observation), observation.settings.diagnostics
    power = np.abs(seen.left(fit.value))[in_band(seen, hertz(seen.grid))] ** 2
    groups = max(power.size // LINES_TOGETHER, 1)
    means = power[: groups * LINES_TOGETHER].reshape(groups, -1).mean(axis=1)
    value, more = math.nan, pull.told(fit, settings)
    if np.all(means > 0):
        made_up = math.log(LINES_TOGETHER) - float(scipy.special.digamma(LINES_TOGETHER))
        value = min(float(np.exp(np.mean(np.log(means)) + made_up) / np.mean(means)), 1.0)
    least = settings.min_residual_flatness
    results = at_least("residual_whiteness", settings, value, least, **more)
    joints = seen.torque_nm - seen.terms_nm
    _, (torque, *columns), _ = in_time(seen.grid, np.stack([joints, *seen.motion.T]))
    half, motion = torque.size // 2, np.stack(columns, axis=1)
    first, second = motion[:half], motion[half:]
    joint = shortest(first.T @ first, first.T @ torque[:half])
    variance, left = np.var(torque[half:]), np.var(torque[half:] - second @ joint)
    value = float(100.0 * (1.0 - left / variance)) if variance > 0 else math.nan
    least = settings.min_held_out_vaf_percent
    return results + at_least("held_out_vaf", settings, value, least, **more)


def parameters(seen: Observation, fit: Fit, pull: Pull) -> list[Finding]:
    """Return what J, B and K, and R², say by themselves.

    A low R² does not matter to a method that weights torque beyond the model away.
    """
    settings = seen.settings.diagnostics
    more = pull.told(fit, settings)
    if not (pull.instruments or pull.in_interval):
        more = {"effect": more["effect"]}
    low = at_least("r_squared", settings, fit.r_squared, settings.min_r_squared, **more)
    return low + values(seen, fit)


def values(seen: Observation, fit: Fit) -> list[Finding]:
    """Return whether a joint can have these numbers, and K without the limb's weight.

    A limb at the angle θ from hanging straight down takes the torque m g l sin θ, whose slope
    m g l cos θ is in K.
    """
    settings, angle = seen.settings.diagnostics, seen.epoch.channels.get("angle_rad")
    results = negative_parameters(fit, settings) + implausible_parameters(fit, settings)
    # Epochs in a pool need not have one posture.
    if settings.gravity_nm and angle is not None and fit.epoch != "pooled":
        hanging_rad, K = rad_from_deg(settings.gravity_angle_deg), fit.stiffness_nm_rad
        slope = settings.gravity_nm * float(np.mean(np.cos(hanging_rad + angle.values)))
        results.append(
            found("gravity", settings, K - slope, facts={"stiffness": K, "slope": slope})
        )
    return results


def least_squares(observation: Observation, fit: Fit, pull: Pull) -> list[Finding]:
    """Return what least squares of the measured motion assumes and the epoch contradicts."""
    if pull.instruments:
        return []
    findings = loop_bias(fit, pull, observation.settings.diagnostics)
    if not pull.in_interval:
        return findings
    return findings + unweighted_fit(observation, fit) + noise_of_motion(observation, fit)


def negative_parameters(fit: Fit, settings: DiagnosticsSettings) -> list[Finding]:
    """Return how many of J, B and K are not above zero (none may be).

    A sign that noise may have made, where the upper end of an interval is above zero, says nothing.
    """
    wrong = [name for name, value in zip("JBK", fit.value, strict=True) if not value > 0]
    variant = ""
    if len(wrong) == len(fit.value):
        variant = "noise" if np.any(fit.high > 0) else "reaction"
    more = {"variant": variant, "excludes": variant == "reaction"}
    facts = {"names": " and ".join(wrong)}
    return at_most("negative_parameters", settings, float(len(wrong)), 0.0, facts=facts, **more)


def implausible_parameters(fit: Fit, settings: DiagnosticsSettings) -> list[Finding]:
    """Return by what factor the worst of J, B and K is outside its range; at most 1 is inside.

    Only sizes are looked at; signs are another check's business.
    """
    J, B, K = np.abs(fit.value).tolist()
    factors = {
        (0, "large"): J / settings.max_inertia_kg_m2,
        (1, "large"): B / settings.max_damping_nm_s_rad,
        (2, "large"): K / settings.max_stiffness_nm_rad,
        (0, "small"): settings.min_inertia_kg_m2 / J if J else math.inf,
    }
    worst, side = max(factors, key=lambda one: factors[one])
    about = PARAMETERS[worst]
    facts = {"symbol": about.symbol, "size": float(fit.value[worst]), "size_unit": about.unit}
    value = factors[worst, side]
    return at_most("implausible_parameters", settings, value, 1.0, facts=facts | {"side": side})


def pull_of(observation: Observation, fit: Fit, *, by_noise: bool) -> Pull:
    """Return what torque of the subject does to least squares of an epoch.

    Parameters
    ----------
    observation : Observation
        Without instruments.
    fit : Fit
        Where lines count by their noise, the solution.
    by_noise : bool
        Or all lines count alike.
    """
    if observation.loop is None:
        return Pull(None, by_noise)
    problems, values = direct([observation], fit.value), fit.value
    powers = [np.ones(observation.grid.line.size)]
    try:
        if by_noise:
            powers = noise_powers(problems, values)
        else:
            values = shortest(*sums([p._replace(instruments=p.regressors) for p in problems]))
        inverse = inverse_of(sums(problems, powers)[0])
    except ValueError:
        return Pull(np.full(3, np.nan), by_noise)
    return Pull(fit.value - values + loop_pull(problems, powers, values, inverse), by_noise)


def loop_bias(fit: Fit, pull: Pull, settings: DiagnosticsSettings) -> list[Finding]:
    """Return how far the loop pulls least squares from the joint, in % of half the intervals.

    A loop that is not known is a note, since nothing is computed.
    """
    most = settings.max_loop_bias_percent
    if pull.bias is None:
        return [found("loop_bias", settings, math.nan, most, harmless="not_known")]
    half = half_widths(fit)
    value = 100.0 * float(np.max(np.abs(pull.bias) / half))
    if not math.isfinite(value):
        return [found("loop_bias", settings, value, most, variant="unknown")]
    if not pull.large(fit, most):
        return []
    effect = Effect.of(pull.bias, fit.value, half)
    variant = "first_order" if pull.in_interval else ""
    return [found("loop_bias", settings, value, most, variant=variant, effect=effect)]


def unweighted_fit(observation: Observation, fit: Fit) -> list[Finding]:
    """Return by how many % least squares without weights differs, more than noise and loop do."""
    settings, grid = observation.settings.diagnostics, observation.grid
    problems, powers = direct([observation], fit.value), [np.ones(grid.line.size)]
    alike = solve_once(problems, powers)
    pull = loop_pull(problems, powers, alike.values, alike.inverse)
    if not np.all(np.isfinite(pull)):
        return []
    apart = alike.values - pull - fit.value
    allowed = STANDARD_ERRORS * alike.se + PULL_SHARE * np.abs(pull)
    percent, most = 100.0 * apart / np.abs(fit.value), settings.max_unweighted_percent
    sure = (np.abs(apart) > allowed) & (np.abs(percent) > most)
    if not np.any(sure):
        return []
    about = int(np.argmax(np.where(sure, np.abs(percent), -1.0)))
    facts = {"symbol": "JBK"[about], "way": "higher" if percent[about] > 0 else "lower"}
    return [found("unweighted_fit", settings, float(abs(percent[about])), most, facts=facts)]


def noise_of_motion(observation: Observation, fit: Fit) -> list[Finding]:
    """Return how much of the motion that decides J or B is noise, in %.

    Half the difference of what even and odd samples give is the noise of their mean. With its power
    |n|² and that of the motion |φ|², both weighted, the share is Σ |n|²/S ÷ Σ |φ|²/S. What
    neighbouring samples share, as behind a filter, it does not show.
    """
    if observation.noise is None:
        return []
    (power,) = noise_powers(direct([observation], fit.value), fit.value)
    weighted = np.abs(np.stack([observation.noise, observation.motion])[..., :2]) ** 2
    of_noise, of_motion = np.sum(weighted / power[:, None], axis=1)
    share = 100.0 * of_noise / of_motion
    about, settings = int(np.argmax(share)), observation.settings.diagnostics
    facts, value = {"symbol": "JB"[about]}, float(share[about])
    return at_most("noise_of_motion", settings, value, MOST_NOISE, facts=facts)


class Shown(NamedTuple):
    """What a recorded command says of the controller.

    Attributes
    ----------
    misfit_percent, factor : float
        The difference of what the controller of the settings makes from the command, in % of it,
        and its size, as a factor of it; NaN where nothing can be said.
    controller : ControllerSettings or None
        Another one that makes the command, where that of the settings does not.
    """

    misfit_percent: float = math.nan
    factor: float = math.nan
    controller: ControllerSettings | None = None


def controller_shown(seen: Observation, cause: Complex | None = None) -> Shown:
    """Return what the recorded command says of the controller of the settings.

    Nothing where command or perturbation were not recorded, or ticks are missing.

    Parameters
    ----------
    seen : Observation
    cause : complex array, shape (m,), optional
        The perturbation at its lines, where that is known already.
    """
    epoch, settings, grid = seen.epoch, seen.settings, seen.grid
    command = epoch.channels.get("velocity_command_rad_s")
    if command is None or "perturbation_nm" not in epoch.channels or len(command) < 2:
        return Shown()
    rate_hz, frequency_hz = command.mean_rate_hz, hertz(grid)
    used = (frequency_hz >= COMPARED_HZ[0]) & (frequency_hz <= COMPARED_HZ[1])
    if np.ptp(np.diff(command.time_s)) > 0.5 / rate_hz or not np.any(used):
        return Shown()
    sent, age_s = held_lines(command, grid)
    turn = 1j * grid.omega_rad_s[used]
    z = np.exp(turn / rate_hz)
    # The newest sample at a tick is half an interval old on average, beside the latency.
    torque_hz, cutoff_hz = epoch.channels["torque_nm"].rate_hz, settings.controller.torque_cutoff_hz
    late_s = age_s + settings.rig.torque.latency_s + max(0.5 / torque_hz - 0.5 / rate_hz, 0.0)
    read = seen.torque_nm[used] * np.exp(-turn * late_s)
    if cutoff_hz < rate_hz / 2:
        b0, b1, b2, a1, a2 = butterworth_lowpass(cutoff_hz, rate_hz)
        read *= np.polyval((b0, b1, b2), z) / np.polyval((1.0, a1, a2), z)
    cause = perturbation_lines(seen) if cause is None else cause
    sent, asked = sent[used], cause[used] - read

    def compare(controller: ControllerSettings) -> tuple[float, float, NDArray[np.bool_]]:
        """Return misfit in %, factor, and which lines were compared."""
        J, B = controller.inertia_kg_m2, controller.damping_nm_s_rad
        decay, share = admittance(J, B, 1.0 / rate_hz)
        made = asked * share / (1.0 - decay / z)
        apart, power = np.abs(sent - made), np.abs(sent) ** 2
        kept = np.abs(np.arange(sent.size) - np.argmax(apart)) > LINE_BINS
        if not np.sum(power[kept]) > LEAST_LEFT * np.sum(power):
            kept = np.ones_like(kept)
        total = float(np.sum(power[kept])) or math.nan
        factor = float(np.sum((sent.conj() * made).real[kept])) / total
        return 100.0 * math.sqrt(float(np.sum(apart[kept] ** 2)) / total), factor, kept

    percent, factor, kept = compare(settings.controller)
    most = settings.diagnostics.max_controller_misfit_percent
    if not percent > most:
        return Shown(percent, factor)
    columns = np.stack([sent, sent * (1.0 - 1.0 / z)], axis=1)[kept]
    both = ((columns.conj().T @ lines).real for lines in (columns, asked[kept]))
    damping, beta = shortest(*both).tolist()
    if not beta > 0:
        return Shown(percent, factor)
    bent = damping / beta / math.log1p(damping / beta) if damping > 0 else 1.0
    values = {"inertia_kg_m2": beta / rate_hz * bent, "damping_nm_s_rad": max(damping, 0.0)}
    other = settings.controller.model_copy(update=values)
    return Shown(percent, factor, None if compare(other)[0] > most else other)


def loop_shown(seen: Observation, drive: Drive | None) -> Loop | None:
    """Return the loop that an epoch ran in, for least squares: recorded, or stated in the settings.

    None where it is neither: the defaults of the controller are the paper's, which are no reason to
    think that a robot gave way.
    """
    channels, settings = seen.epoch.channels, seen.settings
    stated = "controller" in settings.model_fields_set
    if not stated and not {"perturbation_nm", "velocity_command_rad_s"} & channels.keys():
        return None
    loop = loop_of(settings, channels["torque_nm"].rate_hz, drive)
    return replace(loop, controller=controller_shown(seen).controller or loop.controller)


def following(observation: Observation, fit: Fit, pull: Pull) -> list[Finding]:
    """Return what does not follow the perturbation as motion, torque and command should."""
    epoch, settings = observation.epoch, observation.settings
    if not moves(epoch.channels.get("perturbation_nm")):
        return []
    seen, cause = checked_lines(observation), perturbation_lines(observation)
    part = cause[: seen.grid.line.size] * gain(seen.grid, band_hz(epoch, settings.estimation))
    findings = coherence(seen, part, fit, pull) + residual_perturbation(seen, part, fit, pull)
    findings += controller_misfit(fit, pull, settings, controller_shown(observation, cause))
    return findings + unstable_loop(epoch, fit, pull, settings)


def controller_misfit(fit: Fit, pull: Pull, settings: Settings, shown: Shown) -> list[Finding]:
    """Return how far the command is from what the controller makes of perturbation and torque."""
    checks, given, other, variant = settings.diagnostics, settings.controller, shown.controller, ""
    if not shown.misfit_percent > checks.max_controller_misfit_percent:
        return []
    harmless, facts = pull.harmless(fit, checks)
    if other is not None:
        J, B = other.inertia_kg_m2, max(other.damping_nm_s_rad, 1e-12)
        factors = np.log([J / given.inertia_kg_m2, B / max(given.damping_nm_s_rad, 1e-12)])
        per_degree, within = math.log(per_rad_from_per_deg(1.0)), math.log(PER_DEGREE_WITHIN)
        variant = "per_degree" if np.all(np.abs(factors - per_degree) < within) else "shown"
        if np.all(np.abs(factors + per_degree) < within):
            variant = "per_degree_twice"
        facts |= {"shown_inertia": J, "shown_damping": other.damping_nm_s_rad}
    elif not pull.instruments:  # of a loop that is not known the bias cannot be told
        facts, harmless = {}, ""
    more = {"facts": facts | {"factor": shown.factor}, "variant": variant, "harmless": harmless}
    most = checks.max_controller_misfit_percent
    return at_most("controller_misfit", checks, shown.misfit_percent, most, **more)


def unstable_loop(epoch: Epoch, fit: Fit, pull: Pull, settings: Settings) -> list[Finding]:
    """Return the growth per second of the loop of the settings with the joint that was found."""
    if not np.all(fit.value >= 0):
        return []  # no such joint
    rig = loop_of(settings, epoch.channels["torque_nm"].rate_hz, None).rig
    joint = JointDynamics(*fit.value.tolist())
    radius = spectral_radius(settings.model_copy(update={"rig": rig}), joint)
    value = math.log(max(radius, 1e-12)) * rig.tick_rate_hz
    harmless, why = pull.harmless(fit, settings.diagnostics)
    return at_most("unstable_loop", settings.diagnostics, value, 0.0, harmless=harmless, facts=why)


def between_samples(
    epoch: Epoch, fit: Fit, pull: Pull, settings: Settings, delay: Delay | None
) -> list[Finding]:
    """Return by how much J may be too low, in %, where the loop was recorded and not its drive.

    A drive shows in the torque only by what it does between the samples of the velocity.

    Parameters
    ----------
    epoch : Epoch
        Of a recording that does not show its drive.
    fit : Fit
    pull : Pull
    settings : Settings
    delay : Delay or None
        Of the torque of its recording.
    """
    checks, rig = settings.diagnostics, settings.rig
    command = epoch.channels.get("velocity_command_rad_s")
    ticks = command or (epoch.channels.get("perturbation_nm") if pull.instruments else None)
    name, most, J = "between_samples", checks.max_between_samples_percent, fit.inertia_kg_m2
    if ticks is not None and J > 0.0:
        interval_s, fastest = 1.0 / ticks.mean_rate_hz, 2 * math.pi * rig.drive_bandwidth_hz
        if command is None and holds_torque(epoch, fastest):
            return []
        drive = DriveModel((complex(-fastest),), (complex(fastest),))
        if command is None and delay is not None and delay.delay_s / interval_s < LATE:
            drive = DriveModel.second_order(rig.drive_bandwidth_hz, rig.drive_damping_ratio)
        seen = acceleration_seen(drive, interval_s, np.zeros(1))
        facts: dict[str, Fact] = {"symbol": "J", "low_j": J, "high_j": J / seen}
        facts["bandwidth_hz"] = rig.drive_bandwidth_hz
        effect = Effect((-100.0 * (1.0 - seen), math.nan, math.nan))
        value = 100.0 * (1.0 / seen - 1.0)
        more = {"facts": facts, "variant": "unknown_drive", "effect": effect}
        return at_most(name, checks, value, most, **more)
    return []


def holds_torque(epoch: Epoch, fastest_rad_s: float) -> bool:
    """Return whether the perturbation moves the joint at once, as no drive of this bandwidth does.

    What the velocity gains in a tick is a sum over the torques of this tick and of past ones.
    """
    pushed, motion = epoch.channels["perturbation_nm"], motion_channels(epoch)[0]
    if fastest_rad_s > SHORT * pushed.mean_rate_hz:
        return False
    of_angle, held = int(motion.name == "angle_rad"), pushed.values
    inside = (pushed.time_s >= motion.time_s[0]) & (pushed.time_s <= motion.time_s[-1])
    rows = np.flatnonzero(inside)
    if rows.size < FEWEST_TICKS:
        return False
    gained = np.diff(values_at(motion, pushed.time_s[rows]), 1 + of_angle)
    if of_angle:  # two mean velocities differ by half of what the torques of both ticks give
        held = (held + np.append(held[:1], held[:-1])) / 2
    table = np.column_stack([past_sums(held, rows[of_angle:-1]), np.ones(gained.size)])
    inverse = np.linalg.pinv(table)
    left = gained - table @ (inverse @ gained)
    beyond = inverse[0] - np.outer(AT_ONCE, inverse[:EACH].sum(axis=0))
    low, high = beyond @ gained - ERRORS * np.std(left) * np.linalg.norm(beyond, axis=1)
    return bool(low > 0.0 > high)


def friction_of_drive(epoch: Epoch, fit: Fit, settings: Settings) -> list[Finding]:
    """Return that a little friction in the torque is left by a drive that has some.

    Such a drive does not do between the ticks what it does without, and J misses some percent.
    """
    said = any(one.name == "between_samples" for one in fit.findings)
    if said or "velocity_command_rad_s" in epoch.channels:
        return []
    most = settings.diagnostics.max_between_samples_percent
    return [found("between_samples", settings.diagnostics, math.nan, most, variant="friction")]
