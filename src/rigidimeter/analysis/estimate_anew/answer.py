"""Which terms the torque holds beside J, B and K, and J, B and K beside them.

1. Every term is tested beside what is fitted (`score`), with Holm's adjustment over all.
2. Of those that are sure the first by χ² and its rivals are settled: J, B, K, coefficients, inner
   parameters, instruments and the power S of the noise are iterated together (Gauss and Newton).
3. Rivals are compared by what remains, the χ² that the instruments of all terms together still
   explain of the residual (Hansen's J), all with the S of the best.
4. The one that leaves least is accepted if it is large enough to matter; then from 1 beside it.

Slopes by the inner parameters stay among the columns at the end, so intervals hold that the form
of a term is not known: how late a reflex is, how slow the muscle, how sharp the friction.

J, B and K beside the terms are an answer where nothing that is linear remains in the torque's
response to the perturbation, or where it could change none of them by 1 %. Otherwise no number is
one, and they are withheld.

Where no perturbation was recorded the motion is its own instrument. Terms that are not linear are
then tested on what no free linear filter of the motion explains, since whatever the subject does by
the loop is linear; linear ones must be larger.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidimeter.analysis.estimate_anew.grid import Array, Complex
from rigidimeter.analysis.estimate_anew.observation import Observation, torque_filter_of
from rigidimeter.analysis.estimate_anew.score import (
    EVERY,
    Fitted,
    Part,
    Place,
    Score,
    Sums,
    blocks,
    fitted,
    free_filter,
    holm,
    real,
    residuals,
    score,
    solved,
    sums_of,
)
from rigidimeter.analysis.estimate_anew.signals import values_at
from rigidimeter.analysis.estimate_anew.solve import Problem, Solution, noise_powers
from rigidimeter.analysis.estimate_anew.terms import (
    ANY_LINEAR,
    CUFF,
    FILTER,
    TERMS,
    Motion,
    Term,
    over_phase,
    over_time,
)
from rigidimeter.core.records import PARAMETERS
from rigidimeter.model import lowpass

CHANCE, MOST_TERMS = 1e-3, 3
REMAINS, LITTLE = 1e-3, 0.01
"""J, B and K are withheld where p of what remains is below the first, unless it could change them
by less than the second."""

LEAST_SHARE, LEAST_RANGE, LEAST_DELAY_S, LEAST_FURTHER = 0.02, 0.10, 2e-4, 0.03
LEAST_CUFF, MOST_CUFF = 0.002, 0.3
"""How large a term must be: of the torque that the perturbation causes; of J, B or K where one
changes; a delay; χ² of a further one, of the first's; K of the joint over that of a cuff."""

UNKNOWN = 3.0
"""Without a perturbation linear terms must be so many times as large."""

RIVAL, RIVALS = 0.5, 4
ROUNDS, SETTLED = 8, 0.02
MOST_STEPS = 10
ACTIVE = 4
"""An inner parameter moves by so many of its steps at most, and if it is so many above its end."""

JOINT: tuple[Place, ...] = ((0, EVERY), (1, EVERY), (2, EVERY))
PLACES = 61


class Taken(NamedTuple):
    """A term in the model.

    Attributes
    ----------
    term : Term
    inner : array, shape (d,)
    values : array, shape (q,)
        Coefficients of its places, empty before they are known.
    """

    term: Term
    inner: Array
    values: Array = np.zeros(0)

    @property
    def moving(self) -> NDArray[np.bool_]:
        """Which inner parameters are fitted beside the coefficients."""
        if self.term.bent is not None or not self.values.size or not self.inner.size:
            return np.zeros(self.inner.size, dtype=bool)
        return self.inner > self.term.low + ACTIVE * self.term.steps

    def columns(self, motion: Motion) -> Complex:
        """Return its columns, then its slopes."""
        if self.term.parameter is not None:
            return np.empty((0, motion.grid.line.size), dtype=np.complex128)
        own = self.term.columns(motion, self.inner)
        if not np.any(self.moving):
            return own
        slopes = self.term.slopes(motion, self.inner, self.moving)
        return np.concatenate([own, self.values[0] * slopes])


class State(NamedTuple):
    """Where the model is linearised: J, B, K, the noise of every epoch, terms."""

    joint: Array
    powers: Sequence[Array]
    taken: tuple[Taken, ...] = ()


class Case(NamedTuple):
    """The epochs of a condition.

    Attributes
    ----------
    observations : sequence of Observation
    measured : list of Motion
    instruments : list of complex array, shape (m, 3)
        Where no perturbation is the instrument.
    caused : bool
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
    inner: Array
    inner_half: Array
    size: float
    effect: Array


class Answer(NamedTuple):
    """J, B and K beside what was found.

    Attributes
    ----------
    joint, half : array, shape (3,)
        J, B, K and half their 95 % intervals.
    covariance : array, shape (3, 3)
    degrees : array, shape (3,)
    found : tuple of Found
    p : dict
        Of every term beside J, B and K alone, by Holm's method.
    remains : float
        p of what is linear and remains; NaN without a perturbation.
    change : float
        By what share of J, B or K it could change them.
    answered : bool
    state : State
    """

    joint: Array
    half: Array
    covariance: Array
    degrees: Array
    found: tuple[Found, ...]
    p: dict[str, float]
    remains: float
    change: float
    answered: bool
    state: State


def between(symbol: str, unit: str) -> Term:
    """Return the term of a J, B or K that differs between epochs: no column, places alone."""
    none: Callable[[Motion, Array], Complex] = lambda m, inner: np.empty((0, m.grid.line.size))  # noqa: E731
    return Term(
        f"{symbol} between epochs", unit, f"{symbol} that differs between epochs", none,
        parameter="JBK".index(symbol), linear=True, finding="varying_between_epochs",
    )  # fmt: skip


BETWEEN = tuple(between(one.symbol, one.unit) for one in PARAMETERS)


def answer(
    solution: Solution,
    *,
    person: bool = True,
    phases: Sequence[Array] | None = None,
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
    phases : sequence of array, optional
        The phase of an imposed movement at the coarse samples of each epoch, in rad.
    more : sequence of Term
        To be tested beside the usual ones.
    chance : float
        Probability of any false term.
    """
    case = case_of(solution.problems, phases)
    state = State(solution.values, list(solution.powers))
    left = _offered(case, person, more)
    first: dict[str, float] = {}
    found: list[tuple[Taken, float, float]] = []
    strongest = 0.0
    while left and len(found) < MOST_TERMS:
        round_ = _Round.of(case, state, left)
        adjusted = dict(zip(left, holm([round_.scores[one].p for one in left]), strict=True))
        first = first or {one.name: p for one, p in adjusted.items()}
        sure = [one for one in left if adjusted[one] < chance and round_.possible(one)]
        best = round_.best(sure, strongest)
        strongest = strongest or max((one[1] for one in best.values()), default=0.0)
        chosen = round_.chosen(best)
        if chosen is None:
            break
        state, taken, size = chosen
        found.append((taken, adjusted[taken.term], size))
        gone = {taken.term.name, *_SAME.get(taken.term.name, ())}
        left = [one for one in left if one.name not in gone]
    return _answered(case, state, solution, found, first)


_LATE = ("delay", "cuff", "filter")
_SAME = {name: _LATE for name in _LATE} | {"cuff": (*_LATE, "reflex")}
"""Terms that are no longer looked for beside one that was found."""


def case_of(problems: Sequence[Problem], phases: Sequence[Array] | None = None) -> Case:
    """Return what is known of epochs, whatever J, B and K."""
    measured = []
    for e, one in enumerate(problems):
        observation, grid = one.observation, one.observation.grid
        own = observation.epoch.channels["torque_nm"]
        torque = grid.lines(values_at(own, grid.time_s, 0.01), 2).T
        # An observation whose torque was made earlier has only its lines turned.
        torque = torque * (one.target / torque[:, 0])[:, None]
        through = 1.0
        if (through_filter := torque_filter_of(observation.settings)) is not None:
            through = lowpass(np.asarray(1j * grid.omega_rad_s), *through_filter)
        measured.append(
            Motion(
                grid, *observation.coarse, one.regressors, torque, np.zeros(3), through,
                phase=None if phases is None else phases[e],
            )
        )  # fmt: skip
    observations = [one.observation for one in problems]
    caused = all(one.cause is not None for one in observations)
    return Case(observations, measured, [one.instruments for one in problems], caused)


def _offered(case: Case, person: bool, more: Sequence[Term]) -> list[Term]:
    phase = case.measured[0].phase is not None
    several = len(case.observations) > 1
    return [
        one
        for one in (*TERMS, *(BETWEEN if several else ()), *more)
        if one.tested
        and (person or not one.muscle)
        and (phase or one.finding != "varying_with_phase")
        and (case.caused or one.name[0] not in "JB" or " " not in one.name)
    ]


# --- Lines of a state


def _instruments(case: Case, state: State) -> list[Motion]:
    """Return the motions whose columns are instruments; epochs that share one share the object."""
    if not case.caused:
        return [
            m._replace(lines=z, joint=state.joint)
            for m, z in zip(case.measured, case.instruments, strict=True)
        ]
    made: dict[tuple[int, int], Motion] = {}
    by_cause = {
        id(one.cause): one.cause.at(state.joint)
        for one in {id(o.cause): o for o in case.observations}.values()
    }
    found = []
    for one, own in zip(case.observations, case.measured, strict=True):
        key = id(one.cause), id(own.phase)
        if key not in made:
            caused = by_cause[id(one.cause)]
            lines = one.of_lines(caused.lines)
            if one.periods > 1:
                lines = lines * one.excited[:, None]
            s = 1j * one.grid.omega_rad_s
            torque = (lines @ state.joint)[:, None] * np.stack([np.ones_like(s), s, s * s], axis=1)
            made[key] = Motion(
                one.grid, *caused.coarse, lines, torque, state.joint, own.through, False, own.phase
            )
        found.append(made[key])
    return found


def _bent(motion: Motion, state: State) -> Motion:
    for one in state.taken:
        if one.term.bent is not None:
            motion = one.term.bent(motion, one.inner)
    return motion


def _parts(case: Case, state: State, columns: Callable[[Motion], Complex]) -> list[Part]:
    """Return the whitened lines of J, B, K and further columns."""
    found = []
    made: dict[int, tuple[Complex, Array]] = {}
    for own, cause, one, power in zip(
        case.measured, _instruments(case, state), case.observations, state.powers, strict=True
    ):
        own, weight = _bent(own._replace(joint=state.joint), state), 1 / np.sqrt(power)
        C = np.concatenate([own.lines.T, columns(own)]) * weight
        if not case.caused:
            D = np.concatenate([cause.lines.T * weight, C[3:]])
            courses = own.grid.in_time(D)
        elif id(cause) in made:
            D, courses = made[id(cause)]
        else:
            bent = _bent(cause, state)
            D = np.concatenate([bent.lines.T, columns(bent)]) * weight
            if one.periods > 1:
                D = D * one.excited
            courses = own.grid.in_time(D)
            made[id(cause)] = D, courses
        found.append(Part(own.grid, D, C, own.torque[:, 0] * weight, courses))
    return found


def _freed(case: Case, state: State, columns: Callable[[Motion], Complex]) -> list[Part]:
    """Return what a free linear filter of the motion leaves of torque and columns, whitened."""
    filters = [free_filter(m.grid, m.lines) for m in case.measured]
    targets = [f.without(m.torque[:, 0]) for f, m in zip(filters, case.measured, strict=True)]
    found = []
    for f, m, target in zip(filters, case.measured, targets, strict=True):
        power = f.power(target)
        own = np.concatenate([m.lines.T, columns(m._replace(joint=state.joint))])
        C = f.without(own) / np.sqrt(power)
        found.append(Part(m.grid, C, C, target / np.sqrt(power), m.grid.in_time(C)))
    return found


def _own_places(case: Case, term: Term, columns: Sequence[int]) -> list[Place]:
    epochs = range(len(case.observations))
    if term.parameter is not None:
        return [(term.parameter, e) for e in epochs[:-1]]
    return [(c, e) for e in (epochs if term.own else (EVERY,)) for c in columns]


class _Model(NamedTuple):
    """The columns of a state: their places, and those of each term and of its slopes."""

    parts: list[Part]
    places: list[Place]
    of_terms: list[slice]
    of_slopes: list[slice]

    @classmethod
    def of(
        cls,
        case: Case,
        state: State,
        extra: Callable[[Motion], Complex] | None = None,
        free: bool = False,
    ) -> _Model:
        def columns(motion: Motion) -> Complex:
            own = [one.columns(motion) for one in state.taken]
            own += [] if extra is None else [extra(motion)]
            return np.concatenate([np.empty((0, motion.grid.line.size)), *own])

        parts = (_freed if free else _parts)(case, state, columns)
        places, of_terms, of_slopes = list(JOINT), [], []
        column = 3
        probe = case.measured[0]._replace(joint=state.joint)
        for one in state.taken:
            moving = int(np.sum(one.moving))
            count = one.columns(_bent(probe, state)).shape[0] - moving
            own = _own_places(case, one.term, range(column, column + count))
            of_terms.append(slice(len(places), len(places) + len(own)))
            places += own
            column += count
            of_slopes.append(slice(len(places), len(places) + moving))
            places += [(c, EVERY) for c in range(column, column + moving)]
            column += moving
        return cls(parts, places, of_terms, of_slopes)


def _settled(case: Case, state: State, rounds: int = ROUNDS) -> State:
    """Iterate J, B, K, coefficients, inner parameters, instruments and noise.

    Raises
    ------
    ValueError
        If the columns cannot be told apart.
    """
    for _ in range(rounds):
        model = _Model.of(case, state)
        values, inverse = solved(sums_of(model.parts, model.places), model.places)
        left = residuals(model.parts, model.places, values)
        problems = []
        for one, part, power, e in zip(
            case.observations, model.parts, state.powers, left, strict=True
        ):
            x = (part.columns[:3] * np.sqrt(power)).T
            problems.append(Problem(x, x, e * np.sqrt(power), one))
        powers = noise_powers(problems, np.zeros(3))
        taken = []
        moved = 0.0
        for one, own, slopes in zip(state.taken, model.of_terms, model.of_slopes, strict=True):
            new, change = _moved(one, values[own], values[slopes])
            taken.append(new)
            moved = max(moved, change)
        se = np.sqrt(np.abs(np.diag(inverse)[:3]) / 2)
        step = float(np.max(np.abs(values[:3] - state.joint) / se))
        state = State(values[:3], powers, tuple(taken))
        if step < SETTLED and moved < SETTLED:
            break
    return state


def _moved(one: Taken, values: Array, by: Array) -> tuple[Taken, float]:
    """Return a term at new values, and how far they moved of themselves."""
    inner = one.inner.copy()
    if one.term.bent is not None:
        inner[: values.size] += values
        inner = np.clip(inner, one.term.low, one.term.high)
        moved = float(np.max(np.abs(inner - one.inner) / (np.abs(inner) + 1e-12)))
        return Taken(one.term, inner, values), moved
    moved = 1.0
    if one.values.size:
        moved = float(np.max(np.abs(values - one.values)) / (np.max(np.abs(values)) + 1e-300))
        most = MOST_STEPS * one.term.steps[one.moving]
        inner[one.moving] += np.clip(by, -most, most)
        inner = np.clip(inner, one.term.low, one.term.high) if inner.size else inner
    return Taken(one.term, inner, values), moved


# --- Which term


class _Round(NamedTuple):
    """One round of tests beside a state."""

    case: Case
    state: State
    model: _Model
    free: _Model | None
    at: dict[Term, list[int]]
    sums: Sums
    scores: dict[Term, Score]
    left: list[Complex]

    @classmethod
    def of(cls, case: Case, state: State, terms: Sequence[Term]) -> _Round:
        def columns(motion: Motion) -> Complex:
            return np.concatenate(
                [
                    t.columns(motion, inner)
                    for t in terms
                    if t.parameter is None
                    for inner in t.first
                ]
            )

        model = _Model.of(case, state, columns)
        at, column = {}, model.parts[0].columns.shape[0]
        probe = case.measured[0]._replace(joint=state.joint)
        counts = [
            0 if t.parameter is not None else len(t.first) * len(t.columns(probe, t.first[0]))
            for t in terms
        ]
        column -= sum(counts)
        for term, count in zip(terms, counts, strict=True):
            at[term] = list(range(column, column + count))
            column += count
        places = {t: _own_places(case, t, at[t]) for t in terms}
        sums, local, left = cls._solved(model, [p for own in places.values() for p in own])
        scores = {t: score(sums, local, model.places, places[t]) for t in terms}
        free = None
        if not case.caused:
            free = _Model.of(case, state, columns, free=True)
            base = [p for p in free.places[3:]]
            free = free._replace(places=base)
            bent = [t for t in terms if not t.linear]
            sums_f, local_f, _ = cls._solved(free, [p for t in bent for p in places[t]])
            scores |= {t: score(sums_f, local_f, base, places[t]) for t in bent}
        return cls(case, state, model, free, at, sums, scores, left)

    @staticmethod
    def _solved(model: _Model, more: Sequence[Place]) -> tuple[Sums, list[Array], list[Complex]]:
        sums = sums_of(model.parts, [*model.places, *more])
        values, _ = solved(sums, model.places)
        left = residuals(model.parts, model.places, values)
        return sums, blocks(model.parts, left), left

    def possible(self, term: Term) -> bool:
        """Return whether a term that resists does so."""
        return not term.resists or bool(self.scores[term].values[0] > 0)

    def best(self, sure: Sequence[Term], strongest: float) -> dict[Term, tuple[Array, float]]:
        """Return the best inner parameter of each, and what it explains less twice its columns."""
        found = {}
        for term in sure:
            inner, gain = term.inner[0], self.scores[term].explained - 2 * len(self.at[term] or [0])
            if len(term.inner) > 1 and term.bent is None and term.name != "friction":
                inner, explained = self._scanned(term)
                gain = explained - 4
            if gain >= LEAST_FURTHER * strongest:
                found[term] = inner, gain
        return found

    def _scanned(self, term: Term) -> tuple[Array, float]:
        """Return the inner parameter whose instrument explains most, and how much."""
        model = self.model
        joint = self.state.joint
        if self.free is not None and not term.linear:
            model = self.free
        b = [c for c, e in model.places if e == EVERY]
        g = size = cross = own = gram = within = 0.0
        for part, cause, power, left in zip(
            model.parts,
            _instruments(self.case, self.state),
            self.state.powers,
            self.left,
            strict=True,
        ):
            D = np.concatenate([term.columns(cause, one) for one in term.inner])
            D = D / np.sqrt(power) if model is self.model else D
            if model is not self.model:
                raise NotImplementedError
            Z, X = part.instruments[b], part.columns[b]
            g = g + real(D, left[None])[:, 0]
            size = size + np.sum(np.abs(D) ** 2, axis=1)
            cross, own = cross + real(D, X), own + real(D, Z)
            gram, within = gram + real(Z, X), within + real(Z, Z)
        del joint
        if b:
            through = np.linalg.solve(gram.T, cross.T).T
            size = (
                size
                - 2 * np.sum(through * own, axis=1)
                + np.sum(through @ within * through, axis=1)
            )
        explained = 2 * g**2 / size
        best = int(np.argmax(explained))
        return term.inner[best], float(explained[best])

    def chosen(self, best: dict[Term, tuple[Array, float]]) -> tuple[State, Taken, float] | None:
        """Return the state with the term that leaves least of those that matter."""
        settled: list[tuple[State, Taken, float]] = []
        most = max((gain for _, gain in best.values()), default=0.0)
        ranked = sorted(best, key=lambda t: -best[t][1])
        rivals = [t for t in ranked if best[t][1] >= RIVAL * most][:RIVALS]
        if any(t.linear for t in rivals):
            rivals += [
                t for t in (*(b for b in ranked if b.name == "cuff"), FILTER) if t not in rivals
            ]
        rivals += [t for t in ranked if t not in rivals]
        for n, term in enumerate(rivals):
            if n >= RIVALS + 2 and settled:
                break
            inner = best[term][0] if term in best else term.inner[0]
            try:
                state = self._with(term, inner)
            except ValueError:
                continue
            taken = state.taken[-1]
            size, least = size_of(self.case, state, taken)
            if not self.case.caused and term.linear:
                least *= UNKNOWN
            if size >= least:
                settled.append((state, taken, size))
        if not settled:
            return None
        if len(settled) == 1:
            return settled[0]
        powers = min(
            (s.powers for s, _, _ in settled),
            key=lambda p: sum(float(np.sum(np.log(one))) for one in p),
        )
        return min(settled, key=lambda one: self._remains(one[0], powers))

    def _with(self, term: Term, inner: Array) -> State:
        state = self.state
        if term.name == "cuff" and self.case.caused:
            started = []
            for one in term.inner:
                own = self.case._replace(
                    caused=False, instruments=[m.lines for m in self.case.measured]
                )
                new = _settled(own, state._replace(taken=(*state.taken, Taken(term, one))), 10)
                started.append(
                    (sum(float(np.sum(np.log(p))) for p in new.powers), len(started), new)
                )
            state = min(started)[2]
            return _settled(self.case, state)
        return _settled(self.case, state._replace(taken=(*state.taken, Taken(term, inner))))

    def _remains(self, state: State, powers: Sequence[Array]) -> float:
        """Return the χ² that the instruments of all terms explain of what a state leaves."""
        model = _Model.of(self.case, state._replace(powers=powers))
        values, _ = solved(sums_of(model.parts, model.places), model.places)
        left = residuals(model.parts, model.places, values)
        g = own = 0.0
        for e, part, power, old in zip(
            left, self.model.parts, powers, self.state.powers, strict=True
        ):
            D = part.instruments * np.sqrt(old / power)
            g, own = g + real(D, e[None])[:, 0], own + real(D, D)
        scale = np.sqrt(np.diag(own)) + 1e-300
        precision = np.linalg.pinv(own / np.outer(scale, scale), rcond=1e-8, hermitian=True)
        return float(2 * (g / scale) @ precision @ (g / scale)) + len(model.places)


# --- How large


def size_of(case: Case, state: State, taken: Taken) -> tuple[float, float]:
    """Return how large a term is, and how large it must be."""
    term = taken.term
    if term.name == "delay":
        return abs(float(taken.inner[0])), LEAST_DELAY_S
    if term.name == "filter":
        return float(np.sqrt(2) * taken.inner[0]), LEAST_DELAY_S
    if term.name == "cuff":
        size = float(taken.inner[0] * state.joint[2])
        return (size if size < MOST_CUFF else 0.0), LEAST_CUFF
    if term.finding.startswith("varying"):
        return max(
            float(np.ptp(functions @ values) / np.abs(state.joint[j] + np.mean(functions @ values)))
            for j, functions, values, _ in courses(case, taken)
        ), LEAST_RANGE
    own = whole = 0.0
    for motion, power in zip(_instruments(case, state), state.powers, strict=True):
        whole += float(np.sum(np.abs(motion.lines @ state.joint) ** 2 / power))
        part = taken.values @ term.columns(motion, taken.inner)
        own += float(np.sum(np.abs(part) ** 2 / power))
    return float(np.sqrt(own / whole)), LEAST_SHARE


def courses(case: Case, taken: Taken) -> list[tuple[int, Array, Array, str]]:
    """Return how a parameter goes in each epoch.

    Which of J, B and K; functions at some places, shape (g, q), and their coefficients, shape (q,),
    which together are its change; and the label of the epoch, empty where all share it.
    """
    term, values, epochs = taken.term, taken.values, len(case.observations)
    if term.parameter is not None:
        return [(term.parameter, np.eye(epochs)[:, :-1], values, "")]
    if term.finding == "varying_with_time":
        x = np.linspace(-0.8, 0.8, PLACES)
        labels = [one.epoch.label for one in case.observations]
        return [
            ("JBK".index(term.name[0]), over_time(x).T, v, label)
            for v, label in zip(values.reshape(epochs, -1), labels, strict=True)
        ]
    if term.finding == "varying_with_phase":
        return [
            ("JBK".index(term.name[0]), over_phase(np.linspace(0, 2 * np.pi, PLACES)).T, values, "")
        ]
    angle = np.concatenate([m.angle for m in case.measured])
    x = np.linspace(*np.quantile(angle, [0.05, 0.95]), PLACES)
    slope = {"quadratic": 2 * x, "cubic": 3 * x**2}.get(term.name)
    if slope is None:
        slope = np.tanh(x / taken.inner[0])
    return [(2, slope[:, None], values, "")]


# --- The answer


def _answered(
    case: Case,
    state: State,
    solution: Solution,
    found: Sequence[tuple[Taken, float, float]],
    p: dict[str, float],
) -> Answer:
    state = _settled(case, state) if found else state
    model = _Model.of(case, state, lambda motion: ANY_LINEAR.columns(motion, np.zeros(0)))
    first = model.parts[0].columns.shape[0] - len(
        ANY_LINEAR.columns(case.measured[0]._replace(joint=state.joint), np.zeros(0))
    )
    more = [(c, EVERY) for c in range(first, model.parts[0].columns.shape[0])]
    sums = sums_of(model.parts, [*model.places, *more])
    values, inverse = solved(sums, model.places)
    local = blocks(model.parts, residuals(model.parts, model.places, values))
    fit = fitted(local, model.places, values, inverse)
    remains = score(sums, local, model.places, more).p if case.caused else np.nan
    change = _could_change(model, values) if case.caused else np.zeros(3)
    share = float(np.max(np.abs(change / values[:3])))
    answered = not (remains < REMAINS and share > LITTLE)
    mean = np.eye(len(model.places))[:3]
    for one, own in zip(state.taken, model.of_terms, strict=True):
        if one.term.parameter is not None:
            mean[one.term.parameter, own] = 1 / len(case.observations)
    joint, covariance = mean @ fit.values, mean @ fit.covariance @ mean.T
    t = fit.half / np.sqrt(np.diag(fit.covariance))
    half = t[:3] * np.sqrt(np.diag(covariance))
    if remains < REMAINS and answered:
        half = half + np.abs(change)
    terms = []
    for i, (one, own, slopes, (_, chance, size)) in enumerate(
        zip(state.taken, model.of_terms, model.of_slopes, found, strict=True)
    ):
        without = solution.values
        if len(state.taken) > 1:
            rest = state._replace(taken=(*state.taken[:i], *state.taken[i + 1 :]))
            without = _settled(case, rest, 3).joint
        inner_half = np.full(one.inner.size, np.nan)
        inner_half[one.moving] = fit.half[slopes]
        values_ = (
            one.inner[: own.stop - own.start] if one.term.bent is not None else fit.values[own]
        )
        terms.append(
            Found(
                one.term,
                chance,
                values_,
                fit.half[own],
                one.inner,
                inner_half,
                size,
                without - joint,
            )
        )
    return Answer(
        joint,
        half,
        covariance,
        fit.degrees[:3],
        tuple(terms),
        p,
        float(remains),
        share,
        answered,
        state,
    )


def _could_change(model: _Model, values: Array) -> Array:
    """Return how far J, B and K go where low or high lines count more, shape (3,)."""
    found = []
    for power in (-0.5, 0.5):
        parts = []
        for part in model.parts:
            tilt = (part.grid.omega_rad_s / part.grid.omega_rad_s[-1]) ** power
            parts.append(part._replace(instruments=part.instruments * tilt**2))
        other, _ = solved(sums_of(parts, model.places), model.places)
        found.append(np.abs(other - values)[:3])
    return np.asarray(np.max(found, axis=0))
