"""The drive of so many poles and zeros that explains the velocity best, and those near it.

Neighbours are moved by two standard errors along each axis of the covariance of place and
numerator,

    C = (G'G)⁻¹ G' <e e'> G (G'G)⁻¹

with G the slopes of the velocity and e what is left of it (`uncertainty.hac_covariance`). At few
samples a tick constant one axis is long: delay, fastest pole and numerator change together, hardly
the velocity at the samples, and the acceleration between them a lot.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import scipy

from rigidimeter.analysis.estimation.closedloop.drive_answer import (
    LONGEST_S,
    LONGEST_TICKS,
    FittedDrive,
    Samples,
    answer,
    drive_at,
    velocities,
)
from rigidimeter.analysis.estimation.signals import Array
from rigidimeter.analysis.estimation.uncertainty import hac_covariance
from rigidimeter.model import DriveModel

STANDARD_ERRORS = 2.0
"""A delay is there if it is longer than so many, and neighbours are so many away."""

SHORT = 0.25
"""In ticks: the shortest delay that a search begins with."""

MOST_TRIES = 80
"""Steps of a search; one that takes longer is on its way to poles without an end."""

STEP = 1e-4
"""Of a coordinate, for its slope."""

CURVED, LONG, HALVINGS = 2.0, 5.0, 8
"""A move that changes the velocity by more times what the slopes say is too long, and so is one of
more than this of a coordinate; it is halved so often."""

RUBBED = 4.0
"""With friction a drive that leaves so many times the power explains as well: poles and delay are
bent to what the law of friction leaves."""


def power_of(one: FittedDrive) -> float:
    """Return what a drive leaves, to compare drives by."""
    return one.power


def best_drive(samples: Samples, begins: Sequence[Array], zeros: int) -> FittedDrive:
    """Return the drive that explains the velocity best, with a delay only where one is shown.

    `begins` are coordinates of poles at which the search starts.
    """
    places = [np.append(begin, 0.0) for begin in begins]
    still = min((searched(samples, x, zeros, delayed=False) for x in places), key=power_of)
    matrix, covariance = _scatter(still)
    delay = still.place.size - 1
    step = np.linalg.lstsq(matrix, -still.left)[0][delay]
    if step <= STANDARD_ERRORS * math.sqrt(max(covariance[delay, delay], 0.0)):
        return still
    longest = max(LONGEST_S / samples.interval_s, LONGEST_TICKS)
    places = [np.append(still.place[:-1], ticks) for ticks in np.geomspace(SHORT, longest, 12)]
    begin = min((answer(samples, place, zeros) for place in places), key=power_of)
    late = searched(samples, begin.place, zeros, delayed=True)
    if samples.sign is None:
        shown = 1.0 - STANDARD_ERRORS**2 / samples.measured.size
    else:
        shown = 1.0 / RUBBED
    return late if late.place[-1] > 0.0 and late.power < shown * still.power else still


def searched(samples: Samples, begin: Array, zeros: int, *, delayed: bool) -> FittedDrive:
    """Return the best drive near a place, whose delay is searched too or stays."""
    free = begin.size if delayed else begin.size - 1

    def at(x: Array) -> FittedDrive:
        return answer(samples, np.append(x, begin[free:]), zeros)

    def left(x: Array) -> Array:
        return at(x).left

    found, *_ = scipy.optimize.leastsq(
        left,
        begin[:free],
        full_output=True,
        epsfcn=STEP**2,
        ftol=1e-6,
        xtol=1e-6,
        maxfev=MOST_TRIES,
    )
    return at(found)


def _scatter(one: FittedDrive) -> tuple[Array, Array]:
    """Return the slopes of the velocity along place and numerator, and the covariance of these."""
    explained = one.numerator @ one.table
    steps = STEP * np.eye(one.place.size)
    moved = [one.numerator @ velocities(one.samples, one.place + by, one.zeros) for by in steps]
    matrix = np.column_stack([*((there - explained) / STEP for there in moved), *one.table])
    size = _lengths(matrix)
    _, singular, right = np.linalg.svd(matrix / size, full_matrices=False)
    shown = singular > np.finfo(np.float64).eps * singular[0]  # one at its limit changes nothing
    inverse = right[shown].T / singular[shown]
    scores = matrix / size * one.left[:, None]
    scaled = hac_covariance(inverse @ inverse.T, scores).covariance
    return matrix, scaled / np.outer(size, size)


def _lengths(matrix: Array) -> Array:
    """Return the lengths of the columns, 1 for one without any."""
    lengths = np.linalg.norm(matrix, axis=0)
    return np.asarray(np.where(lengths > 0, lengths, 1.0))


def neighbours(one: FittedDrive) -> list[DriveModel]:
    """Return the drive moved by two standard errors either way along each axis of its covariance.

    A move is halved until it changes the velocity about as its slopes say, and leaves no delay
    below zero.
    """
    matrix, covariance = _scatter(one)
    size = _lengths(matrix)
    variances, axes = np.linalg.eigh(covariance * np.outer(size, size))
    explained, p = one.numerator @ one.table, one.place.size
    found = []
    for variance, axis in zip(variances, axes.T, strict=True):
        longest = STANDARD_ERRORS * math.sqrt(max(variance, 0.0)) * axis / size
        most = CURVED * np.linalg.norm(matrix @ longest)
        for move in (longest, -longest):
            for halved in range(HALVINGS):
                by = move / 2**halved
                place, numerator = one.place + by[:p], one.numerator + by[p:]
                if place[-1] < 0.0 or np.max(np.abs(by[:p])) > LONG:
                    continue
                velocity = numerator @ velocities(one.samples, place, one.zeros)
                if np.linalg.norm(velocity - explained) <= most:
                    found.append(drive_at(one.samples, place, numerator[: one.zeros + 1]))
                    break
    return found
