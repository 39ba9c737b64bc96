"""The drives near the one that was identified, which the samples cannot tell from it.

Coordinates x and numerator n of a drive have the covariance of nonlinear least squares,

    C = (G'G)⁻¹ G' <e e'> G (G'G)⁻¹

with G the slopes of the velocity along x and n, and e what the drive leaves of it, of any colour
(`uncertainty.hac_covariance`). The drive moved by two standard errors along an axis of C explains
the velocity nearly as well. At few samples a tick constant one axis is long: delay, fastest pole
and numerator change together, hardly the velocity at the samples, and the acceleration between
them a lot.
"""

from __future__ import annotations

import numpy as np

from rigidimeter.analysis.estimation.closedloop.drive_terms import (
    Fitted,
    Samples,
    Terms,
    acting_on,
    coordinates_of,
    terms_of,
)
from rigidimeter.analysis.estimation.signals import Array
from rigidimeter.analysis.estimation.uncertainty import hac_covariance
from rigidimeter.model import DriveModel

STANDARD_ERRORS = 2.0

STEP = 1e-4
"""Of a coordinate, for its slope; of the delay, forward from none, in ticks."""

CURVED = 2.0
"""A move that changes the velocity by more times what the slopes say is too long."""

LONGEST = 5.0
"""Of a coordinate: poles that are not known to a factor of e to this are not known."""

HALVINGS = 8


def as_likely(samples: Samples, fitted: Fitted) -> tuple[DriveModel, ...]:
    """Return the drive moved by two standard errors either way along each axis of its covariance.

    A move is halved until it changes the velocity about as its slopes say, and leaves no delay
    below zero.
    """
    measured, structure = samples.measured / samples.scale, fitted.structure
    place = coordinates_of(structure, fitted.model, samples.interval_s)
    inputs = acting_on(samples, structure, samples.time_s)
    terms = terms_of(inputs, structure, place, samples.interval_s)
    numerator = terms.numerator(measured)
    explained = numerator @ terms.table

    def moved(by: Array) -> tuple[Terms, Array]:
        there = terms_of(inputs, structure, place + by[: place.size], samples.interval_s)
        return there, numerator + by[place.size :]

    along = np.eye(place.size) * STEP
    steps = [numerator @ terms_of(inputs, structure, place + by, samples.interval_s).table
             for by in along]  # fmt: skip
    slopes = np.column_stack([*(np.array(steps) - explained) / STEP, *terms.table])
    size = np.linalg.norm(slopes, axis=0)
    if not np.all(size > 0):
        return ()
    slopes /= size
    _, singular, right = np.linalg.svd(slopes, full_matrices=False)
    inverse = right.T / singular
    scores = slopes * (measured - explained)[:, None]
    covariance = hac_covariance(inverse @ inverse.T, scores).covariance
    variances, axes = np.linalg.eigh(covariance)
    found = []
    for variance, axis in zip(variances, axes.T, strict=True):
        longest = STANDARD_ERRORS * np.sqrt(max(variance, 0.0)) * axis
        most = CURVED * np.linalg.norm(slopes @ longest)
        for move in (longest / size, -longest / size):
            for halved in range(HALVINGS):
                by = move / 2**halved
                coordinates = place + by[: place.size]
                if coordinates[-1] < 0.0 or np.max(np.abs(coordinates - place)) > LONGEST:
                    continue
                there, numbers = moved(by)
                if np.linalg.norm(numbers @ there.table - explained) <= most:
                    found.append(there.fitted(structure, samples, numbers, fitted.power).model)
                    break
    return tuple(found)
