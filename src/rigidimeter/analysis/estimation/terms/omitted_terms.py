"""Which terms a torque needs beside J, B and K: one test for each, on what no linear loop explains.

With the columns z of a term at the lines of `beyond_linear`, beside those of the terms already
found, and with residual sums R₀ without and R₁ with them,

    F = (R₀ − R₁)/k ÷ (R₁/ν)        ÷ the loss of the taper

has Fisher's distribution with k and ν degrees of freedom if the term is not there: the lines are
independent and of one variance, whatever the colour of the residual. A reflex has a column for each
of several delays, and of several speeds of the muscle. The probabilities are adjusted for the
number of terms by Holm's method. The term that explains most is taken first and the others are
tested again beside it, since a reflex also looks somewhat like a damping that differs between
directions.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import scipy

from rigidimeter.analysis.estimation.signals import Array
from rigidimeter.analysis.estimation.terms.beyond_linear import BeyondLinear
from rigidimeter.analysis.estimation.terms.catalogue import REFLEXES, term_named
from rigidimeter.analysis.estimation.terms.explained import (
    Complex,
    Explained,
    Filtered,
    explained,
    one_more,
    strongest,
    triangle,
)
from rigidimeter.analysis.estimation.terms.reflex import (
    kernel,
    pass_through,
    points_tried,
    stretch_velocity,
)
from rigidimeter.analysis.statistics import holm

TESTED = ("coulomb", "damping+", "cubic", "quadratic", "reflex+")

REFLEX_COLUMNS = (
    *(("reflex+", (delay_s,)) for delay_s in (0.03, 0.05, 0.07, 0.1, 0.13)),
    *(("reflex-second-order+", (0.045, hz, 1.0)) for hz in (1.0, 2.0, 4.0)),
)
"""With which a reflex is tested: |v| changes little between them."""

DYNAMICS = 10.0
"""How much more a muscle of second order must explain than a delay alone, σ² being 1, to be named
instead of it."""

EARLIEST_S = 0.025
"""No stretch reflex is faster; a velocity that is hardly late is damping."""

CHANCE = 1e-3
"""Probability, adjusted for the number of terms, below which a term is there.

A recording has many epochs, and a term that matters has far less.
"""


class OmittedTerm(NamedTuple):
    """A term that is in the torque and not in the model.

    Attributes
    ----------
    name : str
        With the direction of a reflex decided.
    value, standard_error : float
        Its coefficient from what no linear loop explains.
    p : float
        Probability of as much by chance, adjusted for the number of terms.
    inner : tuple of float
        The parameters inside a reflex, its delay in s first.
    """

    name: str
    value: float
    standard_error: float
    p: float
    inner: tuple[float, ...] = ()

    def torque(self, beyond: BeyondLinear) -> Array:
        """Return its torque in time, shape (n,), in N·m, its linear part included.

        B is the mean over both directions of motion, so of damping in one |θ'|/2 is beside it.
        """
        term, motion = term_named(self.name), beyond.motion
        if term is not None:
            both = 0.5 * motion.velocity_rad_s if self.name == "damping+" else 0.0
            return np.asarray(self.value * (term.regressor(motion) - both))
        stretch, inner = stretch_velocity(beyond.motion, self.name), np.asarray(self.inner)
        passed = pass_through(stretch, beyond.motion.rate_hz, kernel(self.name), inner)
        return self.value * passed[0]

    def lines(self, beyond: BeyondLinear) -> Complex:
        """Return the lines of its torque, shape (m,)."""
        return beyond.lines(self.torque(beyond))


class _Found(NamedTuple):
    name: str
    inner: tuple[float, ...]


class _Test(NamedTuple):
    """A term, its probability by chance, and the fit with it and all that was found."""

    name: str
    p: float
    fit: Explained


def omitted_terms(beyond: BeyondLinear) -> tuple[OmittedTerm, ...]:
    """Return the terms that are there, the one that explains most first."""
    found: list[_Found] = []
    chances: list[float] = []
    left = list(TESTED)
    search = _Search(beyond)
    while left:
        tests = search.tests(found, left)
        adjusted = holm([test.p for test in tests])
        fits = [
            (*search.best(found, test), p)
            for test, p in zip(tests, adjusted, strict=True)
            if p < CHANCE
        ]
        fits = [fit for fit in fits if not _pushes(fit[0].name, fit[1].values[-1])]
        if not fits:
            break
        term, _, p = min(fits, key=lambda fit: fit[1].left)
        found.append(term)
        chances.append(p)
        left.remove("reflex+" if term.name in REFLEXES else term.name)
    if not found:
        return ()
    whole = beyond.solve(_columns(beyond, found))
    errors = np.sqrt(np.diag(whole.covariance))
    return tuple(
        _named(term, float(value), float(error), p)
        for term, value, error, p in zip(found, whole.values, errors, chances, strict=True)
    )


def _named(term: _Found, value: float, error: float, p: float) -> OmittedTerm:
    """Give a reflex the direction in which it resists: |v| has the other sign in the other."""
    if term.name in REFLEXES and value < 0:
        return OmittedTerm(term.name[:-1] + "-", -value, error, p, term.inner)
    return OmittedTerm(term.name, value, error, p, term.inner)


class _Search:
    """Fits to the torque of one epoch, all by way of one triangle of the terms' columns."""

    def __init__(self, beyond: BeyondLinear) -> None:
        self._beyond = beyond
        self._terms: dict[_Found, int] = {}
        self._tried: dict[str, tuple[list[_Found], Filtered, Array]] = {}
        self._take([term for name in TESTED for term in _tested(name)])

    def _take(self, terms: Sequence[_Found]) -> None:
        everything = list(dict.fromkeys([*self._terms, *terms]))
        if len(everything) > len(self._terms):
            self._terms = {term: column for column, term in enumerate(everything)}
            self._upper = triangle(_columns(self._beyond, everything), self._beyond.torque)

    def fit(self, terms: Sequence[_Found]) -> Explained:
        """Return the fit with these terms, which were taken."""
        columns = [self._terms[term] for term in terms]
        return explained(self._upper[:, columns], self._upper[:, -1])

    def tests(self, found: Sequence[_Found], names: Sequence[str]) -> list[_Test]:
        """Test each term beside those that were found."""
        before = self.fit(found)
        alone = [name for name in names if name not in REFLEXES]
        base, tried = (
            self._upper[:, [self._terms[term] for term in terms]]
            for terms in (found, [_Found(name, ()) for name in alone])
        )
        gained, values = one_more(base, tried, self._upper[:, -1])
        fits = {
            name: Explained(max(before.left - gain, 0.0), value)
            for name, gain, value in zip(alone, gained, values[:, None], strict=True)
        }
        tests = []
        for name in names:
            tested = _tested(name)
            fit = fits[name] if name in fits else self.fit([*found, *tested])
            degrees = self._beyond.free_values - len(found) - len(tested)
            more = max(before.left - fit.left, 0.0) / len(tested) / self._beyond.taper_loss
            ratio = more / (fit.left / degrees) if fit.left > 0 else np.inf
            # The tail of Fisher's distribution.
            p = float(scipy.special.fdtrc(len(tested), degrees, ratio))
            tests.append(_Test(name, p, fit))
        return tests

    def best(self, found: Sequence[_Found], test: _Test) -> tuple[_Found, Explained]:
        """Return the term and its fit, a reflex with its delay of least residual."""
        if test.name not in REFLEXES:
            return _Found(test.name, ()), test.fit
        base, torque = _columns(self._beyond, found), self._beyond.torque
        best = []
        for kind in ("reflex+", "reflex-second-order+"):
            terms, tried, sizes = self._reflexes(kind)
            best.append(terms[strongest(base, tried, torque, sizes)])
        self._take(best)
        delayed, slow = ((term, self.fit([*found, term])) for term in best)
        return slow if delayed[1].left - slow[1].left > DYNAMICS else delayed

    def _reflexes(self, kind: str) -> tuple[list[_Found], Filtered, Array]:
        """Return the reflexes that are tried, their lines over their size, and their white sizes.

        What is linear in the lines is at right angles to whatever is white.
        """
        if kind not in self._tried:
            inners = points_tried([kind])
            # The delay comes first and rises.
            late = slice(sum(inner[0] < EARLIEST_S for inner in inners), None)
            signal, gains = self._beyond.reflexes(kind)
            lines = Filtered(signal, gains.part(slice(None), late))
            sizes = self._beyond.white_sizes(lines)
            tried = lines._replace(signal=signal / self._beyond.line_size_nm)
            self._tried[kind] = [_Found(kind, inner) for inner in inners[late]], tried, sizes
        return self._tried[kind]


def _tested(name: str) -> list[_Found]:
    """Return the columns with which a term is tested."""
    if name in REFLEXES:
        return [_Found(*one) for one in REFLEX_COLUMNS]
    return [_Found(name, ())]


def _columns(beyond: BeyondLinear, terms: Sequence[_Found]) -> Complex:
    inner = [value for term in terms for value in term.inner]
    return beyond.columns([term.name for term in terms], inner)


def _pushes(name: str, value: float) -> bool:
    term = term_named(name)
    return term is not None and term.resists and value < 0
