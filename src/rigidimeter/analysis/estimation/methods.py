"""The methods: what each observes and solves, what its error is beside noise, and its fits.

Least squares (``bandlimited``). The measured motion is its own instrument. Torque u of the subject
comes back by the loop as motion H u and pulls the estimate by

    b = (Σ Re(Xᴴ X)/S)⁻¹ Σ Re(H*) |u|²/S

Where S is that of u this is of the second order in the standard error, whatever the size of u. With
u = y − X (p̂ − b) both sides depend on b alone, found by iteration from b = 0.

Instrumental variables (``iv``). The instruments are the motion that the perturbation alone causes
(`observation`), which carries nothing of the subject. At the lines of a periodic perturbation alone
(``spectral``) the lines between hold nothing but noise and set S.

Another drive that explains the velocity as well gives other parameters. The largest change is δ;
where that is more than a tenth of the parameter, what the drive says is itself uncertain, its sign
included, and δ is at least twice what the drive changes. Both ends of an interval are further out
by δ and by b; neither becomes smaller by pooling.

Epochs of one condition share instruments and the shape of their noise: the pooled estimate comes
first. What an epoch says of J, B and K is its own.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from rigidimeter.analysis.estimation.checks import found
from rigidimeter.analysis.estimation.drive import Drive, ticks_hz
from rigidimeter.analysis.estimation.grid import Array, Complex
from rigidimeter.analysis.estimation.observation import LEAST, Caused, Observation
from rigidimeter.analysis.estimation.signals import angle_range_rad
from rigidimeter.analysis.estimation.solve import (
    ENOUGH_EPOCHS,
    Pose,
    Problem,
    Solution,
    of_fit,
    on_lines,
    shortest,
    solve,
    solve_once,
    sums,
)
from rigidimeter.analysis.estimation.stretches import after_fit, unusable
from rigidimeter.core.findings import Effect, Finding
from rigidimeter.core.records import Activity, Channel, Epoch, Fit
from rigidimeter.core.settings import Settings
from rigidimeter.model import Loop, OpenLoop

WORST_R_SQUARED = -10.0
"""A subject who pushes may turn R² negative; one far below says that a channel is wrong."""

SHARED_FROM = 4
"""From so many epochs on, they share the shape of their noise."""

DEPENDS = 0.1
"""A parameter that another drive changes by more than this share depends on the drive."""

PULL_ITERATIONS, PULL_DAMPING, PULL_SETTLED, PULL_MOST = 50, 0.5, 1e-3, 1e3
"""A step of less than the third, as a share of every parameter, ends the search for b; so does a
b of so many times a parameter, as the last says."""


class Ready(NamedTuple):
    """An epoch ready to be fitted.

    Attributes
    ----------
    epoch : Epoch
        Screened, on one clock.
    settings : Settings
    drive : Drive or None
        Of its recording.
    obstacle : str
        Why no method can fit it, or an empty text.
    activity : Activity or None
        What the EMG shows; None without EMG.
    with_active : Epoch or None
        With the stretches that are left out for an active muscle; None where none is.
    """

    epoch: Epoch
    settings: Settings
    drive: Drive | None = None
    obstacle: str = ""
    activity: Activity | None = None
    with_active: Epoch | None = None

    def moved(self, delay_s: float) -> Ready:
        """Return it with its torque this much earlier."""
        whole = self.with_active and torque_earlier(self.with_active, delay_s)
        return self._replace(epoch=torque_earlier(self.epoch, delay_s), with_active=whole)


def torque_earlier(epoch: Epoch, delay_s: float) -> Epoch:
    """Return the epoch with its torque this much earlier."""
    torque = epoch.channels.get("torque_nm")
    if torque is None or delay_s == 0.0:
        return epoch
    earlier = Channel(torque.name, torque.time_s - delay_s, torque.values)
    return replace(epoch, channels={**epoch.channels, torque.name: earlier})


FitTogether = Callable[[Sequence[Ready], float | None], Fit]
"""From epochs, and J where it is held, to one fit of all; ValueError says why there is none."""


@dataclass(frozen=True)
class Method:
    """An estimator of J, B and K: a pose at the lines, or a function of its own.

    Parameters
    ----------
    name : str
        As `--method` takes it.
    title : str
        What it does, in a few words.
    needs : tuple of str
        The channels it needs besides torque and a measured motion. A method that needs
        `perturbation_nm` is taken for one that voluntary torque does not bias.
    methods_text : str
        How the estimates were made, for a methods section: completes "J, B and K were estimated".
    pose : Pose, optional
        Makes the linear problems at the lines.
    periodic : bool
        At the lines of a periodic perturbation alone.
    fit : FitTogether, optional
        Of a method that has no pose.
    references : tuple of str
        Keys of `analysis.report.references` that the methods text cites.
    intervals_text, pooled_text : str
        What the intervals hold for, and those of the pooled estimates.
    by_noise : bool
        Whether each frequency counts by its noise, and what torque of the subject does to least
        squares by the loop is in the intervals.
    as_recorded : bool
        Fit the channels as they are, without correcting the delay of the torque.
    in_sensitivity : bool
        Whether every study is analysed by it, beside the method chosen.
    """

    name: str
    title: str
    needs: tuple[str, ...]
    methods_text: str
    pose: Pose | None = None
    periodic: bool = False
    fit: FitTogether | None = None
    references: tuple[str, ...] = ()
    intervals_text: str = "Intervals are those that the method gives"
    pooled_text: str = "Those of all epochs together are its own too"
    by_noise: bool = False
    as_recorded: bool = False
    in_sensitivity: bool = False

    @property
    def uses_perturbation(self) -> bool:
        """Whether the perturbation is the instrument, so that voluntary torque does not bias it."""
        return "perturbation_nm" in self.needs


def direct(observations: Sequence[Observation], values: Array) -> list[Problem]:
    """Return the problems of least squares.

    Noise of the motion sensor must not be its own instrument: on every second line the motion is
    that of the even samples and the instrument that of the odd ones, on the others the reverse.
    """
    del values  # they do not depend on the parameters
    problems = []
    for one in observations:
        motion = instruments = one.motion
        if one.noise is not None:
            apart = one.noise * np.where(one.grid.line % 2, 1.0, -1.0)[:, None]
            motion, instruments = one.motion + apart, one.motion - apart
        problems.append(Problem(instruments, motion, one.torque_nm - one.terms_nm, one))
    return problems


def instrumental(observations: Sequence[Observation], values: Array) -> list[Problem]:
    """Return the problems with what the perturbation causes at J, B and K as the instruments.

    Lines that it does not excite show the noise alone.
    """
    return [
        Problem(one.of_lines(caused.lines) * one.excited[:, None], one.motion, one.torque_nm, one)
        for one, caused in zip(observations, all_caused(observations, values), strict=True)
    ]


def all_caused(observations: Sequence[Observation], joint: Array) -> list[Caused]:
    """Return what the perturbation causes in each; epochs that share it are simulated once."""
    causes = [one.cause for one in observations]
    made = {id(one): one.at(joint[:3]) for one in dict.fromkeys(causes) if one is not None}
    return [made[id(one)] for one in causes]


def holding(pose: Pose, inertia_kg_m2: float) -> Pose:
    """Return the problems of B and K alone (Eq. 7)."""

    def held(observations: Sequence[Observation], values: Array) -> list[Problem]:
        return [
            one._replace(
                instruments=one.instruments[:, 1:],
                regressors=one.regressors[:, 1:],
                target=one.target - inertia_kg_m2 * one.regressors[:, 0],
                held=(inertia_kg_m2,),
            )
            for one in pose(observations, np.append(inertia_kg_m2, values))
        ]

    return held


def start_of(observations: Sequence[Observation]) -> Array:
    """Return where an iteration begins: J, B and K with every line alike, shape (3,)."""
    own = [one._replace(instruments=one.regressors) for one in direct(observations, LEAST)]
    return np.asarray(np.maximum(shortest(*sums(own)), 10 * LEAST))


def by_other_drives(solution: Solution) -> Array:
    """Return δ, shape (p,)."""
    values = solution.values
    count = max(len(one.observation.changes) for one in solution.problems)
    grams = np.repeat(solution.gram[None], count, axis=0)
    moments = grams @ values
    for one, power in zip(solution.problems, solution.powers, strict=True):
        changes, held = one.observation.changes, len(one.held)
        weighted = (one.instruments / power[:, None]).conj().T
        grams[: len(changes)] += (weighted @ changes[:, :, held:]).real
        if held:
            moved = (weighted @ changes[:, :, :held]).real
            moments[: len(changes)] -= moved @ np.array(one.held)
    without, *others = np.abs(shortest(grams, moments) - values)
    most = np.max(others, axis=0)
    depends = most > DEPENDS * np.abs(values)
    return np.asarray(np.where(depends, np.maximum(most, 2 * without), most))


def loop_pull(
    problems: Sequence[Problem], powers: Sequence[Array], values: Array, inverse: Array
) -> Array:
    """Return b of least squares, shape (p,); NaN where no joint fits recording and loop.

    It is 0 for instruments, and where no loop is known, so that b is not either.
    """
    bias = np.zeros(values.size)
    observations = [one.observation for one in problems]
    if any(one.cause is not None or one.loop is None for one in observations):
        return bias
    loops = [opened(one) for one in observations]
    for _ in range(PULL_ITERATIONS):
        moment = np.zeros(values.size)
        for one, power, loop in zip(problems, powers, loops, strict=True):
            joint = np.concatenate([np.array(one.held), values - bias])
            J, B, K = np.maximum(joint, LEAST).tolist()
            back = loop.motion_per_torque((J, B, K)).real[len(one.held) :]
            moment += back @ (np.abs(one.residual(values - bias)) ** 2 / power)
        step = inverse @ moment - bias
        bias = bias + PULL_DAMPING * step
        if not np.all(np.abs(bias) < PULL_MOST * np.abs(values)):
            break
        if np.all(np.abs(step) < PULL_SETTLED * np.abs(values)):
            return bias
    return np.full(values.size, np.nan)


def opened(observation: Observation) -> OpenLoop:
    """Return the loop that an epoch ran in, opened, at its lines."""
    loop, grid = observation.loop, observation.grid
    assert loop is not None  # else there is no b
    spacing_hz = float(f"{1 / grid.duration_s:.9g}")
    return _opened_at(loop, int(grid.line[0]), grid.line.size, spacing_hz)


@lru_cache(maxsize=8)
def _opened_at(loop: Loop, first: int, count: int, spacing_hz: float) -> OpenLoop:
    highest_hz = 0.49 * loop.rig.tick_rate_hz
    return loop.at_frequency(np.minimum(spacing_hz * np.arange(first, first + count), highest_hz))


class Fitted(NamedTuple):
    """What a method makes of epochs.

    Attributes
    ----------
    fits : list of Fit
        One for each epoch, in order; one that could not be fitted has failed, with the reason.
    pooled : list of Fit
        One for each condition with an epoch that counts; of several one for all of them together,
        without a condition.
    shared : dict of str to Solution
        What the epochs of each condition share, where they were fitted at their lines.
    """

    fits: list[Fit]
    pooled: list[Fit]
    shared: dict[str, Solution]


def fit_epochs(
    method: Method,
    epochs: Sequence[Ready],
    observed: Sequence[Observation | str],
    inertia_kg_m2: float | None = None,
    *,
    pooled: bool = True,
) -> Fitted:
    """Fit J, B and K, or B and K at a given inertia, to every epoch and to each condition.

    Parameters
    ----------
    method : Method
    epochs : sequence of Ready
    observed : sequence of Observation or str
        The epochs at their lines, or why they cannot be; unused by a method without a pose.
    inertia_kg_m2 : float, optional
        J that is held.
    pooled : bool
        Whether the fits of several epochs together are wanted.
    """
    pose = method.pose
    if pose is not None and inertia_kg_m2 is not None:
        pose = holding(pose, inertia_kg_m2)
    fits: dict[int, Fit] = {}
    shared: dict[str, Solution] = {}
    conditions = list(dict.fromkeys(one.epoch.condition for one in epochs))
    for condition in conditions:
        places = [i for i, one in enumerate(epochs) if one.epoch.condition == condition]
        if pose is None:
            fits |= {i: _by_function(method, [epochs[i]], inertia_kg_m2) for i in places}
            continue
        seen = {i: one for i in places if isinstance(one := observed[i], Observation)}
        good = [i for i in seen if epochs[i].epoch.closed.included]
        begin = _begin([seen[i] for i in (good or seen)], inertia_kg_m2)
        with suppress(ValueError):  # as each epoch will say
            if good:
                shared[condition] = solve([seen[i] for i in good], pose, begin)
        whole = shared.get(condition)
        # Few epochs do not know the shape of their noise together any better than each alone.
        known = whole if len(good) >= SHARED_FROM else None
        for i in places:
            try:
                if i not in seen:
                    raise ValueError(observed[i])
                if known is not None and i in good:
                    at = good.index(i)
                    solution = solve_once([known.problems[at]], [known.powers[at]])
                else:
                    powers = None
                    if known is not None:
                        first = known.problems[0].observation.grid
                        powers = [on_lines(seen[i].grid, first, known.powers[0])]
                    start = begin if whole is None else whole.values
                    solution = solve([seen[i]], pose, start, powers)
                fits[i] = fit_of(method, solution, inertia_kg_m2)
            except ValueError as error:
                fits[i] = _failed(epochs[i].epoch, method, str(error))
    together: list[Fit] = []
    pools = [[one] for one in conditions] if pooled else []
    for own in [*pools, *([conditions] if len(pools) > 1 else [])]:
        members = [
            i
            for i, one in enumerate(epochs)
            if one.epoch.closed.included and one.epoch.condition in own
        ]
        condition = own[0] if len(own) == 1 else ""
        observations = [one for i in members if isinstance(one := observed[i], Observation)]
        sound = [epochs[i] for i in members if fits[i].outcome.included]
        fit: Fit | None = None
        if pose is None and sound:
            fit = _by_function(method, sound, inertia_kg_m2)
        elif pose is not None and observations:
            with suppress(ValueError):  # as each epoch says
                together_of = shared.get(condition) if len(own) == 1 else None
                if together_of is None:
                    begin = _begin(observations, inertia_kg_m2)
                    together_of = solve(observations, pose, begin)
                fit = fit_of(method, together_of, inertia_kg_m2)
        if fit is not None and fit.n_samples:
            findings = fit.findings if condition else ()
            together.append(replace(fit, epoch="pooled", condition=condition, findings=findings))
    return Fitted([fits[i] for i in range(len(epochs))], together, shared)


def _begin(observations: Sequence[Observation], inertia_kg_m2: float | None) -> Array:
    begin = start_of(observations) if observations else np.zeros(3)
    return begin if inertia_kg_m2 is None else begin[1:]


def _by_function(method: Method, epochs: Sequence[Ready], inertia_kg_m2: float | None) -> Fit:
    assert method.fit is not None  # it has no pose
    first = epochs[0].epoch
    sound = [one for one in epochs if not one.obstacle]
    if not sound:
        return _failed(first, method, epochs[0].obstacle)
    try:
        fit = method.fit(sound, inertia_kg_m2)
    except ValueError as error:
        return _failed(first, method, str(error))
    source = ", ".join(dict.fromkeys(one.epoch.source for one in sound))
    outcome = after_fit(first, fit.r_squared, fit.condition_number)
    label, condition = first.label, first.condition
    return replace(
        fit, source=source, epoch=label, condition=condition, method=method.name, outcome=outcome
    )


def _failed(epoch: Epoch, method: Method, reason: str) -> Fit:
    return Fit(epoch.source, epoch.label, epoch.condition, method.name, unusable(epoch, reason))


def fit_of(
    method: Method,
    solution: Solution,
    inertia_kg_m2: float | None = None,
    away: Array | float = 0.0,
    *,
    beside: bool = False,
) -> Fit:
    """Return a solution as it is recorded, named after the first of its epochs.

    Both ends of its intervals are further out by `away`. `beside` says that the targets are torque
    less that of terms, which then counts as explained.
    """
    observations = [one.observation for one in solution.problems]
    epoch = observations[0].epoch
    elsewhere = by_other_drives(solution)
    pulled = loop_pull(solution.problems, solution.powers, solution.values, solution.inverse)
    numbers = of_fit(
        solution.values,
        solution.covariance,
        solution.degrees,
        np.sqrt(np.diag(solution.bound)),
        inertia_kg_m2,
        elsewhere + np.nan_to_num(np.abs(pulled)) + away,
    )
    left = total = moved = 0.0
    samples = sum(one.grid.samples for one in observations)
    for one, problem in zip(observations, solution.problems, strict=True):
        # Parseval: the window's energy is spread over all samples.
        per_line = 2 * one.grid.samples / (one.grid.time_s.size * one.grid.energy)
        unexplained = one.torque_nm - one.motion @ numbers["value"]
        left += per_line * power_of(problem.residual(solution.values) if beside else unexplained)
        total += per_line * power_of(one.torque_nm)
        moved += per_line * power_of(one.motion[:, 2])
    r_squared = 1.0 - left / total
    ranges_rad = [angle_range_rad(one.epoch, one.grid.time_s) for one in observations]
    return Fit(
        source=", ".join(dict.fromkeys(one.epoch.source for one in observations)),
        epoch=epoch.label,
        condition=epoch.condition,
        method=method.name,
        outcome=after_fit(
            epoch, r_squared, solution.condition_number, least_r_squared=WORST_R_SQUARED
        ),
        r_squared=r_squared,
        vaf_percent=100.0 * r_squared,
        condition_number=solution.condition_number,
        residual_sd_nm=float(np.sqrt(left / samples)),
        n_samples=samples,
        band_hz=observations[0].grid.band_hz,
        angle_rms_rad=float(np.sqrt(moved / samples)),
        angle_range_rad=max((r for r in ranges_rad if np.isfinite(r)), default=np.nan),
        findings=between_samples(observations[0], solution, elsewhere),
        **numbers,
    )


def between_samples(
    observation: Observation, solution: Solution, elsewhere: Array
) -> tuple[Finding, ...]:
    """Return the finding of a parameter that depends on what the drive does between the samples.

    Its δ is more than a share of the parameter, and more than its standard error.
    """
    settings, known, held = observation.settings, observation.drive_known, 3 - solution.values.size
    channels, most = observation.epoch.channels, settings.diagnostics.max_between_samples_percent
    if not known and (observation.cause is not None or "velocity_command_rad_s" in channels):
        return ()  # the check of the drive says more
    share = np.pad(100.0 * elsewhere / np.abs(solution.values), (held, 0))
    shows = np.where(np.pad(elsewhere > solution.se, (held, 0)), share, 0.0)
    # Of a drive that is not known J says most: it is what the torque does not see between samples.
    about = int(np.argmax(shows)) if known else 0
    if shows[about] <= most:
        return ()
    return (
        found(
            "between_samples",
            settings.diagnostics,
            float(share[about]),
            most,
            condition=observation.epoch.condition,
            effect=Effect((share[0], share[1], share[2])),
            facts={
                "symbol": "JBK"[about],
                "bandwidth_hz": settings.rig.drive_bandwidth_hz,
                "ticks_hz": ticks_hz(settings.rig, channels["torque_nm"]),
            },
            variant="" if known else "of_settings",
        ),
    )


def power_of(lines: Complex) -> float:
    """Return the sum of |x|² over lines."""
    return float(np.vdot(lines, lines).real)


_INTERVALS = (
    "Intervals are made from the power of the residual at each frequency, torque that "
    "is not from the robot included"
)
_POOLED = (
    f"From {ENOUGH_EPOCHS} epochs on they come from the scatter between epochs; with fewer, each "
    "is the wider of that and what the residual gives"
)

IV = Method(
    name="iv",
    title="instrumental variables, made from the perturbation",
    needs=("perturbation_nm",),
    methods_text="by refined instrumental variables made from the known perturbation",
    pose=instrumental,
    references=("riv", "riv_loop"),
    intervals_text=_INTERVALS,
    pooled_text=_POOLED,
    by_noise=True,
    in_sensitivity=True,
)
SPECTRAL = Method(
    name="spectral",
    title="instrumental variables at the lines of a periodic perturbation",
    needs=("perturbation_nm",),
    methods_text="by instrumental variables at the lines of the periodic perturbation",
    pose=instrumental,
    periodic=True,
    intervals_text=_INTERVALS,
    pooled_text=_POOLED,
    by_noise=True,
)
BANDLIMITED = Method(
    name="bandlimited",
    title="least squares, each frequency weighted by its noise",
    needs=(),
    methods_text="by least squares in which each frequency counts by its noise",
    pose=direct,
    intervals_text=_INTERVALS
    + ". They hold what that torque, coming back by the loop of the settings, does to least "
    "squares, and where the drive is not known what one as that of the settings does between the "
    "samples",
    pooled_text=_POOLED,
    by_noise=True,
    in_sensitivity=True,
)
