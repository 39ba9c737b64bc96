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
the motion explains; linear ones must be larger; rivals are compared by the power of the residual.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidimeter.analysis.estimate_anew.checks import found as said
from rigidimeter.analysis.estimate_anew.grid import SAME_TIME, Array, Complex
from rigidimeter.analysis.estimate_anew.observation import Observation, torque_filter_of
from rigidimeter.analysis.estimate_anew.score import (
    EVERY,
    Part,
    Place,
    Score,
    Sums,
    blocks,
    explained,
    fitted,
    free_filter,
    holm,
    real,
    residuals,
    score,
    solved,
    sums_of,
)
from rigidimeter.analysis.estimate_anew.signals import values_at, velocity_at
from rigidimeter.analysis.estimate_anew.solve import Problem, Solution, noise_powers
from rigidimeter.analysis.estimate_anew.terms import (
    ANY_LINEAR,
    FILTER,
    FINER,
    MOVEMENT,
    TERMS,
    Motion,
    Term,
    over_phase,
    over_time,
)
from rigidimeter.core.findings import Effect, Fact, Finding
from rigidimeter.core.records import PARAMETERS
from rigidimeter.core.settings import DiagnosticsSettings, Settings
from rigidimeter.model import lowpass

CHANCE, MOST_TERMS = 1e-3, 3
REMAINS, LITTLE = 1e-3, 0.01
"""J, B and K are withheld where p of what remains is below the first, unless it could change them
by less than the second."""

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

FAINT = 0.01
"""Of the window: what was simulated rings at its end."""

JOINT: tuple[Place, ...] = ((0, EVERY), (1, EVERY), (2, EVERY))
_LATE = ("delay", "cuff", "filter")
_ELASTIC = ("stiffness by side", "stiffness by angle", "K over phase")
NOT_BESIDE = {name: _LATE for name in _LATE} | {name: _ELASTIC for name in _ELASTIC}
"""What is no longer looked for beside a term that was found."""

PLACES, INNER_TIME, INNER_ANGLE = 61, 0.8, (0.05, 0.95)
"""Where a parameter that changes is looked at: at the ends polynomials follow the noise."""


class Taken(NamedTuple):
    """A term in the model, its inner parameters and coefficients (none before they are known)."""

    term: Term
    inner: Array
    values: Array = np.zeros(0)

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


class State(NamedTuple):
    """Where the model is linearised: J, B, K, the power of the noise of every epoch, terms."""

    joint: Array
    powers: Sequence[Array]
    taken: tuple[Taken, ...] = ()

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
    values, half : array
        Coefficients, or the parameters of a term that bends the model; half their 95 % intervals.
    covariance : array
        Of the values.
    inner, inner_half : array, shape (d,)
        NaN where it was not fitted.
    size : float
        As a share of the torque, of J, B or K, or in s.
    effect : array, shape (3,)
        What leaving it out adds to J, B and K.
    """

    term: Term
    p: float
    values: Array
    half: Array
    covariance: Array
    inner: Array
    inner_half: Array
    size: float
    effect: Array


class Answer(NamedTuple):
    """J, B and K beside what was found.

    Attributes
    ----------
    joint, half, degrees : array, shape (3,)
        J, B, K, half their 95 % intervals, and degrees of freedom.
    covariance : array, shape (3, 3)
    found : tuple of Found
    p : dict
        Of every term beside J, B and K alone, by Holm's method.
    remains : float
        p of what is linear and remains; NaN without a perturbation.
    left : float
        Its share of the torque that the perturbation causes.
    change : array, shape (3,)
        How J, B and K change where low lines count more.
    answered : bool
    case, state : Case, State
    """

    joint: Array
    half: Array
    degrees: Array
    covariance: Array
    found: tuple[Found, ...]
    p: dict[str, float]
    remains: float
    left: float
    change: Array
    answered: bool
    case: Case
    state: State


def answer(
    solution: Solution,
    *,
    person: bool = True,
    more: Sequence[Term] = (),
    chance: float = CHANCE,
) -> Answer:
    """Return what the torque of a condition holds, and J, B and K beside it.

    Parameters
    ----------
    solution : Solution
        J, B and K of all epochs together.
    person : bool
        Whether one is on the axis; without, no reflex is looked for.
    more : sequence of Term
        To be tested beside the usual ones.
    chance : float
        Probability of any false term.
    """
    state = State(solution.values, list(solution.powers))
    case = with_phases(case_of(solution.problems), state)
    if not case.caused and case.measured[0].phase is not None:
        state = settled(case, state.beside(Taken(MOVEMENT, np.zeros(0))))
    offered = [one for one in (*TERMS, *more) if _offered(case, one, person)]
    first: dict[str, float] = {}
    found: list[tuple[Taken, float, float]] = []
    strongest = 0.0
    while True:
        tested = _tested(case, state, offered)
        names = [one.name for one in offered]
        p = dict(zip(names, holm([tested.scores[name].p for name in names]), strict=True))
        first = first or p
        if len(found) == MOST_TERMS:
            break
        sure = [one for one in offered if p[one.name] < chance]
        if not case.caused and any(not one.linear for one in sure):
            sure = [one for one in sure if not one.linear]
        gains = _gains(case, state, tested, sure)
        strongest = strongest or max((gain for gain, _ in gains.values()), default=0.0)
        # The gain of a coupling is that of a straight column, and it bends.
        gains = {n: one for n, one in gains.items() if one[0] > FURTHER * strongest or n == "cuff"}
        chosen = _chosen(case, state, tested, [one for one in sure if one.name in gains], gains)
        if chosen is None:
            break
        state, size = chosen
        taken = state.taken[-1]
        found.append((taken, p.get(taken.term.name, min(p.values())), size))
        if taken.term.name in FINER:
            state = settled(case, state.beside(Taken(FINER[taken.term.name], np.zeros(0))))
        gone = {taken.term.name, *NOT_BESIDE.get(taken.term.name, ())}
        offered = [one for one in offered if one.name not in gone]
    return _answered(
        case, state, tested.model, tested.scores[ANY_LINEAR.name], solution, found, first
    )


def case_of(problems: Sequence[Problem]) -> Case:
    """Return what is known of epochs, whatever J, B and K."""
    measured = []
    for one in problems:
        observation, grid = one.observation, one.observation.grid
        channel = observation.epoch.channels["torque_nm"]
        torque = grid.lines(values_at(channel, grid.time_s, SAME_TIME), 2).T
        # Where the torque of an observation was made earlier, its lines alone were turned.
        torque = torque * (one.target / torque[:, 0])[:, None]
        through: Complex | float = 1.0
        if (through_filter := torque_filter_of(observation.settings)) is not None:
            through = lowpass(np.asarray(1j * grid.omega_rad_s), *through_filter)
        unseen = -observation.changes[0] if len(observation.changes) else 0.0
        measured.append(
            Motion(
                grid, *observation.coarse, one.regressors, torque, np.zeros(3), through, True,
                None, unseen, velocity_at(observation.epoch, grid.time_s),
            )
        )  # fmt: skip
    observations = [one.observation for one in problems]
    caused = all(one.cause is not None for one in observations)
    return Case(observations, measured, [one.instruments for one in problems], caused)


def with_phases(case: Case, state: State) -> Case:
    """Return the case with the phase of an imposed movement, 0 where the angle is highest.

    That is a motion at one slow frequency in every epoch which the perturbation does not cause.
    """
    causes = _caused(case, state) if case.caused else case.measured
    found = []
    for own, cause in zip(case.measured, causes, strict=True):
        w, T, n = own.grid.coarse_window[0], own.grid.duration_s, own.angle.size
        rest = own.angle
        if case.caused:
            x = (cause.angle - cause.angle.mean()) * w
            rest = rest - cause.angle * float((own.angle * w) @ x / (x @ x))
        power = np.abs(np.fft.rfft((rest - rest.mean()) * w)) ** 2
        all_of_it = float(np.sum(np.abs(np.fft.rfft((own.angle - own.angle.mean()) * w)) ** 2))
        first, last = int(np.ceil(FEWEST_CYCLES)), int(min(FASTEST_HZ * T, n // 2 - 3))
        if last <= first:
            return case
        peak = first + int(np.argmax(power[first : last + 1]))
        near = np.arange(peak - 2, peak + 3)
        if power[near].sum() < max(PERIODIC * power[1:].sum(), PERIODIC_OF_ALL * all_of_it):
            return case
        line = float(power[near] @ near / power[near].sum())
        # Mirrored at the end, so that no whole number of cycles leaves a step there.
        spectrum = np.fft.fft(np.concatenate([rest, rest[::-1]]))
        spectrum *= np.exp(-4.5 * ((np.arange(2 * n) / 2 - line) / line) ** 2)
        found.append(own._replace(phase=np.angle(np.fft.ifft(spectrum)[:n])))
    return case._replace(measured=found)


def _offered(case: Case, term: Term, person: bool) -> bool:
    several, phase = len(case.observations) > 1, case.measured[0].phase is not None
    return (
        term.tested
        and (person or not term.muscle)
        and (phase or term.finding != "varying_with_phase")
        and (several or term.parameter is None)
        and (case.caused or term.name[:2] not in ("J ", "B "))
    )


# --- The lines of a state


class Model(NamedTuple):
    """Whitened columns of a state, the places of what is fitted, and which are whose.

    `of_terms` and `of_slopes` are where those of each term are among the places; `tested` are the
    places of each further term.
    """

    parts: list[Part]
    base: list[Place]
    of_terms: list[slice]
    of_slopes: list[slice]
    tested: dict[str, list[Place]]


def _rows(
    motion: Motion, state: State, tested: Sequence[tuple[Term, Array]]
) -> tuple[Complex, list[int]]:
    """Return the lines of J, B, K and all columns at a state, and how many each term has."""
    motion = motion._replace(joint=state.joint)
    for one in state.taken:
        if one.term.bent is not None:
            motion = one.term.bent(motion, one.inner)
    own = [one.columns(motion) for one in state.taken]
    own += [term.columns(motion, inner) for term, inner in tested]
    return np.concatenate([motion.torque[None, :, 0], motion.lines.T, *own]), [
        len(one) for one in own
    ]


def _caused(case: Case, state: State) -> list[Motion]:
    """Return what the perturbations cause; epochs that share one share the object."""
    causes = {id(one.cause): one.cause for one in case.observations}
    by_cause = {key: one.at(state.joint) for key, one in causes.items() if one is not None}
    made: dict[tuple[int, int], Motion] = {}
    found = []
    for one, own in zip(case.observations, case.measured, strict=True):
        key = id(one.cause), id(own.phase)
        if key not in made:
            caused, grid = by_cause[id(one.cause)], one.grid
            lines, s = one.of_lines(caused.lines), 1j * grid.omega_rad_s
            torque = (lines @ state.joint)[:, None] * np.stack([np.ones_like(s), s, s * s], axis=1)
            velocity, angle = caused.coarse * (grid.coarse_window[0] > FAINT)
            made[key] = Motion(
                grid, velocity, angle, lines, torque, state.joint, own.through, False, own.phase
            )
        found.append(made[key])
    return found


def _instruments(
    case: Case, state: State, tested: Sequence[tuple[Term, Array]], last: int = 0
) -> list[Complex]:
    """Return the whitened instruments of each epoch; epochs that share them share the object.

    With `last` only so many rows from the end.
    """
    made: dict[int, Complex] = {}
    found = []
    motions = _caused(case, state) if case.caused else case.measured
    for one, motion, power in zip(case.observations, motions, state.powers, strict=True):
        if id(motion) not in made:
            weight = one.excited / np.sqrt(power) if one.periods > 1 else 1 / np.sqrt(power)
            rows = _rows(motion, state, tested)[0][1:] * weight
            made[id(motion)] = rows[-last:]
        found.append(made[id(motion)])
    return found


def model_of(
    case: Case, state: State, tested: Sequence[tuple[Term, Array]] = (), free: bool = False
) -> Model:
    """Return the model of a state; `free`: beside a free linear filter in place of J, B and K."""
    every = [_rows(one, state, tested) for one in case.measured]
    sizes = every[0][1]
    base, of_terms, of_slopes, by_itself, column = [*JOINT][3 * free :], [], [], [], 3
    places: list[list[Place]] = []
    epochs = range(len(case.observations))
    for i, size in enumerate(sizes):
        if i < len(state.taken):
            term, slopes = state.taken[i].term, int(np.sum(state.taken[i].moving))
        else:
            term, slopes = tested[i - len(state.taken)][0], 0
        own = [
            (c, e)
            for e in (epochs if term.own else (EVERY,))
            for c in range(column, column + size - slopes)
        ]
        if term.parameter is not None:
            own = [(term.parameter, e) for e in epochs[:-1]]
        moved = [(c, EVERY) for c in range(column + size - slopes, column + size)]
        if i < len(state.taken):
            of_terms.append(slice(len(base), len(base) + len(own)))
            of_slopes.append(slice(len(base) + len(own), len(base) + len(own) + slopes))
            base += [*own, *moved]
            by_itself += [c for c, _ in moved] if term.itself else []
        else:
            places.append(own)
        column += size
    parts = []
    instruments = _instruments(case, state, tested) if case.caused else None
    courses: dict[int, Array] = {}
    for e, (rows, _) in enumerate(every):
        grid = case.measured[e].grid
        if free:
            filter_ = free_filter(grid, rows[1:4].T)
            left = filter_.without(rows)
            left = left / np.sqrt(filter_.power(left[0]))
            target, C = left[0], left[1:]
        else:
            weighted = rows / np.sqrt(state.powers[e])
            target, C = weighted[0], weighted[1:]
        D = C
        if instruments is not None:
            D = instruments[e]
            if by_itself:
                D = D.copy()
                D[by_itself] = C[by_itself]
        elif not free:
            D = C.copy()
            D[:3] = case.instruments[e].T / np.sqrt(state.powers[e])
        if id(D) not in courses:
            courses[id(D)] = grid.in_time(D)
        parts.append(Part(grid, D, C, target, courses[id(D)]))
    names = [term.name for term, _ in tested]
    return Model(parts, base, of_terms, of_slopes, dict(zip(names, places, strict=True)))


def settled(case: Case, state: State, rounds: int = ROUNDS) -> State:
    """Iterate J, B, K, coefficients, inner parameters, instruments and the power of the noise.

    Raises
    ------
    ValueError
        If the columns cannot be told apart.
    """
    for _ in range(rounds):
        model = model_of(case, state)
        values, inverse = solved(sums_of(model.parts, model.base), model.base)
        left = residuals(model.parts, model.base, values)
        problems = [
            Problem(m.lines[:, :0], m.lines[:, :0], e * np.sqrt(power), one)
            for m, e, power, one in zip(
                case.measured, left, state.powers, case.observations, strict=True
            )
        ]
        taken, moved = [], 0.0
        for one, own, slopes in zip(state.taken, model.of_terms, model.of_slopes, strict=True):
            new, change = _moved(one, values[own], values[slopes])
            taken.append(new)
            moved = max(moved, change)
        step = np.abs(values[:3] - state.joint) / np.sqrt(np.abs(np.diag(inverse)[:3]) / 2)
        powers = noise_powers(problems, np.zeros(0))
        state = State(values[:3], powers, tuple(taken))
        if float(np.max(step)) < SETTLED and moved < SETTLED:
            break
    return state


def _moved(one: Taken, values: Array, by: Array) -> tuple[Taken, float]:
    """Return a term at new values, and by what share they moved."""
    inner, term = one.inner.copy(), one.term
    if term.bent is not None:
        inner[: values.size] += values
        inner = np.clip(inner, term.low, term.high)
        return Taken(term, inner, values), float(
            np.max(np.abs(inner - one.inner) / (np.abs(inner) + 1e-12))
        )
    if one.values.size:
        most = MOST_STEPS * term.steps[one.moving]
        inner[one.moving] += np.clip(by, -most, most)
        inner = np.clip(inner, term.low, term.high) if inner.size else inner
        apart = np.max(np.abs(values - one.values), initial=0.0)
        share = float(apart / np.max(np.abs(values), initial=1e-300))
        return Taken(term, inner, values), share
    return Taken(term, inner, values), 1.0


# --- Which term


class _Tested(NamedTuple):
    """The scores of terms beside a state; a model in which a free filter takes the place of J, B, K
    where no perturbation is the instrument."""

    model: Model
    free: Model | None
    scores: dict[str, Score]
    left: list[Complex]


def _tested(case: Case, state: State, terms: Sequence[Term]) -> _Tested:
    tested = [*((one, one.first) for one in terms), (ANY_LINEAR, ANY_LINEAR.first)]
    model = model_of(case, state, tested)
    sums, local, left = _solved(model, model.tested)
    scores = {name: score(sums, local, model.base, own) for name, own in model.tested.items()}
    free = None
    if not case.caused:
        free = model_of(case, state, tested, free=True)
        bent = {one.name: free.tested[one.name] for one in terms if not one.linear}
        sums, local, left_free = _solved(free, bent)
        scores |= {name: score(sums, local, free.base, own) for name, own in bent.items()}
        del left_free
    return _Tested(model, free, scores, left)


def _solved(
    model: Model, tested: dict[str, list[Place]]
) -> tuple[Sums, list[Array], list[Complex]]:
    sums = sums_of(model.parts, [*model.base, *(p for own in tested.values() for p in own)])
    left = residuals(model.parts, model.base, solved(sums, model.base)[0])
    return sums, blocks(model.parts, left), left


def _gains(
    case: Case, state: State, tested: _Tested, sure: Sequence[Term]
) -> dict[str, tuple[float, Array]]:
    """Return what each explains beyond twice its columns, and the best inner parameters."""
    found = {}
    for term in sure:
        one = tested.scores[term.name]
        if term.resists and not one.values[0] > 0:
            continue
        gain, inner = one.explained - 2 * len(tested.model.tested[term.name]), term.first[0]
        if len(term.inner) > 1 and term.bent is None:
            each = explained(
                _instruments(case, state, [(term, term.inner)], len(term.inner)),
                tested.model.parts, tested.model.base, tested.left,
            )  # fmt: skip
            gain, inner = float(np.max(each)) - 4, term.inner[int(np.argmax(each))]
        found[term.name] = gain, inner
    return found


def _chosen(
    case: Case,
    state: State,
    tested: _Tested,
    sure: Sequence[Term],
    gains: dict[str, tuple[float, Array]],
) -> tuple[State, float] | None:
    """Return the state with the term that leaves least of those that matter, and its size."""
    ranked = sorted(sure, key=lambda term: -gains[term.name][0])
    first = gains[ranked[0].name][0] if ranked else 0.0
    rivals = [one for one in ranked[:RIVALS] if gains[one.name][0] >= RIVAL * first]
    if any(one.linear and not one.own and one.parameter is None for one in rivals):
        late = [one for one in ranked if one.name in _LATE and one not in rivals]
        rivals += [*late, FILTER]
    found: list[tuple[State, float]] = []
    for term in [*rivals, *(one for one in ranked if one not in rivals)]:
        if found and term not in rivals:
            break
        inner = gains[term.name][1] if term.name in gains else term.first[0]
        try:
            new = _with(case, state, term, inner)
            size, least = size_of(case, new)
        except ValueError:
            continue
        if size < least or (not case.caused and term.linear and not _clear(state, new)):
            continue
        found.append((new, size))
        late = term.name in (*_LATE, "reflex")
        if len(found) == 1 and first > CLEAR and case.caused and not late:
            remains, dimension = _remains(case, new, tested, new.powers)
            if remains < dimension + 4 * np.sqrt(2 * dimension):
                break
    if len(found) < 2:
        return found[0] if found else None
    best = min((new.powers for new, _ in found), key=_unlikely)
    if not case.caused:
        return min(found, key=lambda one: _unlikely(one[0].powers))
    return min(found, key=lambda one: _remains(case, one[0], tested, best)[0])


def _clear(state: State, new: State) -> bool:
    """Return whether the power of the residual falls as far as torque of a subject does not let it."""
    lines = sum(one.size for one in state.powers)
    return _unlikely(state.powers) - _unlikely(new.powers) > ALONE * lines


def _unlikely(powers: Sequence[Array]) -> float:
    return sum(float(np.sum(np.log(one))) for one in powers)


def _with(case: Case, state: State, term: Term, inner: Array) -> State:
    """Return the state settled with one more term."""
    if term.name == "cuff":
        state, inner = _coupled(case, state)
    return settled(case, state.beside(Taken(term, inner)))


def _coupled(case: Case, state: State) -> tuple[State, Array]:
    """Return J, B, K, and c and lag of a soft coupling, where the search for them begins.

    With M (1 + lag s) + c (J s² + B s + K) M = (1 + lag s) (J s² + B s + K) θ the torque is linear
    in θ and three derivatives, and in two of its own; so many of the caused angle are instruments.
    """
    gram, moment = np.zeros((6, 6)), np.zeros(6)
    causes = _caused(case, state) if case.caused else case.measured
    for own, cause, power in zip(case.measured, causes, state.powers, strict=True):
        s, moved = 1j * own.grid.omega_rad_s, (own.lines - own.unseen).T
        columns = np.stack([*moved[::-1], s * moved[0], -own.torque[:, 1], -own.torque[:, 2]])
        instruments = cause.lines[:, 2] * s ** np.arange(6)[:, None] if case.caused else columns
        both = np.concatenate([columns, own.torque[None, :, 0]])
        found = real(instruments / np.sqrt(power), both / np.sqrt(power))
        gram, moment = gram + found[:, :-1], moment + found[:, -1]
    rows = np.abs(gram).max(axis=1)
    stiff, damped, heavy, third, _, second = np.linalg.solve(gram / rows[:, None], moment / rows)
    c, lag_s = max(second / heavy, 1e-6), float(np.clip(third / heavy, 0.0, 0.01))
    joint = np.array([heavy - lag_s * damped, damped - lag_s * stiff, stiff])
    return state._replace(joint=joint / max(1 - c * stiff, 0.1)), np.array([c, lag_s])


def _remains(
    case: Case, state: State, tested: _Tested, powers: Sequence[Array]
) -> tuple[float, float]:
    """Return the χ² of the instruments of all terms in what a state leaves, and how many."""
    model = model_of(case, state._replace(powers=powers))
    values, _ = solved(sums_of(model.parts, model.base), model.base)
    left = residuals(model.parts, model.base, values)
    g: Array = np.zeros(())
    own: Array = np.zeros(())
    for one, e in zip(tested.model.parts, left, strict=True):
        g, own = (
            g + real(one.instruments, e[None])[:, 0],
            own + real(one.instruments, one.instruments),
        )
    size = np.sqrt(np.diag(own)) + 1e-300
    scaled = own / np.outer(size, size)
    precision = np.linalg.pinv(scaled, rcond=1e-8, hermitian=True)
    return float(2 * (g / size) @ precision @ (g / size)) + len(model.base), float(len(g))


# --- How large


def size_of(case: Case, state: State) -> tuple[float, float]:
    """Return how large the last term is, and how large it must be."""
    taken = state.taken[-1]
    term = taken.term
    if term.name == "cuff":
        size = float(taken.inner[0] * state.joint[2])
        return (size if size < MOST_CUFF else 0.0), LEAST_CUFF
    if term.bent is not None:
        return abs(float(taken.inner[0])), LEAST_DELAY_S
    if term.finding.startswith("varying"):
        return max(
            float(np.ptp(functions @ values) / np.abs(state.joint[j] + np.mean(functions @ values)))
            for j, functions, values, _ in courses(case, taken.term, taken.inner, taken.values)
        ), LEAST_RANGE
    own = whole = 0.0
    motions = _caused(case, state) if case.caused else case.measured
    for motion, power in zip(motions, state.powers, strict=True):
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
    if term.finding == "varying_with_time":
        x, j = np.linspace(-INNER_TIME, INNER_TIME, PLACES), "JBK".index(term.name[0])
        found = []
        for one, own in zip(case.observations, values.reshape(len(labels), -1), strict=True):
            at_s = float(one.grid.time_s[0]) + (x + 1) / 2 * one.grid.duration_s
            found.append((j, over_time(x).T, own, [f"{t:.1f} s" for t in at_s]))
        return found
    if term.finding == "varying_with_phase":
        x, j = np.linspace(0, 2 * np.pi, PLACES), "JBK".index(term.name[0])
        return [(j, over_phase(x).T, values, [f"{t:.0f}° of the cycle" for t in np.degrees(x)])]
    angle = np.concatenate([m.angle for m in case.measured])
    x = np.linspace(*np.quantile(angle, INNER_ANGLE), PLACES)
    slopes = [2 * x, 3 * x**2]
    if term.name == "stiffness by side":
        slopes = [np.tanh((x - inner[1]) / inner[0])]
    at = [f"{t:+.1f}° from the mean" for t in np.degrees(x)]
    return [(2, np.stack(slopes, axis=1), values, at)]


# --- The answer


def _answered(
    case: Case,
    state: State,
    model: Model,
    linear: Score,
    solution: Solution,
    found: Sequence[tuple[Taken, float, float]],
    p: dict[str, float],
) -> Answer:
    values, inverse = solved(sums_of(model.parts, model.base), model.base)
    fit = fitted(
        blocks(model.parts, residuals(model.parts, model.base, values)), model.base, values, inverse
    )
    mean = np.eye(len(model.base))[:3]
    for one, own in zip(state.taken, model.of_terms, strict=True):
        if one.term.parameter is not None:
            mean[one.term.parameter, own] = 1 / len(case.observations)
    joint, covariance = mean @ values, mean @ fit.covariance @ mean.T
    half = fit.half[:3] * np.sqrt(np.diag(covariance) / np.diag(fit.covariance)[:3])
    half = half + _by_other_drives(case, state, model, values)
    remains, left, change = np.nan, 0.0, np.zeros(3)
    if case.caused:
        remains = linear.p
        left = float(np.sqrt(np.mean(linear.values**2) * 2))
        change = _where_low_counts(model, values)
    answered = not (remains < REMAINS and np.max(np.abs(change / joint)) > LITTLE)
    if remains < REMAINS and answered:
        half = half + np.abs(change)
    terms = []
    named = {taken.term.name: (chance, size) for taken, chance, size in found}
    for i, (one, own, slopes) in enumerate(
        zip(state.taken, model.of_terms, model.of_slopes, strict=True)
    ):
        if one.term.name not in named:
            continue
        without = solution.values
        if len(found) > 1:
            rest = state._replace(taken=(*state.taken[:i], *state.taken[i + 1 :]))
            without = settled(case, rest, 3).joint
        inner_half = np.full(one.inner.size, np.nan)
        inner_half[one.moving] = fit.half[slopes]
        own_values = one.inner[: own.stop - own.start] if one.term.bent else values[own]
        terms.append(
            Found(
                one.term, named[one.term.name][0], own_values, fit.half[own],
                fit.covariance[own, own], one.inner, inner_half, named[one.term.name][1],
                without - joint,
            )
        )  # fmt: skip
    return Answer(
        joint, half, fit.degrees[:3], covariance, tuple(terms), p, float(remains), left, change,
        answered, case, state,
    )  # fmt: skip


def _by_other_drives(case: Case, state: State, model: Model, values: Array) -> Array:
    """Return how far J, B and K move with the drives that may be the one."""
    most = np.zeros(3)
    for k in range(1, max(len(one.changes) for one in case.observations)):
        parts = []
        for one, part, power in zip(case.observations, model.parts, state.powers, strict=True):
            columns = part.columns.copy()
            if k < len(one.changes):
                columns[:3] += one.changes[k].T / np.sqrt(power)
            parts.append(part._replace(columns=columns))
        other, _ = solved(sums_of(parts, model.base), model.base)
        most = np.maximum(most, np.abs(other - values)[:3])
    return most


def _where_low_counts(model: Model, values: Array) -> Array:
    """Return how J, B and K change where a line counts by one over its frequency."""
    parts = [
        one._replace(instruments=one.instruments * (one.grid.omega_rad_s[0] / one.grid.omega_rad_s))
        for one in model.parts
    ]
    return np.asarray((solved(sums_of(parts, model.base), model.base)[0] - values)[:3])


# --- What is told


def findings_of(
    found: Answer, solution: Solution, settings: Settings, method: str = ""
) -> tuple[Finding, ...]:
    """Return the findings of an answer, one for each kind.

    Parameters
    ----------
    found : Answer
    solution : Solution
        J, B and K without terms.
    settings : Settings
    method : str
        Not shown yet.
    """
    del method
    by_kind: dict[str, list[Found]] = {}
    for one in found.found:
        by_kind.setdefault(one.term.finding, []).append(one)
    told = []
    harmless = "answered" if found.answered else ""
    for kind, own in by_kind.items():
        if kind == "varying_between_epochs":
            continue  # told with the fits of single epochs
        added = np.sum([one.effect for one in own], axis=0)
        value, limit, facts, variant = _told(kind, own, added, found, settings.diagnostics)
        facts |= {"remains": found.remains, "stands": "beside" if found.answered else "withheld"}
        told.append(
            said(
                kind, settings.diagnostics, value, limit, p=max(one.p for one in own),
                effect=Effect.of(added, found.joint + added, found.half), facts=facts,
                variant=variant, harmless=harmless,
            )
        )  # fmt: skip
    percent = 100 * found.left
    if not found.answered and percent > settings.diagnostics.max_lack_of_fit_percent:
        low_hz, high_hz = found.case.measured[0].grid.band_hz
        halves = zip("JBK", (100 * found.change / found.joint).tolist(), strict=True)
        facts = {"low_hz": low_hz, "high_hz": high_hz} | {f"half_{s}": one for s, one in halves}
        most = settings.diagnostics.max_lack_of_fit_percent
        told.append(
            said("lack_of_fit", settings.diagnostics, percent, most, p=found.remains, facts=facts)
        )
    return tuple(told)


def _told(
    kind: str, own: Sequence[Found], added: Array, found: Answer, settings: DiagnosticsSettings
) -> tuple[float, float, dict[str, Fact], str]:
    """Return value, limit, facts and variant of a kind's finding."""
    first = own[0]
    if kind == "torque_delay":
        late_ms = 1e3 * float(first.values[0]) * (np.sqrt(2) if first.term is FILTER else 1)
        facts: dict[str, Fact] = {"late_ms": late_ms, "half_ms": 1e3 * float(first.half[0])}
        return abs(late_ms), 1e3 * LEAST_DELAY_S, facts | {"terms": first.term.label}, ""
    if kind.startswith("varying"):
        ranges = [_range(one, found) for one in own]
        ranges.sort(key=lambda one: -one[0])
        others = [str(one["symbol"]) for _, one in ranges[1:]]
        text = f"; so does {' and '.join(others)}" if others else ""
        return ranges[0][0], settings.max_varying_percent, {**ranges[0][1], "others": text}, ""
    asked = ["inertia", "damping", "stiffness", *(one.term.asked for one in own)]
    if "directional-damping" in asked:
        asked.remove("damping")  # the whole and its two halves are one too many
    sizes = [_size(one) for one in own]
    facts = {
        "terms": " and ".join(one.term.label for one in own), "asked": ",".join(asked),
        "sizes": " and ".join(sizes), "size": float(first.values[0]), "share": 100 * first.size,
    }  # fmt: skip
    variant = "several" if len(own) > 1 else ""
    if first.term.muscle:
        facts["late_ms"] = 1e3 * float(first.inner[0])
    if first.term.name == "cuff" and not variant:
        variant, facts["size"] = "coupling", 1 / float(first.values[0])
    return 100 * float(np.max(np.abs(added) / found.half)), 100.0, facts, variant


def _size(one: Found) -> str:
    late = f" {1e3 * one.inner[0]:.0f} ms late" if one.term.muscle else ""
    each = [f"{v:.3g} ± {h:.2g}" for v, h in zip(one.values, one.half, strict=True)]
    return f"{one.term.label} of {each[0]} {one.term.unit}{late}"


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
        percent = 100 * float(np.ptp(goes) / np.abs(goes[low] + goes[high]) * 2)
        if percent > best[0]:
            best = percent, {
                "symbol": PARAMETERS[j].symbol, "size_unit": PARAMETERS[j].unit,
                "low": float(goes[low]), "low_half": float(half[low]), "low_at": at[low],
                "high": float(goes[high]), "high_half": float(half[high]), "high_at": at[high],
            }  # fmt: skip
    return best
