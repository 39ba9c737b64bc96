"""From epochs to J, B and K: drives, clocks, two stages, checks, terms, conditions.

1. Stretches in which a sensor did not measure, or a muscle was active, are left out.
2. The drive of each recording is identified, and how late its torque is.
3. J, B and K of each epoch and of each condition; every epoch is checked, and one that a check
   excludes is not in the pool.
4. What the torque holds beside J, B and K, by condition, and J, B and K beside it.
5. J is held at the median of all included epochs of all conditions, and B and K are found again
   (Eq. 7, Sec. 2.4.4).
"""

from __future__ import annotations

import difflib
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np
import scipy
from numpy.lib.stride_tricks import sliding_window_view

from rigidimeter.analysis.estimation.activity import activities
from rigidimeter.analysis.estimation.answer import Answer, answer, beside, findings_of
from rigidimeter.analysis.estimation.between import band_estimates, band_finding, between_epochs
from rigidimeter.analysis.estimation.checks import (
    Pull,
    in_half_intervals,
    motion,
    sensors,
)
from rigidimeter.analysis.estimation.checks import fit as of_fit
from rigidimeter.analysis.estimation.delay import (
    corrected_s,
    delay_of,
    late_torque,
    widened,
    with_clock_error,
)
from rigidimeter.analysis.estimation.drive import find_drive
from rigidimeter.analysis.estimation.grid import Array, Complex
from rigidimeter.analysis.estimation.methods import (
    BANDLIMITED,
    IV,
    SPECTRAL,
    Fitted,
    Method,
    Ready,
    fit_epochs,
    fit_of,
)
from rigidimeter.analysis.estimation.observation import (
    Cause,
    Observation,
    loop_of,
    no_instrument,
    observe,
)
from rigidimeter.analysis.estimation.published import fit_published
from rigidimeter.analysis.estimation.scores import line_shares, score_epoch
from rigidimeter.analysis.estimation.solve import Problem, Solution, solve_once
from rigidimeter.analysis.estimation.stretches import longest_part, obstacle, screened
from rigidimeter.core.findings import Fact, Finding, found_between
from rigidimeter.core.records import Analysis, Axis, BandEstimate, Delay, Epoch, Fit, Outcome, Task
from rigidimeter.core.settings import Settings
from rigidimeter.core.words import short_names

PUBLISHED = Method(
    name="published",
    title="least squares as the paper prints it",
    needs=(),
    methods_text="by ordinary least squares in the time domain, as published",
    fit=fit_published,
    references=("paper",),
    intervals_text="Intervals take the residual for white and do not include bias",
    pooled_text=(
        "The joint is taken for one that does not change, and where epochs differ by more than "
        "their own intervals these are too narrow"
    ),
    as_recorded=True,
    in_sensitivity=True,
)

METHODS: list[Method] = [PUBLISHED, BANDLIMITED, IV, SPECTRAL]
"""Every estimator. Code from outside the package may append its own."""

Check = Callable[[Observation, Fit, Pull], list[Finding]]
"""From an epoch, its fit, and what torque of the subject does to that, to findings."""

CHECKS: list[Check] = [
    sensors.sensors,
    sensors.velocity,
    motion.excitation,
    of_fit.following,
    sensors.static_torque,
    of_fit.residual,
    of_fit.least_squares,
    motion.own_torque,
    of_fit.parameters,
]
"""Every check of an epoch. Code from outside the package may append its own."""

MOST_TRIED = 5
"""From so many epochs it is known whether the motion follows the perturbation."""

FOLLOWS_CHANCE, GROUP_LINES, GROUP_SHARE = 1e-6, 8, 0.15
"""A motion that answers with a larger probability by chance does not follow; lines are taken
together that are so many in a row, and reach over this share of their frequency."""

SINGLE_FREQUENCY_SHARE = 0.85
"""Above this share of the angle's variance in one line an epoch is an imposed sinusoid, unless the
velocity shows steps to and fro. A sinusoid that fills half the epoch reaches 0.95, a PRBS in the
closed loop 0.5."""

DIFFERENT_INERTIA_PERCENT = 15.0
"""Recordings whose median J differ by more hardly are of one joint."""

Progress = Callable[[float], None]
"""Called with the share of the work that was done since, 1 in all."""


class Recorded(NamedTuple):
    """Epochs of one joint, with what every analysis of them needs.

    Attributes
    ----------
    epochs : tuple of Epoch
        As recorded.
    settings : Settings
    perturbed : tuple of Ready
        Those that are fitted, as recorded.
    imposed : tuple of Epoch
        Those that are scored, as recorded.
    delays : tuple of Delay
        How late the torque of each recording is; empty where that was not wanted.
    observed : tuple of Observation or str
        The perturbed epochs at their lines, as the delays were found; with what the perturbation
        causes where that was recorded.
    """

    epochs: tuple[Epoch, ...]
    settings: Settings
    perturbed: tuple[Ready, ...]
    imposed: tuple[Epoch, ...]
    delays: tuple[Delay, ...] = ()
    observed: tuple[Observation | str, ...] = ()

    def analysed(self, *, as_recorded: bool) -> list[Ready]:
        """Return the epochs of both kinds, perturbed ones first, on one clock or as recorded."""
        every = [*self.perturbed, *(Ready(one, self.settings) for one in self.imposed)]
        if as_recorded:
            return every
        moves = [corrected_s(one.epoch.source, self.delays) for one in every]
        return [one.moved(by_s) if by_s else one for one, by_s in zip(every, moves, strict=True)]


def method_names() -> tuple[str, ...]:
    """Return what `--method` takes: ``auto``, the default, and the name of each estimator."""
    return ("auto", *(method.name for method in METHODS))


def no_such_method(name: str) -> str:
    """Return why `--method` cannot be `name`, and what it may be."""
    known = method_names()
    (near,) = difflib.get_close_matches(name, known, n=1, cutoff=0.0)
    return f"there is no such method; the nearest is {near} (known: {', '.join(known)})"


def method_named(name: str) -> Method:
    """Return the estimator of that name.

    Raises
    ------
    ValueError
        If there is none, with the names of those there are; or if two have the name.
    """
    named = [method for method in METHODS if method.name == name]
    if not named:
        raise ValueError(no_such_method(name))
    if len(named) > 1:
        raise ValueError(f"two methods have the name {name}; rename the one that was added")
    return named[0]


def task_of(epoch: Epoch, settings: Settings) -> Task:
    """Return the epoch's task: as recorded, else a sinusoid if the motion holds a single line."""
    if epoch.task is not None:
        return epoch.task
    if obstacle(epoch, settings.estimation):
        return "prbs"  # it will fail with its reason among the fits
    return "sinusoid" if line_shares(epoch).single(SINGLE_FREQUENCY_SHARE) else "prbs"


def prepare(
    epochs: Iterable[Epoch],
    settings: Settings,
    *,
    clocks: bool = True,
    progress: Progress = lambda _: None,
) -> Recorded:
    """Return epochs with tasks, what is left out, the drive and the delay of each recording.

    Parameters
    ----------
    epochs : iterable of Epoch
    settings : Settings
    clocks : bool
        Whether delays are wanted.
    progress : callable
    """
    everyone = tuple(epochs)
    tasks = [task_of(one, settings) for one in everyone]
    perturbed = [one for one, task in zip(everyone, tasks, strict=True) if task == "prbs"]
    # A sinusoid is scored over whole cycles, and rests at its turning points.
    imposed = [longest_part(one) for one, task in zip(everyone, tasks, strict=True)
               if task == "sinusoid"]  # fmt: skip
    measured = [screened(one, settings) for one in perturbed]
    active = activities(perturbed, measured, settings)
    sources = dict.fromkeys(one.source for one in everyone)
    commands = [one.channels.get("velocity_command_rad_s") for one, _ in active]
    # One recording may hold commands of several rates: each has a drive.
    rigs: list[tuple[str, float]] = []
    driven: dict[tuple[str, float], list[Epoch]] = {}
    for (one, _), command in zip(active, commands, strict=True):
        rate_hz = command.mean_rate_hz if command and len(command) > 1 else 0.0
        like = (r for r in driven if r[0] == one.source and abs(r[1] - rate_hz) <= 0.05 * rate_hz)
        rigs.append(next(like, (one.source, rate_hz)))
        sound = driven.setdefault(rigs[-1], [])
        if one.closed.included and not obstacle(one, settings.estimation):
            sound.append(one)
    drives = {rig: find_drive(some, settings) for rig, some in driven.items()}
    ready = [
        Ready(
            epoch,
            settings,
            drives.get(rig),
            obstacle(epoch, settings.estimation),
            activity,
            whole if epoch is not whole else None,
        )
        for whole, (epoch, activity), rig in zip(measured, active, rigs, strict=True)
    ]
    causes: list[tuple[Array, Cause]] = []
    observed = [
        _observed(one, None if no_instrument(one.epoch) else causes) if clocks else ""
        for one in ready
    ]
    delays = []
    for source in sources:
        own = [i for i, one in enumerate(ready) if one.epoch.source == source]
        if clocks:
            delays.append(_delay_of(source, [ready[i] for i in own], [observed[i] for i in own]))
        progress(1.0 / len(sources))
    return Recorded(
        everyone, settings, tuple(ready), tuple(imposed), tuple(delays), tuple(observed)
    )


def _delay_of(source: str, ready: Sequence[Ready], observed: Sequence[Observation | str]) -> Delay:
    both = [(r, o) for r, o in zip(ready, observed, strict=True) if isinstance(o, Observation)]
    known = [one for one in both if one[1].cause is not None]
    causes: list[tuple[Array, Cause]] | None = [] if known else None

    def again(epochs: Sequence[Ready]) -> list[Observation]:
        return [_observation(one, causes) for one in epochs]

    used = known or both
    return delay_of(source, [one for one, _ in used], [seen for _, seen in used], again)


def _observation(
    ready: Ready, causes: list[tuple[Array, Cause]] | None, *, periodic: bool = False
) -> Observation:
    """Return an epoch at its lines; `causes` where the perturbation is the instrument."""
    if ready.obstacle:
        raise ValueError(ready.obstacle)
    epoch, settings, drive = ready.epoch, ready.settings, ready.drive
    loop = loop_of(settings, epoch.channels["torque_nm"].rate_hz, drive)
    # A window with a hole would spread excited lines over those between them.
    part = longest_part(epoch) if periodic else epoch
    seen = observe(part, settings, drive, loop, causes, periodic=periodic)
    return seen if causes is not None else replace(seen, loop=of_fit.loop_shown(seen, drive))


def _observed(
    ready: Ready, causes: list[tuple[Array, Cause]] | None, *, periodic: bool = False
) -> Observation | str:
    """Return `_observation`, or why there is none."""
    try:
        return _observation(ready, causes, periodic=periodic)
    except ValueError as error:
        return str(error)


def observed_for(
    method: Method, epochs: Sequence[Ready], recorded: Recorded | None = None
) -> list[Observation | str]:
    """Return epochs as a method sees them, or why it cannot.

    Epochs with one perturbation share what it causes. A method without a pose is checked with
    the lines of the motion alone.

    Parameters
    ----------
    method : Method
    epochs : sequence of Ready
    recorded : Recorded, optional
        Whose epochs they are: what was observed already, and not moved, is not observed again.
    """
    causes: list[tuple[Array, Cause]] | None = [] if method.uses_perturbation else None
    known: dict[int, Observation | str] = {}
    if recorded is not None and not method.periodic:
        known = dict(zip(map(id, recorded.perturbed), recorded.observed, strict=True))
    found: list[Observation | str] = []
    for one in epochs:
        seen = known.get(id(one), "")
        if isinstance(seen, Observation) and (seen.cause is None) == (causes is None):
            found.append(seen)
        else:
            found.append(_observed(one, causes, periodic=method.periodic))
    return found


def choose_method(
    epochs: Sequence[Ready], observed: Sequence[Observation | str] = ()
) -> tuple[str, str]:
    """Return the method that suits what was recorded, and why.

    With a perturbation that the motion follows, instrumental variables, which a subject who pushes
    does not bias. An epoch that lacks it then fails, unless most do. Without it only least squares
    is possible.

    Parameters
    ----------
    epochs : sequence of Ready
    observed : sequence of Observation or str, optional
        The same at their lines, where they were observed already.
    """
    if not epochs:
        return "bandlimited", "there is no epoch to fit"
    missing = [why for one in epochs if (why := no_instrument(one.epoch))]
    least_squares = (
        "so least squares weighted by noise is used: torque of the subject over all of the band, "
        "or a joint that is not J, B and K, biases it"
    )
    if 2 * len(missing) > len(epochs):
        shown = f"{missing[0]} (in {len(missing)} of {len(epochs)} epochs)"
        return "bandlimited", f"{shown}, {least_squares}"
    able = [i for i, one in enumerate(epochs) if not one.obstacle and not no_instrument(one.epoch)]
    tried = [(epochs[i], observed[i] if observed else "") for i in able[:MOST_TRIED]]
    unanswered = [one for one, seen in tried if not _follows(one, seen)]
    if 2 * len(unanswered) > len(tried):
        return "bandlimited", (
            f"the motion does not follow perturbation_nm (in {len(unanswered)} of "
            f"{len(tried)} epochs that were tried; first epoch "
            f"{unanswered[0].epoch.label}), {least_squares}. Check which column holds the "
            "perturbation, and that it and the motion have one clock; --method iv uses it "
            "all the same"
        )
    where = f" in {len(epochs) - len(missing)} of {len(epochs)} epochs" if missing else ""
    return "iv", (
        f"the perturbation was recorded{where}, so the motion that it causes is the instrument: "
        "torque not from the robot does not bias the estimate"
    )


def _follows(ready: Ready, observed: Observation | str) -> bool:
    """Return whether any of the motion answers the perturbation, beyond chance.

    The velocity is regressed on the perturbation with one complex factor in each group of n_g
    neighbouring lines. By noise alone

        F = Σ |h|² Σ|P|² / (2G) ÷ Σ |V − h P|² / (2 Σ (n_g − 1))

    has Fisher's distribution, each group divided by its noise.
    """
    seen = observed if isinstance(observed, Observation) else _observed(ready, None)
    if isinstance(seen, str):
        return True  # the fit says why
    cause, velocity = motion.perturbation_lines(seen), seen.motion[:, 1]
    edges = [0]
    while edges[-1] < cause.size:
        reach = int(GROUP_SHARE * (seen.grid.line[0] + edges[-1]))
        edges.append(edges[-1] + max(GROUP_LINES, reach))
    starts = np.array(edges[: max(len(edges) - 2, 1)])  # the last group takes what is left over
    sizes = np.diff(np.append(starts, cause.size))
    power = np.add.reduceat(np.abs(cause) ** 2, starts)
    factor = np.add.reduceat(cause.conj() * velocity, starts) / np.maximum(power, 1e-300)
    answered = np.abs(factor) ** 2 * power
    left = np.maximum(np.add.reduceat(np.abs(velocity) ** 2, starts) - answered, 1e-300)
    p = scipy.special.fdtrc(2, 2 * (sizes - 1), answered / left * (sizes - 1))
    return bool(np.min(p) * p.size < FOLLOWS_CHANCE)


def observations_of(epochs: Sequence[Ready]) -> list[Observation]:
    """Return epochs at their lines, with what the perturbation causes where all recorded it.

    Raises
    ------
    ValueError
        If one cannot be observed; the text says why.
    """
    known = not any(no_instrument(one.epoch) for one in epochs)
    causes: list[tuple[Array, Cause]] | None = [] if known else None
    return [_observation(one, causes) for one in epochs]


class Impedance(NamedTuple):
    """Torque over angle at the excited lines, without a model.

    Attributes
    ----------
    frequency_hz, coherence : array, shape (m,)
    impedance_nm_rad : complex array, shape (m,)
    observed : int
        Epochs that it is made of.
    """

    frequency_hz: Array
    impedance_nm_rad: Complex
    coherence: Array
    observed: int


def impedance(epochs: Sequence[Ready]) -> Impedance | None:
    """Return the impedance of epochs that share the joint, K − J ω² + i B ω of one that is linear.

    Over whole periods of a perturbation the response is in the lines that periods have in common,
    and the lines between hold nothing but noise. Torque and angle at the excited lines are added
    over the epochs, turned so that the perturbation has phase zero in each; the coherence is
    |response|² / (|response|² + noise) of the sums. None where no epoch holds two periods.
    """
    groups: dict[tuple[int, ...], list[Observation]] = {}
    for one in observed_for(SPECTRAL, epochs):
        if isinstance(one, Observation):
            lines_hz = motion.hertz(one.grid)[one.excited]
            groups.setdefault(tuple(np.rint(1e3 * lines_hz).astype(int)), []).append(one)
    if not groups:
        return None
    seen = max(groups.values(), key=len)
    sums: Complex = np.zeros((2, int(np.count_nonzero(seen[0].excited))), dtype=np.complex128)
    noise = np.zeros(sums.shape[1])
    for one in seen:
        at, cause = one.excited, motion.perturbation_lines(one)
        turn = (cause.conj() / np.maximum(np.abs(cause), 1e-300))[at]
        sums += turn * np.stack([one.torque_nm[at], one.motion[at, 2]])
        between = np.where(at, np.nan, np.abs(one.torque_nm) ** 2)
        beside = sliding_window_view(np.pad(between, 2, constant_values=np.nan), 5)
        noise += np.nanmean(beside[at], axis=1)
    frequency_hz = motion.hertz(seen[0].grid)[seen[0].excited]
    coherence = np.clip(1 - noise / np.abs(sums[0]) ** 2, 0.0, 1.0)
    return Impedance(frequency_hz, np.asarray(sums[0] / sums[1]), coherence, len(seen))


def estimate_recorded(
    recorded: Recorded,
    method: str = "auto",
    *,
    fits_alone: bool = False,
    progress: Progress = lambda _: None,
) -> Analysis:
    """Fit every perturbation epoch by a method, and score every sinusoidal one.

    Parameters
    ----------
    recorded : Recorded
    method : str
        The name of one of `METHODS`; ``auto`` chooses by what was recorded.
    fits_alone : bool
        Leave out what does not decide whether an epoch counts: pooled fits, terms, scores.
    progress : callable

    Raises
    ------
    ValueError
        If there is no such method.
    """
    settings, reason, auto = recorded.settings, "", method == "auto"
    if auto:
        method, reason = choose_method(recorded.perturbed, recorded.observed)
    estimator = method_named(method)
    delays = () if estimator.as_recorded else recorded.delays
    every = recorded.analysed(as_recorded=estimator.as_recorded)
    epochs, imposed = every[: len(recorded.perturbed)], every[len(recorded.perturbed) :]
    observed = observed_for(estimator, epochs, recorded)
    progress(0.2)
    stage = partial(_fitted, estimator, observed=observed, delays=delays)
    fitted = stage(epochs, pooled=not fits_alone)
    progress(0.1)
    pulls = [_pull(estimator, seen, fit) for seen, fit in zip(observed, fitted.fits, strict=True)]
    fits = [
        _checked(estimator, *each, delays)
        for each in zip(epochs, observed, fitted.fits, pulls, strict=True)
    ]
    pooled, bands, parts = fitted.pooled, list[BandEstimate](), list[Part]()
    if not fits_alone:
        counted = [
            one._replace(epoch=replace(one.epoch, closed=fit.outcome))
            if one.epoch.closed.included and fit.n_samples and not fit.outcome.included
            else one
            for one, fit in zip(epochs, fits, strict=True)
        ]
        if any(a is not b for a, b in zip(counted, epochs, strict=True)):
            # What a check excludes must not be in the pool either.
            fitted = stage(counted, pooled=True)
        # The perturbation that the motion does not follow is no instrument of terms either.
        own = IV if not auto or estimator is IV else BANDLIMITED
        parts = _parts(estimator, own, epochs, observed, fits, fitted)
        if any(part.beside for part in parts):
            fitted = stage(counted, parts, pooled=True)
            each = zip(observed, fits, pulls, fitted.fits, strict=True)
            both = [_checked_beside(estimator, *one, parts) for one in each]
            fits, pulls = [fit for fit, _ in both], [pull for _, pull in both]
        pooled = [_with_values(one, parts) for one in fitted.pooled]
        fits, pooled, bands = _together(estimator, counted, fits, pooled, parts, pulls, delays)
    progress(0.6)
    included = [fit.inertia_kg_m2 for fit in fits if fit.outcome.included]
    inertia_kg_m2 = float(np.median(included)) if included else float("nan")
    fixed = [Fit(fit.source, fit.epoch, fit.condition, fit.method, fit.outcome) for fit in fits]
    if included:
        second = stage(epochs, parts, inertia_kg_m2, pooled=False).fits
        # What did not count in the first stage does not in the second.
        fixed = [
            _with_values(two, parts) if one.outcome.included else replace(two, outcome=one.outcome)
            for one, two in zip(fits, second, strict=True)
        ]
    scores = [
        score_epoch(one.epoch, settings.scores, settings.estimation)
        for one in (() if fits_alone else imposed)
    ]
    progress(0.1)
    return Analysis(
        method,
        tuple(fits),
        tuple(fixed),
        inertia_kg_m2,
        tuple(scores),
        tuple(pooled),
        delays,
        reason,
        tuple(bands),
        () if fits_alone else tuple(_of_recordings(fits)),
        _axis(recorded),
    )


def estimate(
    epochs: Iterable[Epoch],
    settings: Settings,
    method: str = "auto",
    *,
    progress: Progress = lambda _: None,
) -> Analysis:
    """Estimate J, B and K of every epoch, and score the imposed sinusoids.

    Parameters
    ----------
    epochs : iterable of Epoch
        Of one joint.
    settings : Settings
    method : str
        The name of one of `METHODS`; ``auto`` chooses by what was recorded.
    progress : callable

    Raises
    ------
    ValueError
        If there is no such method.
    """
    clocks = method == "auto" or not method_named(method).as_recorded
    recorded = prepare(epochs, settings, clocks=clocks, progress=lambda n: progress(0.4 * n))
    return estimate_recorded(recorded, method, progress=lambda n: progress(0.6 * n))


def fit_epoch(
    epoch: Epoch, method: str, settings: Settings, inertia_kg_m2: float | None = None
) -> Fit:
    """Fit J, B and K to one epoch, or B and K when the inertia is given, without checks.

    An epoch that cannot be fitted gives a `Fit` whose outcome is `failed`, with the reason.
    """
    estimator = method_named(method)
    ready = prepare([replace(epoch, task="prbs")], settings, clocks=False).perturbed
    observed = observed_for(estimator, ready)
    return fit_epochs(estimator, ready, observed, inertia_kg_m2, pooled=False).fits[0]


def _fitted(
    method: Method,
    epochs: Sequence[Ready],
    parts: Sequence[Part] = (),
    inertia_kg_m2: float | None = None,
    *,
    observed: Sequence[Observation | str],
    delays: Sequence[Delay],
    pooled: bool,
) -> Fitted:
    """Return fits beside the terms of `parts`; their intervals hold the error of the clocks."""
    fitted = fit_epochs(method, epochs, observed, inertia_kg_m2, pooled=pooled)
    pools = [_beside(method, one, parts, inertia_kg_m2) for one in fitted.pooled]
    fits = [_beside(method, one, parts, inertia_kg_m2) for one in fitted.fits]

    def again(by_s: Sequence[float]) -> list[Fit]:
        moved = [one.moved(late_s) for one, late_s in zip(epochs, by_s, strict=True)]
        seen = [
            one.late(late_s) if isinstance(one, Observation) else one
            for one, late_s in zip(observed, by_s, strict=True)
        ]
        found = fit_epochs(method, moved, seen, inertia_kg_m2, pooled=False).fits
        return [
            _beside(method, one, parts, inertia_kg_m2, late_s)
            for one, late_s in zip(found, by_s, strict=True)
        ]

    alone, together = with_clock_error(epochs, fits, pools, delays, again)
    return fitted._replace(fits=alone, pooled=together)


def _pull(method: Method, seen: Observation | str, fit: Fit) -> Pull:
    """Return what torque of the subject does to a fit."""
    if method.uses_perturbation or fit.n_samples == 0 or not isinstance(seen, Observation):
        return Pull(instruments=method.uses_perturbation)
    return of_fit.pull_of(seen, fit, by_noise=method.by_noise)


def _checked(
    method: Method,
    ready: Ready,
    seen: Observation | str,
    fit: Fit,
    pull: Pull,
    delays: Sequence[Delay],
) -> Fit:
    """Return the fit with what the checks of its epoch found, excluded if one of them says so."""
    fit = replace(fit, activity=ready.activity)
    if fit.n_samples == 0 or not isinstance(seen, Observation):
        return fit  # it has said why
    delay = next((one for one in delays if one.source == fit.source), None)
    findings = list(_findings(method, ready, seen, fit, pull, delay))
    serious = [one for one in findings if one.level == "exclude"]
    outcome = fit.outcome
    if serious and outcome.included:
        outcome = _excluded(serious[0])
    return in_half_intervals(replace(fit, outcome=outcome, findings=(*fit.findings, *findings)))


def _excluded(finding: Finding) -> Outcome:
    """Return the outcome of an epoch that a finding excludes."""
    words = finding.words
    return Outcome("excluded", f"{words.headline}. {words.remedy}".rstrip(". "))


def _findings(
    method: Method, ready: Ready, seen: Observation, fit: Fit, pull: Pull, delay: Delay | None
) -> Iterator[Finding]:
    # What fits the samples as they are does not know what the drive does with a held command.
    checked = replace(seen, drive_known=False) if method.as_recorded else seen
    for check in CHECKS:
        yield from check(checked, fit, pull)
    whole = _with_active(method, ready)
    checks = ready.settings.diagnostics
    yield from motion.emg_activity(ready.epoch, fit, whole, checks, pull)
    if not pull.instruments:
        yield from late_torque(seen, fit, delay)


def _with_active(method: Method, ready: Ready) -> Fit | None:
    """Return the fit with the stretches that are left out for an active muscle; None without."""
    if ready.with_active is None:
        return None
    whole = [ready._replace(epoch=ready.with_active, with_active=None)]
    (fit,) = fit_epochs(method, whole, observed_for(method, whole), pooled=False).fits
    return fit if fit.n_samples else None


class Part(NamedTuple):
    """Epochs of a condition that count and hold the same terms.

    Attributes
    ----------
    condition : str
    answer : Answer
    problems : list of Problem
        Of J, B and K, with the torque of the terms taken from their targets where `beside`.
    powers : list of array
    values : list of array, shape (3,)
        J, B and K of each epoch without terms.
    beside : bool
        Whether J, B and K are given beside the terms.
    """

    condition: str
    answer: Answer
    problems: list[Problem]
    powers: list[Array]
    values: list[Array]
    beside: bool

    @property
    def labels(self) -> tuple[str, ...]:
        """What the epochs are called."""
        return tuple(one.observation.epoch.label for one in self.problems)

    def places(self, fit: Fit) -> list[int]:
        """Return which of its epochs a fit is made of: of one, of the condition, or of all."""
        pooled = fit.epoch == "pooled"
        if fit.condition != self.condition and not (pooled and not fit.condition):
            return []
        epochs = [one.observation.epoch for one in self.problems]
        both = (fit.source, fit.epoch)
        return [i for i, one in enumerate(epochs)
                if pooled or (one.source, one.label) == both]  # fmt: skip


def _parts(
    method: Method,
    own: Method,
    epochs: Sequence[Ready],
    observed: Sequence[Observation | str],
    fits: Sequence[Fit],
    fitted: Fitted,
) -> list[Part]:
    """Return what the torque of each condition holds beside J, B and K, by a method of its `own`.

    By the perturbation where all epochs recorded it and the motion follows it, whatever the method:
    at J, B and K of least squares the subject's own torque would show in the residual as well.
    Epochs in which a term is not the same are parts of their own.
    """
    counting = [i for i, fit in enumerate(fits) if fit.outcome.included]
    epochs, seen = [epochs[i] for i in counting], [observed[i] for i in counting]
    own = BANDLIMITED if any(no_instrument(one.epoch) for one in epochs) else own
    shared, fits = fitted.shared, [fits[i] for i in counting]
    if own is not method:
        seen = observed_for(own, epochs)
        fitted = fit_epochs(own, epochs, seen, pooled=False)
        shared, fits = fitted.shared, fitted.fits
    known = {(f.condition, f.source, f.epoch): f.value for f in fits if f.outcome.included}

    def part_of(condition: str, solution: Solution) -> Part:
        those = [one.observation for one in solution.problems]
        found = answer(solution, person=those[0].settings.diagnostics.subject_present)
        better = own is method and found.better
        keys = [(condition, one.epoch.source, one.epoch.label) for one in those]
        return Part(
            condition,
            found,
            beside(found) if better else list(solution.problems),
            list(found.state.powers if better else solution.powers),
            [known.get(one, solution.values) for one in keys],
            better,
        )

    parts = []
    for condition, solution in shared.items():
        part = part_of(condition, solution)
        alone: list[Solution | None] = [solution]
        if part.answer.differs:
            alone = [
                fit_epochs(own, [one], [each], pooled=False).shared.get(condition)
                for one, each in zip(epochs, seen, strict=True)
                if one.epoch.condition == condition
            ]
        parts += [part] if len(alone) == 1 else [part_of(condition, x) for x in alone if x]
    return parts


def _beside(
    method: Method,
    fit: Fit,
    parts: Sequence[Part],
    inertia_kg_m2: float | None = None,
    late_s: float = 0.0,
) -> Fit:
    """Return a fit with J, B and K beside the terms that its epochs hold.

    Its intervals hold the error of the terms too. `late_s` is by how much the torque is moved.
    """
    own = [(part, places) for part in parts if (places := part.places(fit))]
    if not any(part.beside for part, _ in own) or not fit.outcome.included:
        return fit
    held = () if inertia_kg_m2 is None else (inertia_kg_m2,)
    free = slice(len(held), None)
    problems: list[Problem] = []
    powers: list[Array] = []
    variance, away = np.zeros((2, 3 - len(held)))
    for part, places in own:
        given = [
            p._replace(
                instruments=p.instruments[:, free],
                regressors=p.regressors[:, free],
                target=p.target * np.exp(1j * p.observation.grid.omega_rad_s * late_s)
                - p.regressors[:, : len(held)] @ np.array(held),
                held=held,
            )
            for p in part.problems
        ]
        if part.beside:
            # What the terms' own error adds to that of J, B and K with the terms given.
            known = np.diag(solve_once(given, part.powers).covariance)
            more = np.maximum(np.diag(part.answer.covariance)[free] - known, 0.0)
            variance = variance + len(places) ** 2 * more
            away = away + len(places) * part.answer.away[free]
        problems += [given[i] for i in places]
        powers += [part.powers[i] for i in places]
    count = len(problems)
    made = fit_of(method, solve_once(problems, powers), inertia_kg_m2, away / count, beside=True)
    wider = np.append(np.zeros(len(held)), np.sqrt(variance) / count)
    return replace(
        widened(made, list(np.diag(wider))),
        source=fit.source,
        epoch=fit.epoch,
        condition=fit.condition,
        outcome=fit.outcome,
    )


def _checked_beside(
    method: Method,
    seen: Observation | str,
    checked: Fit,
    pull: Pull,
    fit: Fit,
    parts: Sequence[Part],
) -> tuple[Fit, Pull]:
    """Return the fit of an epoch beside terms, checked again at the torque less theirs, and pull.

    What was checked stays where there are no terms, and whether the epoch counts.
    """
    own = [part.problems[i] for part in parts if part.beside for i in part.places(checked)]
    if not own or isinstance(seen, str):
        return checked, pull
    terms_nm = seen.torque_nm - own[0].target
    rest = replace(seen, motion=own[0].regressors, terms_nm=terms_nm)
    pull = _pull(method, rest, fit)
    found = [one for check in CHECKS for one in check(rest, fit, pull)]
    # How active stretches change the fit was asked of both without terms.
    kept = [one for one in checked.findings if one.name == "emg_activity"]
    return replace(
        fit,
        outcome=checked.outcome,
        activity=checked.activity,
        findings=(*fit.findings, *found, *kept),
    ), pull


def _with_values(fit: Fit, parts: Sequence[Part]) -> Fit:
    """Return a fit beside terms with whether a joint can have these numbers."""
    own = [part for part in parts if part.beside and part.places(fit)]
    if not own or not fit.outcome.included:
        return fit
    more = of_fit.values(own[0].problems[0].observation, fit)
    return replace(fit, findings=(*fit.findings, *more))


def _together(
    method: Method,
    epochs: Sequence[Ready],
    fits: Sequence[Fit],
    pooled: Sequence[Fit],
    parts: Sequence[Part],
    pulls: Sequence[Pull],
    delays: Sequence[Delay],
) -> tuple[list[Fit], list[Fit], list[BandEstimate]]:
    """Return fits and pooled fits with what epochs of a condition show together, and bands."""
    bands: list[BandEstimate] = []
    labels: dict[str, tuple[str, ...]] = {}
    for condition in dict.fromkeys(part.condition for part in parts):
        those = [part for part in parts if part.condition == condition]
        seen = [p.observation for part in those for p in part.problems]
        labels[condition] = tuple(label for part in those for label in part.labels)
        pool = next((fit for fit in pooled if fit.condition == condition), None)
        if seen[0].cause is not None:
            values = [value for part in those for value in part.values]
            bands += band_estimates(seen, values, pool if method.uses_perturbation else None)
    told = [_told(part, fits) for part in parts]

    def with_shared(fit: Fit, more: Sequence[Finding], settings: Settings) -> Fit:
        by_name: dict[str, Finding] = {}
        for part, findings in zip(parts, told, strict=True):
            for finding in findings if part.places(fit) else ():
                before = by_name.setdefault(finding.name, finding)
                by_name[finding.name] = max(before, finding, key=lambda one: abs(one.value))
        shared = list(by_name.values())
        own = [band for band in bands if band.condition == fit.condition]
        if own and by_name.keys() <= {"lack_of_fit"}:  # what has no other name
            shared += [
                replace(finding, condition=fit.condition, epochs=labels[fit.condition])
                for finding in band_finding(fit, own, settings.diagnostics)
            ]
        outcome = fit.outcome
        serious = [finding for finding in shared if finding.level == "exclude"]
        if serious and outcome.included:
            outcome = _excluded(serious[0])
        own_findings = [one for one in fit.findings if one.name not in by_name]
        found = (*own_findings, *shared, *more)
        return in_half_intervals(replace(fit, outcome=outcome, findings=found))

    alone = []
    for ready, fit, pull in zip(epochs, fits, pulls, strict=True):
        if not fit.outcome.included:
            alone.append(fit)
            continue
        delay = next((one for one in delays if one.source == fit.source), None)
        more: list[Finding] = []
        if ready.drive is None:
            more = of_fit.between_samples(ready.epoch, fit, pull, ready.settings, delay)
        rubs = any("friction" in part.answer.little for part in parts if part.places(fit))
        if not more and rubs:
            more = of_fit.friction_of_drive(ready.epoch, fit, ready.settings)
        alone.append(with_shared(fit, more, ready.settings))
    together = []
    for pool in pooled:
        own = [f for f in alone if f.outcome.included and pool.condition in ("", f.condition)]
        if len(own) < sum(f.outcome.included and pool.condition in ("", f.condition) for f in fits):
            continue  # withheld
        settings = epochs[0].settings
        biases = [
            pull.bias
            for pull, fit in zip(pulls, alone, strict=True)
            if pull.bias is not None and any(fit is one for one in own)
        ]
        more = []
        if biases:
            mean = Pull(np.mean(biases, axis=0), method.by_noise)
            more = of_fit.loop_bias(pool, mean, settings.diagnostics)
        differing = between_epochs(own, method.uses_perturbation, settings.diagnostics)
        if pool.condition and differing is not None:
            more = [*more, differing]
        whole = with_shared(pool, more, settings)
        together.append(replace(whole, findings=(*whole.findings, *_of_every(whole, own))))
    return alone, together, bands


def _told(part: Part, fits: Sequence[Fit]) -> list[Finding]:
    """Return the findings of what a part holds; where J, B and K are not beside it, of theirs."""
    own = [fit for fit in fits if part.places(fit)]
    halves = [(np.asarray(one.high) - np.asarray(one.low)) / 2 for one in own]
    shown = np.mean([one.value for one in own], axis=0), np.mean(halves, axis=0)
    settings, straight = part.problems[0].observation.settings, part.answer.straight
    told = [*findings_of(part.answer, settings, None if part.beside else shown)]
    if straight is not None:
        names = {one.name for one in told}
        told += [one for one in findings_of(straight, settings, shown) if one.name not in names]
    return [replace(one, condition=part.condition, epochs=part.labels) for one in told]


def _of_every(pool: Fit, own: Sequence[Fit]) -> list[Finding]:
    """Return the cautions that all epochs of a pool carry and the pool does not carry yet.

    What all epochs share does not average out. Each is that of the epoch furthest beyond the limit.
    """
    cautions = [{one.name: one for one in fit.findings if one.level != "note"} for fit in own]
    said = {one.name for one in pool.findings}
    labels = tuple(fit.epoch for fit in own)
    common = []
    for name in cautions[0] if cautions else ():
        shown = [one[name] for one in cautions if name in one]
        if len(shown) == len(own) and name not in said:
            most = max(shown, key=lambda one: abs(one.value - one.limit))
            common.append(replace(most, epochs=labels, condition=pool.condition))
    return common


def _of_recordings(fits: Sequence[Fit]) -> Iterator[Finding]:
    """Yield that recordings differ in J: one median for all puts that into B and K."""
    by_source: dict[str, list[float]] = {}
    for fit in fits:
        if fit.outcome.included:
            by_source.setdefault(fit.source, []).append(fit.inertia_kg_m2)
    medians = {source: float(np.median(values)) for source, values in by_source.items()}
    if len(medians) < 2 or min(medians.values()) <= 0:
        return
    low, high = min(medians, key=medians.__getitem__), max(medians, key=medians.__getitem__)
    percent = 100.0 * (medians[high] / medians[low] - 1.0)
    if percent >= DIFFERENT_INERTIA_PERCENT:
        names = short_names(medians)
        facts: dict[str, Fact] = {"high": names[high], "high_j": medians[high]}
        facts |= {"low": names[low], "low_j": medians[low]}
        yield found_between("inertia_of_recordings", facts, percent, DIFFERENT_INERTIA_PERCENT)


def _axis(recorded: Recorded) -> Axis:
    """Return how the joint's axis stands: as the settings state it; that of the virtual rig."""
    stated = recorded.settings.diagnostics.axis
    virtual = all(epoch.virtual for epoch in recorded.epochs)
    return "vertical" if stated == "unknown" and virtual else stated
