"""Which terms the torque holds beside J, B and K, and J, B and K beside them.

1. Every term is tested beside what is fitted (`score`), with Holm's adjustment over all.
2. Of those that are sure, the first by χ² and its rivals are settled: J, B, K, coefficients, inner
   parameters, instruments and the power S of the noise are iterated together (Gauss and Newton).
3. They are compared by what remains: the χ² that the instruments of all terms together explain of
   the residual, with the S of the best (Hansen's J).
4. The one that leaves least is accepted if it is large enough to matter. Then from 1 beside it.

Slopes by the inner parameters stay among the columns, so intervals hold that the form of a term is
not known: how late a reflex is, how slow the muscle, how sharp the friction.

J, B and K beside the terms are an answer where nothing that is linear remains in the torque's
response to the perturbation, or where it could change none of them by 1 %; else no number is one.

Where no perturbation was recorded the motion is its own instrument, and whatever the subject does
by the loop is linear. Terms that are not linear are then tested in what no free linear filter of
the motion explains, and come first; linear ones must explain most of the noise, and are told
without changing J, B and K; rivals are compared by the power of the residual.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidimeter.analysis.estimation import score as by
from rigidimeter.analysis.estimation import terms as of
from rigidimeter.analysis.estimation.checks import found as said
from rigidimeter.analysis.estimation.drive import passed
from rigidimeter.analysis.estimation.grid import SAME_TIME, Array, Complex
from rigidimeter.analysis.estimation.methods import DEPENDS, opened
from rigidimeter.analysis.estimation.observation import LEAST, Caused, Observation, torque_filter_of
from rigidimeter.analysis.estimation.score import EVERY, Part, Place, Score, real
from rigidimeter.analysis.estimation.signals import motion_channels, values_at, velocity_at
from rigidimeter.analysis.estimation.solve import Problem, Solution, noise_powers
from rigidimeter.analysis.estimation.terms import TERMS, Motion, Term
from rigidimeter.core.findings import UNKNOWN_EFFECT, Effect, Fact, Finding
from rigidimeter.core.records import PARAMETERS, Epoch
from rigidimeter.core.settings import DiagnosticsSettings, Settings
from rigidimeter.core.words import series

CHANCE, MOST_TERMS = 1e-3, 3
REMAINS, LITTLE, MUCH = 1e-3, 0.01, 0.1
"""J, B and K are withheld where p of what remains is below the first, unless it could change them
by less than the second. Without a perturbation it is told where it could change them by more than
the third: torque of the subject is in it too."""

LEAST_SHARE, LEAST_RANGE, LEAST_DELAY_S = 0.02, 0.10, 2e-4
LEAST_CUFF, MOST_CUFF, FURTHER, ALONE = 0.002, 0.3, 0.03, 1.0
"""How large a term must be: of the torque that the perturbation causes; of J, B or K where one
changes; a delay; K of the joint over that of a coupling. χ² of a further term, of the first's.
Without a perturbation a linear term must lower the logarithm of the noise by the last."""

RIVAL, RIVALS, CLEAR = 0.5, 4, 200.0
"""Rivals have so much of the χ² of the first, and are that many. One that is clearer than the last
and leaves nothing has none."""

ROUNDS, SETTLED, MOST_STEPS, ACTIVE = 8, 0.02, 10, 4
"""An inner parameter moves by so many of its steps at once, and is fitted if so many above its
lower bound."""

FEWEST_CYCLES, FASTEST_HZ, PERIODIC, PERIODIC_OF_ALL = 3, 2.0, 0.6, 0.25
"""An imposed movement has so many cycles in an epoch, so many a second at most, and such shares of
the power of the angle that the perturbation does not cause, and of all of it. A perturbation in the
loop reaches 0.5 of the first at its slowest line."""

STEADY = 0.3
"""In rad: a movement whose phase is so even is taken to be of one frequency."""

FAINT, MOVED = 0.01, 0.1
"""Of the window: what was simulated rings at its end. Power of the velocity that the perturbation
does not cause, over that which it causes: with less it moves no instrument."""

PLACES, INNER_TIME, INNER_ANGLE = 61, 0.8, (0.05, 0.95)
"""Where a parameter that changes is looked at: at the ends polynomials follow the noise."""

LEAST_ANGLE_RAD = np.radians(5.0)
"""Where the angle stays within, stiffness is not told by the angle: muscles are stiffer in the
first degrees from any posture."""

_LATE = ("delay", "cuff", "filter")
_ELASTIC = ("stiffness by side", "stiffness by angle", "K over phase")
NOT_BESIDE = {name: _LATE for name in _LATE} | {name: _ELASTIC for name in _ELASTIC}
"""What is no longer looked for beside a term that was found: one cause has one name."""

NONE = np.zeros(0)


class Taken(NamedTuple):
    """A term in the model, its inner parameters and coefficients (none before they are known)."""

    term: Term
    inner: Array = NONE
    values: Array = NONE

    @property
    def moving(self) -> NDArray[np.bool_]:
        """Which inner parameters are fitted beside the coefficients."""
        if self.term.bent is not None or not self.values.size or not self.inner.size:
            return np.zeros(self.inner.size, dtype=bool)
        return np.asarray(self.inner > self.term.low + ACTIVE * self.term.steps)

    def columns(self, motion: Motion) -> Complex:
        """Return its columns, then its slopes."""
        found = self.term.with_slopes(motion, self.inner, self.moving)
        if np.any(self.moving):
            found[1:] *= self.values[0]
        return found

    def moved(self, values: Array, steps: Array) -> tuple[Taken, float]:
        """Return it at new values, inner parameters moved, and by what share it changed."""
        inner, before = self.inner.copy(), self.inner if self.term.bent else self.values
        if self.term.bent is not None:
            inner[: values.size] += values
        elif self.values.size and inner.size:
            most = MOST_STEPS * self.term.steps[self.moving]
            inner[self.moving] += np.clip(steps, -most, most)
        inner = np.clip(inner, self.term.low, self.term.high) if inner.size else inner
        after = inner if self.term.bent else values
        if before.size != after.size:
            return Taken(self.term, inner, values), 1.0
        size = np.max(np.abs(after), initial=by.TINY)
        return Taken(self.term, inner, values), float(
            np.max(np.abs(after - before), initial=0.0) / size
        )


class State(NamedTuple):
    """Where the model is linearised: J, B, K, the power of the noise of every epoch, terms."""

    joint: Array
    powers: Sequence[Array]
    taken: tuple[Taken, ...] = ()

    @property
    def unlikely(self) -> float:
        """The logarithm of the noise, summed over lines and epochs."""
        return sum(float(np.sum(np.log(one))) for one in self.powers)

    def beside(self, *more: Taken) -> State:
        """Return it with more terms."""
        return self._replace(taken=(*self.taken, *more))


class Case(NamedTuple):
    """The epochs of a condition: what was measured, and whether perturbations are instruments.

    Where they are not, `instruments` are those of J, B and K, shape (m, 3) each.
    """

    observations: Sequence[Observation]
    measured: list[Motion]
    instruments: list[Complex]
    caused: bool


class Found(NamedTuple):
    """A term that is there.

    Attributes
    ----------
    term : Term
    p : float
        By Holm's method.
    size : float
        As a share of the torque, of J, B or K, or in s.
    values, half : array
        Coefficients, or the parameters of a term that bends the model; half their 95 % intervals.
    covariance : array
        Of the values.
    inner : array, shape (d,)
    """

    term: Term
    p: float
    size: float
    values: Array
    half: Array
    covariance: Array
    inner: Array


class Answer(NamedTuple):
    """J, B and K beside what was found.

    Attributes
    ----------
    joint, half, away : array, shape (3,)
        J, B, K, half their 95 % intervals, and what of these is neither noise nor the drive's: what
        low lines change where something remains, and half a tick where the drive is not known.
    covariance : array, shape (3, 3)
    found : tuple of Found
    remains, left : float
        p of what is linear and remains, NaN without a perturbation; its share of the torque, or
        without terms if they are not told.
    change : array, shape (3,)
        How J, B and K change where low lines count more.
    answered : bool
    little : frozenset of str
        Terms that are there and too small to matter.
    differs : bool
        Whether a term is not the same in all epochs.
    follows : float
        Without a perturbation p of anything linear beside J, B and K, NaN if they hardly hinge on
        the frequencies that count.
    case, state : Case, State
    better : bool
        Whether J, B and K beside the terms are to be preferred to those without.
    straight : Answer, optional
        Without a perturbation a linear term that was found beside these, and J, B and K beside it
        too: a subject who gives way looks like one, so it is told and changes none.
    """

    joint: Array
    half: Array
    away: Array
    covariance: Array
    found: tuple[Found, ...]
    remains: float
    left: float
    change: Array
    answered: bool
    little: frozenset[str]
    differs: bool
    follows: float
    case: Case
    state: State
    better: bool
    straight: Answer | None = None


def answer(solution: Solution, *, person: bool = True, most: int = MOST_TERMS) -> Answer:
    """Return what the torque of a condition holds, and J, B and K beside it.

    Parameters
    ----------
    solution : Solution
        J, B and K of all epochs together.
    person : bool
        Whether one is on the axis; without, no reflex is looked for.
    most : int
        Terms that are looked for.
    """
    state = State(solution.values, list(solution.powers))
    case = with_phases(case_of(solution.problems), state)
    if not case.caused and case.measured[0].phase is not None:
        state = _also(case, state, of.MOVEMENT)
    offered = [one for one in TERMS if _offered(case, one, person)]
    found: list[tuple[Term, float, float]] = []
    nameless: Score | None = None
    straight: Answer | None = None
    little: set[str] = set()
    strongest = 0.0
    while True:
        tested = _tested(case, state, offered)
        names = [one.name for one in offered]
        p = dict(zip(names, by.holm([tested.scores[one].p for one in names]), strict=True))
        nameless = nameless or tested.scores[of.ANY_LINEAR.name]
        if len(found) == most:
            break
        sure = [one for one in offered if p[one.name] < CHANCE]
        if not case.caused and any(not one.linear for one in sure):
            sure = [one for one in sure if not one.linear]
        # A free filter holds any drive.
        named = {one.name: tested.model.tested[one.name] for one in sure
                 if case.caused or one.linear}  # fmt: skip
        others = [*_other_drives(case, state, tested.model, named)][1:] if named else []
        for _, other in others:
            sure = [one for one in sure if len(names) * other.get(one.name, 0.0) < CHANCE]
        gains = _gains(case, state, tested, sure)
        strongest = strongest or max((gain for gain, _ in gains.values()), default=0.0)
        # The gain of a coupling is that of a straight column, and it bends.
        sure = [one for one in sure if one.name in gains
                and (one.name == "cuff" or gains[one.name][0] > FURTHER * strongest)]  # fmt: skip
        chosen = _chosen(case, state, tested, sure, gains, little)
        if chosen is None:
            break
        new, size = chosen
        term = new.taken[-1].term
        entry = term, p[of.DELAY.name if term is of.FILTER else term.name], size
        if term.linear and not case.caused:
            beyond = _tested(case, new, [])
            straight = _answered(case, new, beyond, [*found, entry], nameless, little)
            break
        state = new
        found.append(entry)
        if term.name in of.FINER:
            state = _also(case, state, of.FINER[term.name])
        gone = {term.name, *NOT_BESIDE.get(term.name, ())}
        offered = [one for one in offered if one.name not in gone]
    made = _answered(case, state, tested, found, nameless, little)
    if straight is None:
        return made
    straight = straight._replace(found=straight.found[-1:], follows=np.nan)
    return made._replace(straight=straight, follows=np.nan)


def case_of(problems: Sequence[Problem]) -> Case:
    """Return what is known of epochs, whatever J, B and K."""
    measured = []
    for one in problems:
        seen, grid = one.observation, one.observation.grid
        channel = seen.epoch.channels["torque_nm"]
        torque = grid.lines(values_at(channel, grid.time_s, SAME_TIME), 2).T
        # Where the torque of an observation was made earlier, its lines alone were turned.
        torque = torque * (one.target / torque[:, 0])[:, None]
        through = passed(torque_filter_of(seen.settings), grid.omega_rad_s)
        velocity, angle = seen.coarse
        motion = Motion(grid, velocity, angle, one.regressors, torque, np.zeros(3), through)
        every = velocity_at(seen.epoch, grid.time_s)
        measured.append(motion._replace(unseen=-seen.changes[0], every=every))
    observations = [one.observation for one in problems]
    caused = all(one.cause is not None for one in observations)
    return Case(observations, measured, [one.instruments for one in problems], caused)


def with_phases(case: Case, state: State) -> Case:
    """Return the case with the phase of an imposed movement, 0 where the angle is highest.

    That is a motion at one slow frequency in every epoch which the perturbation does not cause.
    """
    found = []
    for own, cause in zip(case.measured, caused_motions(case, state.joint), strict=True):
        w, n, rest = own.grid.coarse_window[0], own.angle.size, own.angle
        if case.caused:
            x = (cause.angle - cause.angle.mean()) * w
            rest = rest - cause.angle * float((own.angle * w) @ x / (x @ x))
        power, whole = (np.abs(np.fft.rfft((x - x.mean()) * w)) ** 2 for x in (rest, own.angle))
        last = int(min(FASTEST_HZ * own.grid.duration_s, n // 2 - 3))
        if last <= FEWEST_CYCLES:
            return case
        peak = FEWEST_CYCLES + int(np.argmax(power[FEWEST_CYCLES : last + 1]))
        near = np.arange(peak - 2, peak + 3)
        if power[near].sum() < max(PERIODIC * power[1:].sum(), PERIODIC_OF_ALL * whole.sum()):
            return case
        line = float(power[near] @ near / power[near].sum())
        # Mirrored at the end, so that no whole number of cycles leaves a step there.
        spectrum = np.fft.fft(np.concatenate([rest, rest[::-1]]))
        spectrum *= np.exp(-4.5 * ((np.arange(2 * n) / 2 - line) / line) ** 2)
        phase, at = np.unwrap(np.angle(np.fft.ifft(spectrum)[:n])), np.arange(n)
        steady = np.polyval(np.polyfit(at, phase, 1, w=w), at)
        even = np.sqrt((phase - steady) ** 2 @ w / w.sum()) < STEADY
        found.append(own._replace(phase=np.asarray(steady if even else phase, float)))
    return case._replace(measured=found)


def _offered(case: Case, term: Term, person: bool) -> bool:
    several, phase = len(case.observations) > 1, case.measured[0].phase is not None
    # Jumps of a term need the motion at each sample of the torque.
    every = case.caused or all(_keeps_step(one.epoch) for one in case.observations)
    return (
        term.tested
        and (person or not term.muscle)
        and (every or not term.itself)
        and (phase or term.finding != "varying_with_phase")
        and (several or term.parameter is None)
        and (case.caused or term.name[:2] not in ("J ", "B "))
    )


def _keeps_step(epoch: Epoch) -> bool:
    """Return whether the motion was sampled as often as the torque."""
    slowest_hz = min(one.mean_rate_hz for one in motion_channels(epoch))
    return slowest_hz > 0.99 * epoch.channels["torque_nm"].mean_rate_hz


# --- The lines of a state


class Model(NamedTuple):
    """The columns of a state.

    Attributes
    ----------
    parts : list of Part
    base : list of Place
        Of what is fitted.
    of_terms, of_slopes : list of slice
        Where those of each term, and of its slopes, are in the base.
    tested : dict
        The places of what is tested, by name.
    """

    parts: list[Part]
    base: list[Place]
    of_terms: list[slice]
    of_slopes: list[slice]
    tested: dict[str, list[Place]]


Tested = Sequence[tuple[Term, Array]]


def _rows(motion: Motion, state: State, tested: Tested) -> list[Complex]:
    """Return the lines of torque, of J, B, K, and the columns of each term."""
    motion = motion._replace(joint=state.joint)
    for one in state.taken:
        motion = one.term.bent(motion, one.inner) if one.term.bent is not None else motion
    own = [one.columns(motion) for one in state.taken]
    own += [term.seen(motion, inner) for term, inner in tested]
    return [motion.torque[None, :, 0], motion.lines.T, *own]


def _beside(own: Motion, caused: Array) -> Array | None:
    """Return the motion that a perturbation does not cause; None where it is little."""
    w = own.grid.coarse_window[0]
    rest = np.stack([own.velocity, own.angle]) - caused
    rest -= (rest @ w / w.sum())[:, None]
    return rest if rest[0] ** 2 @ w > MOVED * (caused[0] ** 2 @ w) else None


def caused_motions(case: Case, joint: Array) -> list[Motion]:
    """Return what the perturbations cause; epochs that share one share the object."""
    if not case.caused:
        return case.measured
    causes: dict[int, Caused] = {}
    made: dict[tuple[int, int], Motion] = {}
    found = []
    for one, own in zip(case.observations, case.measured, strict=True):
        assert one.cause is not None
        caused, s = causes.get(id(one.cause)) or one.cause.at(joint), 1j * one.grid.omega_rad_s
        causes[id(one.cause)] = caused
        coarse = caused.coarse * (one.grid.coarse_window[0] > FAINT)
        beside = _beside(own, coarse)
        key = id(one.cause), id(own.phase if beside is None else beside)
        if key not in made:
            lines = one.of_lines(caused.lines)
            torque = (lines @ joint)[:, None] * np.stack([s**0, s, s * s], axis=1)
            made[key] = own._replace(
                velocity=coarse[0], angle=coarse[1], lines=lines, torque=torque, measured=False,
                unseen=0.0, every=NONE, beside=beside,
            )  # fmt: skip
        found.append(made[key])
    return found


def _instruments(case: Case, state: State, tested: Tested, last: int = 0) -> list[Complex]:
    """Return the whitened instruments of each epoch; epochs that share them share the object.

    With `last` only so many from the end.
    """
    made: dict[int, Complex] = {}
    motions = caused_motions(case, state.joint)
    for one, motion, power in zip(case.observations, motions, state.powers, strict=True):
        if id(motion) not in made:
            weight = (one.excited if case.caused else 1.0) / np.sqrt(power)
            made[id(motion)] = np.concatenate(_rows(motion, state, tested)[1:])[-last:] * weight
    return [made[id(motion)] for motion in motions]


def model_of(case: Case, state: State, tested: Tested = (), free: bool = False) -> Model:
    """Return the model of a state; `free`: beside a free linear filter in place of J, B and K."""
    rows = [_rows(one, state, tested) for one in case.measured]
    base: list[Place] = [] if free else [(j, EVERY) for j in range(3)]
    epochs, column = range(len(case.observations)), 3
    model = Model([], base, [], [], {})
    itself: list[int] = []
    moving = [int(np.sum(one.moving)) for one in state.taken] + [0] * len(tested)
    terms = [*(one.term for one in state.taken), *(term for term, _ in tested)]
    for i, (term, slopes, own) in enumerate(zip(terms, moving, rows[0][2:], strict=True)):
        stop = column + len(own)
        places = [(c, e) for e in (epochs if term.own else (EVERY,))
                  for c in range(column, stop - slopes)]  # fmt: skip
        if term.parameter is not None:
            places = [(term.parameter, e) for e in epochs[:-1]]
        if i < len(state.taken):
            model.of_terms.append(slice(len(base), len(base) + len(places)))
            base += places
            model.of_slopes.append(slice(len(base), len(base) + slopes))
            base += [(c, EVERY) for c in range(stop - slopes, stop)]
            itself += range(stop - slopes, stop) if term.itself else ()
        else:
            model.tested[term.name] = places
        column = stop
    causes = _instruments(case, state, tested) if case.caused else case.instruments
    for e, (lines, power) in enumerate(zip(rows, state.powers, strict=True)):
        grid, whole = case.measured[e].grid, np.concatenate(lines)
        whole = by.without_filter(grid, whole) if free else whole / np.sqrt(power)
        C: Complex = whole[1:]
        D = C
        if case.caused:
            D = causes[e]
            if itself:
                D = D.copy()
                D[itself] = C[itself]
        elif not free:
            D = np.concatenate([causes[e].T / np.sqrt(power), C[3:]])
        model.parts.append(Part(grid, D, C, whole[0]))
    return model


def settled(case: Case, state: State, rounds: int = ROUNDS) -> State:
    """Iterate J, B, K, coefficients, inner parameters, instruments and the power of the noise.

    Raises
    ------
    ValueError
        If the columns cannot be told apart.
    """
    for _ in range(rounds):
        model = model_of(case, state)
        fit = by.fitted(model.parts, model.base)
        each = zip(case.measured, fit.left, state.powers, case.observations, strict=True)
        none = [m.lines[:, :0] for m in case.measured]
        problems = [
            Problem(no, no, left * np.sqrt(power), one)
            for no, (_, left, power, one) in zip(none, each, strict=True)
        ]
        moved = [
            one.moved(fit.values[own], fit.values[slopes])
            for one, own, slopes in zip(state.taken, model.of_terms, model.of_slopes, strict=True)
        ]
        scale = np.sqrt(np.abs(np.diag(fit.inverse)[:3]) / 2)
        step = float(np.max(np.abs(fit.values[:3] - state.joint) / scale))
        powers = noise_powers(problems, NONE)
        state = State(fit.values[:3], powers, tuple(one for one, _ in moved))
        if max([step, *(share for _, share in moved)]) < SETTLED:
            break
    return state


def _also(case: Case, state: State, term: Term) -> State:
    """Return the state with a term that is not tested, or without where it cannot be told apart."""
    try:
        return settled(case, state.beside(Taken(term)))
    except ValueError:
        return state


# --- Which term


class _Tested(NamedTuple):
    """What is tested beside a state, and the scores."""

    fit: by.Fitted
    model: Model
    scores: dict[str, Score]


def _tested(case: Case, state: State, terms: Sequence[Term]) -> _Tested:
    tested = [(one, one.first) for one in (*terms, of.ANY_LINEAR)]
    model = model_of(case, state, tested)
    fit, scores = _scores(model, model.tested)
    if not case.caused:
        free = model_of(case, state, tested, free=True)
        bent = {one.name: free.tested[one.name] for one in terms if not one.linear}
        scores |= _scores(free, bent)[1]
    return _Tested(fit, model, scores)


def _scores(model: Model, tested: dict[str, list[Place]]) -> tuple[by.Fitted, dict[str, Score]]:
    fit = by.fitted(model.parts, model.base, [p for own in tested.values() for p in own])
    blocks = fit.blocks() if tested else []
    return fit, {name: fit.score(blocks, own) for name, own in tested.items()}


def _gains(
    case: Case, state: State, tested: _Tested, sure: Sequence[Term]
) -> dict[str, tuple[float, Array]]:
    """Return what each explains beyond twice its columns, and the best inner parameters."""
    found = {}
    for term in sure:
        one = tested.scores[term.name]
        gain, inner = one.explained - 2 * len(tested.model.tested[term.name]), term.first[0]
        resists = not term.resists or one.values[0] > 0
        if len(term.inner) > 1:
            looked = _instruments(case, state, [(term, term.inner)], len(term.inner))
            each = by.explained(looked, tested.fit)
            each = each if term.resists else np.abs(each)
            gain, inner = float(np.max(each)) - 4, term.inner[int(np.argmax(each))]
            resists = gain > 0
        if resists:
            found[term.name] = gain, inner
    return found


def _chosen(
    case: Case,
    state: State,
    tested: _Tested,
    sure: Sequence[Term],
    gains: dict[str, tuple[float, Array]],
    little: set[str],
) -> tuple[State, float] | None:
    """Return the state with the term that leaves least of those that matter, and its size.

    Those that do not matter are added to `little`.
    """
    ranked = sorted(sure, key=lambda term: -gains[term.name][0])
    first = gains[ranked[0].name][0] if ranked else 0.0
    rivals = [one for one in ranked[:RIVALS] if gains[one.name][0] >= RIVAL * first]
    if any(_linear(one) for one in rivals):
        rivals += [one for one in ranked if one.name in _LATE and one not in rivals]
        rivals += [of.FILTER] if of.DELAY.name in tested.scores else []
    found: list[tuple[State, float]] = []
    for term in [*rivals, *(one for one in ranked if one not in rivals)]:
        if found and term not in rivals:
            break
        try:
            new = _with(case, state, term, gains.get(term.name, (0.0, term.first[0]))[1])
        except ValueError:
            continue
        size, least = size_of(case, new)
        if term.resists and term.bent is None and new.taken[-1].values[0] <= 0:
            continue
        clear = state.unlikely - new.unlikely > ALONE * sum(one.size for one in new.powers)
        if size < least:
            little.add(term.name)
        if size < least or (term.linear and not (case.caused or clear)):
            continue
        found.append((new, size))
        if len(found) == 1 and first > CLEAR and case.caused and not term.linear:
            remains, dimension = _remains(case, new, tested, new.powers)
            if remains < dimension + 4 * np.sqrt(2 * dimension):
                break
    if len(found) < 2:
        return found[0] if found else None
    best = min((new for new, _ in found), key=lambda one: one.unlikely).powers
    if not case.caused:
        return min(found, key=lambda one: one[0].unlikely)
    return min(found, key=lambda one: _remains(case, one[0], tested, best)[0])


def _with(case: Case, state: State, term: Term, inner: Array) -> State:
    """Return the state settled with one more term.

    A coupling bends the model far. With M (1 + λs) + c (J s² + B s + K) M = (1 + λs) (J s² + B s +
    K) θ the torque is linear in θ and three derivatives, and in two of its own; instruments are so
    many of the caused angle. There the search begins.
    """
    if term.name == "cuff":
        gram, moment = np.zeros((6, 6)), np.zeros(6)
        motions = caused_motions(case, state.joint)
        for own, cause, power in zip(case.measured, motions, state.powers, strict=True):
            s, moved = 1j * own.grid.omega_rad_s, (own.lines - own.unseen).T
            columns = np.stack([*moved[::-1], s * moved[0], *-own.torque.T[1:]])
            looked = cause.lines[:, 2] * s ** np.arange(6)[:, None] if case.caused else columns
            both = np.concatenate([columns, own.torque[None, :, 0]])
            found = real(looked / np.sqrt(power), both / np.sqrt(power))
            gram, moment = gram + found[:, :-1], moment + found[:, -1]
        rows = np.abs(gram).max(axis=1)
        K, B, J, third, _, second = np.linalg.solve(gram / rows[:, None], moment / rows)
        c, lag_s = max(second / J, 1e-6), float(np.clip(third / J, 0.0, 0.01))
        joint = np.array([J - lag_s * B, B - lag_s * K, K]) / max(1 - c * K, 0.1)
        state, inner = state._replace(joint=joint), np.array([c, lag_s])
    return settled(case, state.beside(Taken(term, inner)))


def _remains(
    case: Case, state: State, tested: _Tested, powers: Sequence[Array]
) -> tuple[float, float]:
    """Return the χ² of the instruments of all terms in what a state leaves, and how many."""
    model = model_of(case, state._replace(powers=powers))
    left = by.fitted(model.parts, model.base).left
    g: Array = np.zeros(())
    own: Array = np.zeros(())
    for one, e in zip(tested.fit.parts, left, strict=True):
        D = one.instruments
        g, own = g + real(D, e[None])[:, 0], own + real(D, D)
    return by.quadratic(g, own) + len(model.base), float(len(g))


# --- How large


def size_of(case: Case, state: State) -> tuple[float, float]:
    """Return how large the last term is, and how large it must be."""
    taken = state.taken[-1]
    term = taken.term
    if term.name == "cuff":
        size = float(taken.inner[0] * state.joint[2])
        likely = size < MOST_CUFF and taken.inner[1] < term.high[1]
        return (size if likely else 0.0), LEAST_CUFF
    if term.bent is not None:
        return abs(float(taken.inner[0])), LEAST_DELAY_S
    if term.finding.startswith("varying"):
        goes = [(state.joint[j], functions @ values)
                for j, functions, values, _ in courses(case, *taken)]  # fmt: skip
        return max(float(np.ptp(one) / np.abs(at + np.mean(one))) for at, one in goes), LEAST_RANGE
    own = whole = 0.0
    for motion, power in zip(caused_motions(case, state.joint), state.powers, strict=True):
        part = taken.values @ term.columns(motion, taken.inner[None])
        whole += float(np.sum(np.abs(motion.lines @ state.joint) ** 2 / power))
        own += float(np.sum(np.abs(part) ** 2 / power))
    return float(np.sqrt(own / whole)), LEAST_SHARE


def courses(
    case: Case, term: Term, inner: Array, values: Array
) -> list[tuple[int, Array, Array, list[str]]]:
    """Return how J, B or K goes, in each epoch or once: which, functions, coefficients, places.

    The change of the parameter at the places is functions @ coefficients.
    """
    labels = [one.epoch.label for one in case.observations]
    if term.parameter is not None:
        return [(term.parameter, np.eye(len(labels))[:, :-1], values, labels)]
    x, j = np.linspace(-INNER_TIME, INNER_TIME, PLACES), "JBK".find(term.name[0])
    if term.finding == "varying_with_time":
        times_s = [one.grid.time_s[0] + (x + 1) / 2 * one.grid.duration_s
                   for one in case.observations]  # fmt: skip
        each = zip(values.reshape(len(labels), -1), times_s, strict=True)
        return [(j, of.over_time(x).T, own, [f"{t:.1f} s" for t in at_s]) for own, at_s in each]
    if term.finding == "varying_with_phase":
        x = np.linspace(0, 2 * np.pi, PLACES)
        return [(j, of.over_phase(x).T, values, [f"{t:.0f}°" for t in np.degrees(x)])]
    angle = np.concatenate([m.angle for m in case.measured])
    low, high = np.quantile(angle, INNER_ANGLE).tolist()
    x = np.linspace(low, high, PLACES)
    at = [f"{t:+.1f}° from the mean" for t in np.degrees(x)]
    by_side = term.name == "stiffness by side"
    slopes = [np.tanh((x - inner[1]) / inner[0])] if by_side else [2 * x, 3 * x**2]
    return [(2, np.stack(slopes, axis=1), values, at)]


# --- The answer


def _answered(
    case: Case,
    state: State,
    tested: _Tested,
    found: Sequence[tuple[Term, float, float]],
    nameless: Score,
    little: set[str],
) -> Answer:
    model, fit = tested.model, tested.fit
    covariance, half_of_all = fit.uncertain(fit.blocks())
    mean = np.eye(len(model.base))[:3]
    for one, own in zip(state.taken, model.of_terms, strict=True):
        if one.term.parameter is not None:
            mean[one.term.parameter, own] = 1 / len(case.observations)
    joint, of_joint = mean @ fit.values, mean @ covariance @ mean.T
    half = half_of_all[:3] * np.sqrt(np.diag(of_joint) / np.diag(covariance)[:3])
    linear, name = tested.scores[of.ANY_LINEAR.name], of.ANY_LINEAR.name
    lines = {name: model.tested[name]} if case.caused and linear.p < REMAINS else {}
    others = [*_other_drives(case, state, model, lines)]
    without, *moved = [np.abs(one.values - fit.values)[:3] for one, _ in others]
    most = np.max([np.zeros(3), *moved], axis=0)
    depends = most > DEPENDS * np.abs(joint)
    half = half + np.where(depends, np.maximum(most, 2 * without), most)
    remains, change = np.nan, np.zeros(3)

    if case.caused:
        # What another drive explains is not of the joint.
        remains = max([linear.p, *(p for _, one in others[1:] for p in one.values())])
        change = _otherwise(model, fit.values)
    # A linear term beside which something linear remains has not its name.
    named = {one[0].name: one for one in found if not remains < REMAINS or not _linear(one[0])}
    plain = linear if len(named) == len(found) or not case.caused else nameless
    follows = np.nan
    if not case.caused and np.max(np.abs(_otherwise(model, fit.values) / joint)) > MUCH:
        plain = _follows(case, state, tested) or plain
        follows = plain.p
    left = float(np.sqrt(2 * np.mean(plain.values**2)))
    harmless = np.max(np.abs(change / joint)) < LITTLE and len(named) == len(found)
    answered = bool(remains >= REMAINS or not case.caused or harmless)
    away = np.abs(change) if remains < REMAINS else np.zeros(3)
    known = all(one.drive_known for one in case.observations)
    if not known and any(one.name in _LATE for one, *_ in found):
        # The motion itself may be half a tick late.
        late_s = 0.5 / case.observations[0].settings.rig.tick_rate_hz
        away = away + late_s * np.append(np.abs(joint[1:]), 0.0)
    told = []
    for one, own in zip(state.taken, model.of_terms, strict=True):
        if one.term.name not in named:
            continue
        values = one.inner[: own.stop - own.start] if one.term.bent else fit.values[own]
        errors = half_of_all[own], covariance[own, own]
        told.append(Found(*named[one.term.name], values, *errors, one.inner))
    return Answer(
        joint, half + away, away, of_joint, tuple(told), remains, left, change, answered,
        frozenset(little), _differs(state, model), follows, case, state, answered and bool(told),
    )  # fmt: skip


def _follows(case: Case, state: State, tested: _Tested) -> Score | None:
    """Return the score of anything linear without a perturbation; None where no loop is known.

    What is left comes back by the loop as motion: that is taken from the motion.
    """
    places, parts = tested.model.tested[of.ANY_LINEAR.name], []
    columns = [column for column, _ in places]
    each = zip(case.observations, case.measured, tested.model.parts, tested.fit.left, state.powers,
               strict=True)  # fmt: skip
    for one, motion, part, left, power in each:
        if one.loop is None:
            return None
        back = opened(one).motion_per_torque(np.maximum(state.joint, LEAST).tolist())
        rest = motion.lines - (back * left * np.sqrt(power)).T
        looked = part.instruments.copy()
        alone = motion._replace(lines=rest, joint=state.joint)
        looked[:3], looked[columns] = (
            lines / np.sqrt(power) for lines in (rest.T, of.any_linear(alone, NONE))
        )
        parts.append(part._replace(instruments=looked))
    name = of.ANY_LINEAR.name
    return _scores(tested.model._replace(parts=parts), {name: places})[1][name]


def _linear(term: Term) -> bool:
    """Return whether it is one answer of the torque to the motion, the same at any time."""
    return term.linear and term.parameter is None


def _other_drives(
    case: Case, state: State, model: Model, tested: dict[str, list[Place]]
) -> Iterator[tuple[by.Fitted, dict[str, float]]]:
    """Return what is fitted, and p of what is tested: without a drive, then with others."""
    looked = [place for own in tested.values() for place in own]
    rows = sorted({c for c, _ in (*model.base, *looked)} | {0, 1, 2})
    at = {c: i for i, c in enumerate(rows)}
    base = [(at[c], e) for c, e in model.base]
    tested = {name: [(at[c], e) for c, e in own] for name, own in tested.items()}
    made = {id(one.instruments): one.instruments[rows] for one in model.parts}
    for k in range(max(len(one.changes) for one in case.observations)):
        parts = []
        for one, part, power in zip(case.observations, model.parts, state.powers, strict=True):
            columns = part.columns[rows]
            if k < len(one.changes):
                columns[:3] += one.changes[k].T / np.sqrt(power)
            looked_at = made[id(part.instruments)]
            parts.append(part._replace(columns=columns, instruments=looked_at))
        fit, scores = _scores(model._replace(parts=parts, base=base), tested)
        yield fit, {name: one.p for name, one in scores.items()}


def _otherwise(model: Model, values: Array) -> Array:
    """Return how J, B and K change where lines count the less the higher they are."""
    parts = [
        one._replace(instruments=one.instruments * one.grid.omega_rad_s[0] / one.grid.omega_rad_s)
        for one in model.parts
    ]
    try:
        return np.asarray((by.fitted(parts, model.base).values - values)[:3])
    except ValueError:  # low lines do not tell the terms apart
        return np.full(3, np.nan)


def _differs(state: State, model: Model) -> bool:
    """Return whether coefficients of a term that all epochs share are not those of each."""
    looked = {
        one.term.name: [(c, e) for c, _ in model.base[own] for e in range(len(model.parts) - 1)]
        for one, own in zip(state.taken, model.of_terms, strict=True)
        if not one.term.own and one.term.parameter is None
    }
    if len(model.parts) < 2 or not looked:
        return False
    return any(one.p < CHANCE for one in _scores(model, looked)[1].values())


# --- What is told


def beside(found: Answer) -> list[Problem]:
    """Return the problems of J, B and K with the torque of the terms taken from their targets."""
    model = model_of(found.case, found.state)
    values = by.fitted(model.parts, model.base).values
    problems = []
    for e, (observation, part) in enumerate(zip(found.case.observations, model.parts, strict=True)):
        of_terms = [
            value * part.columns[column]
            for (column, epoch), value in zip(model.base, values, strict=True)
            if column > 2 and epoch in (EVERY, e)
        ]
        scale = np.sqrt(found.state.powers[e])
        problems.append(
            Problem(
                (part.instruments[:3] * scale).T,
                (part.columns[:3] * scale).T,
                (part.target - np.sum(of_terms, axis=0)) * scale,
                observation,
            )
        )
    return problems


def findings_of(
    found: Answer, settings: Settings, shown: tuple[Array, Array] | None = None
) -> tuple[Finding, ...]:
    """Return the findings of an answer, one for each kind.

    What was answered is a note where J, B and K beside it stand in the fit, and nothing that is
    linear remains. Where something does, a fit is withheld.

    Parameters
    ----------
    found : Answer
    settings : Settings
    shown : tuple of array, optional
        J, B and K that are given and half their intervals, where they are not those beside the
        terms.
    """
    limits, told = settings.diagnostics, []
    tested = bool(np.isfinite(found.remains))
    kinds = [_kind(one.term, found.case) for one in found.found]
    for kind in dict.fromkeys(kinds):
        own = [one for one, its in zip(found.found, kinds, strict=True) if its == kind]
        if kind == "varying_between_epochs":
            continue  # told with the fits of single epochs
        values, half = shown or (_without(found, {one.term.name for one in own}), found.half)
        added = values - found.joint
        value, limit, facts, variant = _told(kind, own, added / half, found, limits)
        how = "" if shown else "answered" if tested else "beside"
        if not found.answered:
            how = "withheld"
        effect = Effect.of(added, values, half)
        told.append(
            said(
                kind, limits, value, limit, p=max(one.p for one in own),
                variant=f"{variant} {how}".strip() if how in ("beside", "withheld") else variant,
                effect=UNKNOWN_EFFECT if how == "withheld" else effect,
                facts={**facts, "remains": found.remains},
                harmless=how if how == "answered" else "",
                excludes=how == "withheld",
            )
        )  # fmt: skip
    percent, most = 100 * found.left, limits.max_lack_of_fit_percent
    p = found.remains if tested else found.follows
    if p < REMAINS and percent > most and (found.answered or not found.found):
        low_hz, high_hz = found.case.measured[0].grid.band_hz
        change = (100 * found.change / found.joint).tolist()
        facts = {f"half_{symbol}": one for symbol, one in zip("JBK", change, strict=True)}
        facts |= {"low_hz": low_hz, "high_hz": high_hz}
        told.append(
            said(
                "lack_of_fit", limits, percent, most, p=p, facts=facts,
                variant="" if tested else "motion",
                harmless="answered" if tested and found.answered else "",
            )
        )  # fmt: skip
    return tuple(told)


def _without(found: Answer, names: set[str]) -> Array:
    """Return J, B and K if these terms are left out; NaN where what is left does not settle."""
    state = found.state
    rest = tuple(one for one in state.taken if one.term.name.removesuffix(", finer") not in names)
    try:
        return settled(found.case, state._replace(taken=rest), 3).joint
    except ValueError:
        return np.full(3, np.nan)


def _kind(term: Term, case: Case) -> str:
    """Return the kind of a term's finding: within a small range the angle is not what counts."""
    if term.finding == "varying_with_angle":
        angle = np.concatenate([one.angle for one in case.measured])
        if np.ptp(np.quantile(angle, INNER_ANGLE)) < LEAST_ANGLE_RAD:
            return "missing_term"
    return term.finding


def _told(
    kind: str, own: Sequence[Found], halves: Array, found: Answer, limits: DiagnosticsSettings
) -> tuple[float, float, dict[str, Fact], str]:
    """Return value, limit, facts and variant of a kind's finding."""
    first, facts = own[0], dict[str, Fact]()
    if kind == "torque_delay":
        share = np.sqrt(2) if first.term.name == "filter" else 1.0
        late_ms, half_ms = (1e3 * share * float(one[0]) for one in (first.values, first.half))
        facts = {"late_ms": late_ms, "half_ms": half_ms, "terms": first.term.label}
        return abs(late_ms), 1e3 * LEAST_DELAY_S, facts, ""
    if kind.startswith("varying"):
        ranges = sorted((_range(one, found) for one in own), key=lambda one: -one[0])
        others = series([str(one["symbol"]) for _, one in ranges[1:]])
        does = "do" if len(ranges) > 2 else "does"
        facts = {**ranges[0][1], "others": f"; so {does} {others}" if others else ""}
        return ranges[0][0], limits.max_varying_percent, facts, ""
    asked = ["inertia", "damping", "stiffness"]
    for one in own:
        slow = one.term.muscle and one.inner[1] > 0
        more = "reflex-second-order" if slow else "reflex"
        asked += [one.term.asked.replace("reflex", more)] if one.term.asked else []
    # The whole and its two halves are one too many.
    asked = [one for one in asked if f"directional-{one}" not in asked]
    sizes = []
    for one in own:
        late = f" {1e3 * one.inner[0]:.0f} ms late" if one.term.muscle else ""
        size = f"{one.values[0]:.3g} ± {one.half[0]:.2g} {one.term.unit}"
        sizes.append(f"{one.term.label} of {size}{late}")
    facts = {
        "terms": series([one.term.label for one in own]), "sizes": series(sizes),
        "asked": ",".join(asked), "size": float(first.values[0]), "share": 100 * first.size,
    }  # fmt: skip
    if first.term.muscle:
        facts["late_ms"] = 1e3 * float(first.inner[0])
    variant = "several" if len(own) > 1 else ""
    if first.term.name == "cuff" and not variant:
        variant, facts["size"] = "coupling", 1 / float(first.values[0])
    return 100 * float(np.max(np.abs(halves))), 100.0, facts, variant


def _range(one: Found, found: Answer) -> tuple[float, dict[str, Fact]]:
    """Return from where to where a parameter goes, in % of its mean, and what is shown of it."""
    best: tuple[float, dict[str, Fact]] = (0.0, {})
    column = 0
    for j, functions, values, at in courses(found.case, one.term, one.inner, one.values):
        within = slice(column, column + values.size)
        column += values.size
        goes = found.joint[j] + functions @ values
        spread = np.einsum("gi,ij,gj->g", functions, one.covariance[within, within], functions)
        half = 1.96 * np.sqrt(spread + found.covariance[j, j])
        low, high = int(np.argmin(goes)), int(np.argmax(goes))
        percent = 200 * float(np.ptp(goes) / np.abs(goes[low] + goes[high]))
        if percent > best[0]:
            best = percent, {
                "symbol": PARAMETERS[j].symbol, "size_unit": PARAMETERS[j].unit,
                "low": float(goes[low]), "low_half": float(half[low]), "low_at": at[low],
                "high": float(goes[high]), "high_half": float(half[high]), "high_at": at[high],
            }  # fmt: skip
    return best
