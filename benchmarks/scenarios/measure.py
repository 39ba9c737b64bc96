"""Analyse the recordings of a scenario, and keep of each what a row of the table needs."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import groupby
from typing import Any

import numpy as np
from tests.scenarios.catalogue import SCENARIOS
from tests.scenarios.recordings import measured_alone

from rigidimeter.analysis.estimation import estimate_recorded, prepare
from rigidimeter.core.executor import each
from rigidimeter.core.records import Analysis, Epoch, Fit

EPOCHS = 4
METHODS = {"iv": "iv", "bandlimited": "bandlimited", "blind": "bandlimited"}
"""What is asked for, and the estimator: ``blind`` has torque and motion alone."""

Kept = dict[str, Any]
"""One recording by one method: the truth, its fits, the pooled fit."""


def measure(
    numbers: Mapping[str, range], methods: Sequence[str], jobs: int
) -> Iterator[tuple[str, dict[str, list[Kept]]]]:
    """Yield each scenario with its recordings by method, a scenario at a time.

    Parameters
    ----------
    numbers : mapping of str to range
        The recordings of each scenario; a number always gives the same one.
    methods : sequence of str
    jobs : int
        Processes.
    """
    tasks = [(name, number, tuple(methods)) for name in numbers for number in numbers[name]]
    done = each(_one, tasks, jobs=jobs, in_order=True)
    for name, own in groupby(done, lambda one: one[0][0]):
        both = [found for _, found in own]
        yield name, {method: [found[method] for found in both] for method in methods}


def _one(task: tuple[str, int, tuple[str, ...]]) -> dict[str, Kept]:
    """Simulate one recording and analyse it by each method."""
    name, number, methods = task
    scenario = SCENARIOS[name]
    epochs, truth = scenario.simulated(number, EPOCHS)
    settings = scenario.analysed_with()
    known = prepare(epochs, settings)
    found = {}
    for method in methods:
        own = known if method != "blind" else prepare(seen_by(method, epochs), settings)
        with np.errstate(all="ignore"):
            found[method] = kept(truth.tolist(), estimate_recorded(own, METHODS[method]))
    return found


def seen_by(method: str, epochs: Iterable[Epoch]) -> list[Epoch]:
    """Return the epochs with the channels that a method is given."""
    return [measured_alone(epoch) if method == "blind" else epoch for epoch in epochs]


def kept(truth: list[list[float]], analysis: Analysis) -> Kept:
    """Return what a row of the table needs of one recording by one method."""
    return {
        "truth": truth,
        "fits": [_fit(fit) for fit in analysis.fits],
        "pooled": [_fit(fit) for fit in analysis.pooled],
    }


def _fit(fit: Fit) -> Kept:
    """Return the numbers of a fit, and what casts doubt on it."""
    doubts = {finding.name for finding in fit.findings if finding.level != "note"}
    if not fit.outcome.included and not doubts:
        doubts.add(fit.outcome.kind)
    return {
        "value": _numbers(fit.value),
        "low": _numbers(fit.low),
        "high": _numbers(fit.high),
        "doubts": sorted(doubts),
    }


def _numbers(values: Iterable[float]) -> list[float | None]:
    """Return numbers as JSON holds them: none in place of what is not finite."""
    return [float(f"{value:.6g}") if math.isfinite(value) else None for value in values]
