"""Which of J, B and K vary within an epoch, with time, angle or phase, and how far.

Every kind of change and every parameter is a score test (`varying_test`). Of those that pass
`varying_chance` over the number of tests left (Holm 1979), the one that explains most is taken
into the model, and the rest are tested again beside it, until none passes. Without a perturbation
only K is tested: a subject who pushes bends J and B of least squares first, and bends them
unevenly.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np
import scipy

from rigidimeter.analysis.estimation.between_epochs import also
from rigidimeter.analysis.estimation.diagnostics.check_record import Case, Check, Look
from rigidimeter.analysis.estimation.diagnostics.missing_term import terms_found
from rigidimeter.analysis.estimation.diagnostics.varying_lines import VaryingLines, varying_lines
from rigidimeter.analysis.estimation.diagnostics.varying_shapes import (
    Shapes,
    with_angle,
    with_phase,
    with_time,
)
from rigidimeter.analysis.estimation.diagnostics.varying_test import (
    Columns,
    Score,
    effect,
    score_test,
)
from rigidimeter.analysis.estimation.signals import Array
from rigidimeter.core.findings import Fact
from rigidimeter.core.records import PARAMETERS

SHORTEST_S = 5.0
"""Fewer than ten blocks say nothing of the level of a test."""

STIFFNESS = 2
WITH_ANGLE = "varying_with_angle"


class Change(NamedTuple):
    """How one parameter goes with one thing.

    Attributes
    ----------
    parameter : int
        Which of J, B and K.
    percent : float
        From where to where it goes, in % of the mean between them.
    facts : dict
        What the words of the finding show: the ends, half the 95 % interval of each, and where.
    """

    parameter: int
    percent: float
    facts: dict[str, Fact]


class Variation(NamedTuple):
    """What was tested: the smallest p of each kind, and what is beyond chance."""

    p: dict[str, float]
    changes: dict[str, list[Change]]


class _Terms(NamedTuple):
    """One kind of change, whitened: terms of J, B and K, more of them, what is fitted beside."""

    shapes: Shapes
    of: tuple[Columns, ...]
    finer: Callable[[int], Columns]
    beside: Array


def variation(lines: VaryingLines, chance: float) -> Variation:
    """Test everything that the joint may vary with.

    Parameters
    ----------
    lines : VaryingLines
    chance : float
        Probability of any false finding.

    Raises
    ------
    ValueError
        If the epoch is too short, or its motion cannot tell the terms apart.
    """
    if lines.duration_s < SHORTEST_S:
        raise ValueError(f"{lines.duration_s:.3g} s are too short; {SHORTEST_S:g} s are needed")
    phase = with_phase(lines)
    kinds = [with_time(lines, phase), phase if phase is not None else with_angle(lines)]
    terms = [_terms(lines, shapes) for shapes in kinds if shapes is not None]
    parameters = range(3) if lines.by_perturbation else (STIFFNESS,)
    left = [(kind, parameter) for kind in terms for parameter in parameters]
    accepted: list[tuple[_Terms, int]] = []
    smallest: dict[str, float] = {}
    try:
        while left:
            found = [score for kind in terms for score in _scores(lines, kind, left, accepted)]
            if not accepted:
                for (kind, _), score in zip(left, found, strict=True):
                    name = kind.shapes.name
                    smallest[name] = min(score.p, smallest.get(name, 1.0))
            sure = [i for i, score in enumerate(found) if score.p * len(left) < chance]
            if not sure:
                break
            best = min(sure, key=lambda i: found[i].left)
            accepted.append(left.pop(best))
        changes: dict[str, list[Change]] = {}
        for kind, parameter in accepted:
            change = _change(lines, kind, parameter, accepted)
            changes.setdefault(kind.shapes.name, []).append(change)
    except np.linalg.LinAlgError as error:
        raise ValueError(f"the motion cannot tell the terms apart ({error})") from None
    return Variation(smallest, changes)


def _terms(lines: VaryingLines, shapes: Shapes) -> _Terms:
    # Without a perturbation the motion is its own instrument.
    parts = [lines.in_time(lines.motion)]
    if lines.by_perturbation:
        parts.append(lines.in_time(lines.instruments))
    beside = lines.window[:, None] * shapes.beside
    if beside.shape[1]:
        basis = np.linalg.qr(beside)[0]
        parts = [part - basis @ (basis.T @ part) for part in parts]

    def columns(functions: Array, j: int) -> Columns:
        moving, *caused = (_whitened(lines, part[:, [j]] * functions) for part in parts)
        return Columns(caused[0] if caused else moving, moving)

    of = tuple(
        columns(shapes.functions * (shapes.elastic if j == STIFFNESS else 1.0), j) for j in range(3)
    )
    return _Terms(shapes, of, lambda j: columns(shapes.finer, j), _whitened(lines, beside))


def _whitened(lines: VaryingLines, signals: Array) -> Array:
    return lines.whitened(lines.in_band(signals))


def _model(
    lines: VaryingLines, kinds: list[_Terms], parts: list[Columns]
) -> tuple[Array, Columns, list[Columns]]:
    """Return torque, base and other terms, free of what the kinds have beside."""
    below = int(lines.grid.line[0]) - 1
    base = Columns(lines.whitened(lines.instruments[below:]), lines.whitened(lines.motion[below:]))
    torque = lines.whitened(lines.torque_nm)
    beside = np.concatenate([kind.beside for kind in kinds], axis=1)
    if not beside.shape[1]:
        return torque, base, parts
    basis = np.linalg.qr(beside)[0]

    def free(values: Array) -> Array:
        return np.asarray(values - basis @ (basis.T @ values))

    cleared = [Columns(free(part.instruments), free(part.regressors)) for part in [base, *parts]]
    return free(torque), cleared[0], cleared[1:]


def _scores(
    lines: VaryingLines,
    kind: _Terms,
    left: list[tuple[_Terms, int]],
    accepted: list[tuple[_Terms, int]],
) -> list[Score]:
    """Test what is left of one kind: each parameter beside the other two and what was accepted."""
    known = [(of, j) for of, j in accepted if of is not kind]
    kinds = [kind, *{id(of): of for of, _ in known}.values()]
    parts = [*kind.of, *(of.finer(j) for of, j in known)]
    torque, base, parts = _model(lines, kinds, parts)
    return [
        score_test(
            lines,
            torque,
            Columns.joined([base, *(p for k, p in enumerate(parts) if k != j)]),
            parts[j],
        )
        for of, j in left
        if of is kind
    ]


def _change(
    lines: VaryingLines, kind: _Terms, parameter: int, accepted: list[tuple[_Terms, int]]
) -> Change:
    """Return how far a parameter goes, by the model with all that was accepted."""
    rest = [(of, j) for of, j in accepted if not (of is kind and j == parameter)]
    parts = [kind.of[parameter], *(of.of[j] for of, j in rest)]
    unique = {id(of): of for of, _ in rest}.values()
    kinds = [kind, *(of for of in unique if of is not kind)]
    torque, base, (tested, *others) = _model(lines, kinds, parts)
    shapes = kind.shapes
    found = effect(lines, torque, Columns.joined([base, *others]), tested, parameter)
    functions = np.column_stack([np.ones(len(shapes.at)), shapes.at])
    values = functions @ found.values
    variance = np.einsum("gi,ij,gj->g", functions, found.covariance, functions)
    half = float(scipy.stats.t.ppf(0.975, found.degrees)) * np.sqrt(variance)
    low, high = int(np.argmin(values)), int(np.argmax(values))
    middle = abs(float(values[low] + values[high])) / 2
    facts: dict[str, Fact] = {
        "symbol": PARAMETERS[parameter].symbol,
        "size_unit": PARAMETERS[parameter].unit,
        "low": float(values[low]),
        "low_half": float(half[low]),
        "low_at": shapes.place(low),
        "high": float(values[high]),
        "high_half": float(half[high]),
        "high_at": shapes.place(high),
    }
    return Change(parameter, 100 * float(np.ptp(values)) / max(middle, 1e-300), facts)


def _variation(case: Case) -> Variation | None:
    """Return what varies within the epoch; None where that cannot be tested."""
    if case.prepared is None:
        return None
    try:
        lines = varying_lines(case.prepared, case.parameters)
        return variation(lines, case.settings.varying_chance)
    except ValueError:
        return None


def _look(case: Case, name: str) -> Look | None:
    """Return how far the parameters go with one thing, in % of their means."""
    found = case.once(_variation)
    if found is None or name not in found.p:
        return None
    most = case.settings.max_varying_percent
    changes = sorted(found.changes.get(name, []), key=lambda change: -change.percent)
    if not changes or not changes[0].percent > most:
        return Look(changes[0].percent if changes else 0.0, most, False, p=found.p[name])
    first, *more = (change for change in changes if change.percent > most)
    others = [PARAMETERS[change.parameter].symbol for change in more]
    facts = {**first.facts, "others": also(others)}
    variant = ""
    if name == WITH_ANGLE and (terms := terms_found(case)):
        facts["terms"], variant = terms, "with_term"
    return Look(first.percent, most, True, facts, variant, p=found.p[name])


VARYING_CHECKS = tuple(
    Check(name, (), partial(_look, name=name))
    for name in ("varying_with_time", WITH_ANGLE, "varying_with_phase")
)
"""The checks of a joint that varies within an epoch."""
