"""What follows the perturbation and is not J, B and K: a friction, a reflex, a soft cuff, a lag.

The residual R of the torque, at the J, B and K that the perturbation gives, holds noise, which is
independent of the perturbation, and what the model lacks. Tests tell them apart in three parts of
the band. R and the simulated response P are divided by the root of the residual's smooth power, and
lines are turned so that P has phase zero. A slow drift of the torque, which would make all lines
alike, is taken from R first, and a line that stands out, as of a hum, counts by its own power.

What answers the perturbation in proportion. With one complex factor h_g in each group of n_g
neighbouring lines, R = h_g P + noise, over all epochs, whatever their sequences,

    F = Σ_g |h_g|² Σ|P|² / (2G) ÷ Σ_g Σ|R − h_g P|² / (2 Σ_g (n_g − 1))

has Fisher's distribution with 2G and 2 Σ (n_g − 1) degrees of freedom if there is noise alone.

What comes again with the sequence, in proportion or not: friction answers so too. Over E epochs or
periods of one sequence, with residuals R_e at m lines,

    F = E Σ |R̄|² / (2m) ÷ Σ_e Σ |R_e − R̄|² / (2m (E − 1))

has Fisher's distribution with 2m and 2m (E − 1) degrees of freedom. Within one epoch of whole
periods their mean is in the lines that they have in common and their differences in the others,
and ln |R|² of the ones is compared with that of the others beside them.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import scipy
from numpy.polynomial import Legendre
from numpy.typing import NDArray

from rigidimeter.analysis.estimation.closedloop.grid import Grid
from rigidimeter.analysis.estimation.closedloop.line_noise import Smoother
from rigidimeter.analysis.estimation.closedloop.normal_equations import Problem, solution, sums
from rigidimeter.analysis.estimation.closedloop.observation import Observation
from rigidimeter.analysis.estimation.signals import Array

Complex = NDArray[np.complex128]

SPLIT = (0.25, 0.5)
"""The band is tested in three parts, divided at these shares of its upper edge."""

SMOOTHED = 4
"""Lines to each side over which the power of the residual is averaged at least."""

OUTSTANDING = 2.0
"""A line with more than so many times the power around it is divided by that many of its own. Of
lines of Gaussian noise 14 % are: limited alike in every epoch, they change no probability."""

TREND = 3
"""Degree of the drift within an epoch."""

GROUP_LINES, GROUP_SHARE = 8, 0.15
"""A group has at least so many lines, and reaches over this share of its frequency: what a joint,
a cuff or a reflex of 60 ms answers changes little within it."""

LOG_VARIANCE = np.pi**2 / 6
"""Of the logarithm of the power of a line of Gaussian noise."""

SAME_RESPONSE = 0.98
"""Responses with this correlation, once turned by a delay, are those to one sequence."""

SAME_FREQUENCY = 0.1
"""Lines of two epochs within this share of their spacing are the same lines."""

LARGEST_SHIFT = 0.02
"""Epochs of one sequence may begin this share of their length apart in it."""


class Answer(NamedTuple):
    """What the perturbation causes in an epoch, or in a period of one, and what is left.

    Attributes
    ----------
    observation : Observation
    response_nm, residual_nm : complex array, shape (m,)
        The torque that the perturbation causes, simulated, and the torque that J, B and K leave.
    """

    observation: Observation
    response_nm: Complex
    residual_nm: Complex

    @property
    def grid(self) -> Grid:
        """Of the lines."""
        return self.observation.grid

    @property
    def frequency_hz(self) -> Array:
        """Of the lines, shape (m,)."""
        return np.asarray(self.grid.omega_rad_s / (2 * np.pi))


class Misfit(NamedTuple):
    """One test of one part of the band.

    Attributes
    ----------
    low_hz, high_hz : float
    share : float
        Of the torque that answers the perturbation, what the model does not explain, less what
        noise would leave.
    p : float
        Probability of as much from noise alone.
    """

    low_hz: float
    high_hz: float
    share: float
    p: float


def proportional(answers: Sequence[Answer]) -> list[Misfit]:
    """Return what answers the perturbation in proportion, in each part of the band."""
    answers = _without_drift(answers)
    frequency = np.concatenate([answer.frequency_hz for answer in answers])
    order = np.argsort(frequency, kind="stable")
    frequency, power = frequency[order], np.concatenate(list(map(_power, answers)))[order]
    response = np.concatenate([answer.response_nm for answer in answers])[order]
    residual = np.concatenate([answer.residual_nm for answer in answers])[order]
    edges = np.searchsorted(frequency, _group_edges(answers[0].frequency_hz))
    starts, sizes = edges[:-1], np.diff(edges)
    of_each = np.abs(response) ** 2 / power
    excited = np.add.reduceat(of_each, starts)
    factor = np.add.reduceat(response.conj() * residual / power, starts) / excited
    answered = np.abs(factor) ** 2 * excited
    left = np.maximum(np.add.reduceat(np.abs(residual) ** 2 / power, starts) - answered, 0.0)
    found = []
    for part in _parts(frequency[starts], answers[0].frequency_hz[-1]):
        numerator, denominator = 2 * part.size, 2 * int(np.sum(sizes[part] - 1))
        noise = float(np.sum(left[part])) / denominator
        p = scipy.stats.f.sf(np.sum(answered[part]) / numerator / noise, numerator, denominator)
        # The mean of |h|², less what noise leaves: groups count by how well h is known in them, or
        # a tremor in one would be the mean.
        beyond = float(np.sum(answered[part])) - numerator * noise
        whole = np.abs(1.0 + factor[part]) ** 2 * excited[part]
        share = float(np.sqrt(max(beyond, 0.0) / np.sum(whole)))
        last = frequency[starts[part[-1]] + sizes[part[-1]] - 1]
        found.append(Misfit(float(frequency[starts[part[0]]]), float(last), share, float(p)))
    return found


def repeated(answers: Sequence[Answer]) -> list[Misfit]:
    """Return what comes again with the sequence, in each part of the band.

    Parameters
    ----------
    answers : sequence of Answer
        At least two, to one sequence, as `same_sequence` says.
    """
    count = len(answers)
    answers = _without_drift(answers)
    turned = np.stack([one.residual_nm * toward_zero_phase(one.response_nm) for one in answers])
    power = np.stack([_power(answer) for answer in answers])
    white = turned / np.sqrt(power)
    mean, frequency = white.mean(0), answers[0].frequency_hz
    scatter = np.sum(np.abs(white - mean) ** 2, axis=0) / (count - 1)
    at_zero = [answer.response_nm * toward_zero_phase(answer.response_nm) for answer in answers]
    size = np.abs(np.mean(at_zero, axis=0) + np.mean(turned, axis=0)) ** 2
    found = []
    for part in _parts(frequency, frequency[-1]):
        m = part.size
        between = count * float(np.sum(np.abs(mean[part]) ** 2)) / (2 * m)
        within = float(np.sum(scatter[part])) / (2 * m)
        if within == 0.0:
            continue  # copies of one epoch
        p = scipy.stats.f.sf(between / within, 2 * m, 2 * m * (count - 1))
        own = np.mean(power[:, part], axis=0)
        beyond = np.sum((np.abs(mean[part]) ** 2 - scatter[part] / count) * own)
        share = float(np.sqrt(max(beyond, 0.0) / np.sum(size[part])))
        found.append(Misfit(float(frequency[part[0]]), float(frequency[part[-1]]), share, float(p)))
    return found


def same_sequence(answers: Sequence[Answer]) -> list[list[Answer]]:
    """Return the answers by sequence: those whose responses differ by a short delay alone."""
    groups: list[list[Answer]] = []
    for answer in answers:
        same = next((group for group in groups if _one_sequence(group[0], answer)), None)
        if same is None:
            groups.append([answer])
        else:
            same.append(answer)
    return groups


def _one_sequence(first: Answer, second: Answer) -> bool:
    a, b = first.frequency_hz, second.frequency_hz
    if a.size != b.size or np.max(np.abs(a - b)) > SAME_FREQUENCY * (a[1] - a[0]):
        return False
    size = float(np.linalg.norm(first.response_nm) * np.linalg.norm(second.response_nm))
    together = first.response_nm * second.response_nm.conj()
    if abs(np.vdot(first.response_nm, second.response_nm)) > SAME_RESPONSE * size:
        return True
    # One line per 1/T: the transform over the lines is a search over delays within the epoch.
    count = 8 * a.size
    shifted = np.abs(np.fft.fft(together, count))
    at = int(np.argmax(shifted))
    part = min(at, count - at) / count
    return bool(shifted[at] > SAME_RESPONSE * size and part < LARGEST_SHIFT)


def toward_zero_phase(response: Complex) -> Complex:
    """Return what turns each line so that the response has phase zero in it."""
    size = np.abs(response)
    return np.asarray(np.where(size > 0, response.conj() / np.where(size > 0, size, 1.0), 1.0))


def _without_drift(answers: Sequence[Answer]) -> list[Answer]:
    """Return the answers without what a polynomial in time adds to the residual."""
    found = []
    shapes: dict[int, Complex] = {}
    for answer in answers:
        grid = answer.grid
        if id(grid.line) not in shapes:  # epochs of one layout have the same
            along = np.linspace(-1.0, 1.0, grid.time_s.size)
            drifts = [Legendre.basis(degree)(along) for degree in range(1, TREND + 1)]
            shapes[id(grid.line)] = grid.transform(np.stack(drifts)).T
        shape, steady = shapes[id(grid.line)], answer
        drift = Problem(shape, shape, answer.residual_nm, answer.observation)
        for _ in range(2):  # the drift is in the first weights
            gram, moment, _ = sums([drift], [_power(steady)])
            left_nm = answer.residual_nm - shape @ solution(gram, moment)
            steady = answer._replace(residual_nm=left_nm)
        found.append(steady)
    return found


def _power(answer: Answer) -> Array:
    """Return the smooth power of what is left."""
    smoother = Smoother.over(answer.grid.line, SMOOTHED, 0.1)
    own = np.abs(answer.residual_nm) ** 2
    power = np.maximum(smoother(own), own / OUTSTANDING)
    return np.maximum(power, 1e-24 * float(np.max(np.abs(answer.response_nm) ** 2)))


def _group_edges(frequency_hz: Array) -> Array:
    """Return where the groups of lines begin and end, in Hz."""
    spacing = frequency_hz[1] - frequency_hz[0]
    edges = [float(frequency_hz[0])]
    while edges[-1] < frequency_hz[-1]:
        edges.append(edges[-1] + max(GROUP_LINES * spacing, GROUP_SHARE * edges[-1]))
    # The last group takes what is left over.
    return np.array([-np.inf, *(edge - spacing / 2 for edge in edges[1:-2]), np.inf])


def _parts(frequency_hz: Array, highest_hz: float) -> Iterator[NDArray[np.intp]]:
    edges = [0.0, *(share * highest_hz for share in SPLIT), np.inf]
    for low, high in pairwise(edges):
        part = np.flatnonzero((frequency_hz >= low) & (frequency_hz < high))
        if part.size:
            yield part


def periodic(answer: Answer, excited: NDArray[np.bool_]) -> list[Misfit]:
    """Return what comes again in each period of one epoch, in each part of the band.

    Under noise ln |R|² of a line, less the mean of its two neighbours, has the mean 0, also where
    the spectrum is steep, and a tremor at one line counts little.

    Parameters
    ----------
    answer : Answer
        Of whole periods, two at least.
    excited : array of bool, shape (m,)
        The lines that periods have in common; the others are their differences.
    """
    power = np.abs(answer.residual_nm) ** 2
    if not np.all(power > 0):
        return []
    inner = np.arange(1, power.size - 1)
    common = inner[excited[inner] & ~excited[inner - 1] & ~excited[inner + 1]]
    found = []
    for part in _parts(answer.frequency_hz[common], answer.frequency_hz[-1]):
        lines = common[part]
        below, above = np.log(power[lines - 1]), np.log(power[lines + 1])
        excess = float(np.sum(np.log(power[lines]) - 0.5 * (below + above)))
        # A line between two excited ones counts for both.
        times = np.bincount(np.concatenate([lines - 1, lines + 1]))
        variance = LOG_VARIANCE * (lines.size + float(np.sum((0.5 * times) ** 2)))
        beside = 0.5 * (power[lines - 1] + power[lines + 1])
        size = float(np.sum(np.abs(answer.response_nm[lines]) ** 2))
        share = float(np.sqrt(max(float(np.sum(power[lines] - beside)), 0.0) / size))
        low, high = answer.frequency_hz[lines[[0, -1]]]
        p = float(scipy.stats.norm.sf(excess / np.sqrt(variance)))
        found.append(Misfit(float(low), float(high), share, p))
    return found
