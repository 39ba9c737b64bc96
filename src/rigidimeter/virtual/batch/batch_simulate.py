"""Run many epochs, each from a seed of its own, on as many threads as wanted.

Epoch i draws from child i of the seed (`numpy.random.SeedSequence.spawn`), whatever the number of
epochs, the size of a chunk or the number of workers: any epoch can be had again alone.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from rigidimeter.core.errors import UserError
from rigidimeter.core.settings import Settings, SubjectSettings
from rigidimeter.model import JointDynamics
from rigidimeter.planning import prbs_nm
from rigidimeter.virtual.batch.batch_rig import bench, draw_inputs
from rigidimeter.virtual.batch.batch_run import (
    Batch,
    batch_of,
    empty_rows,
    perturbation_rows,
    run_row,
)

CHUNK = 32
"""Epochs held at once: about 50 MB of 20 s epochs at 1 kHz."""


def epoch_generator(seed: int, number: int) -> np.random.Generator:
    """Return the generator of one epoch, counted from 0."""
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(number,)))


def simulate_epochs(settings: Settings, n_epochs: int, **options: Any) -> Batch:
    """Simulate PRBS epochs and return them together; the options are those of `simulate_chunks`."""
    (batch,) = simulate_chunks(settings, n_epochs, chunk=n_epochs, **options)
    return batch


def simulate_chunks(
    settings: Settings,
    n_epochs: int,
    *,
    chunk: int = CHUNK,
    perturbation_nm: ArrayLike | None = None,
    joints: Sequence[JointDynamics] | None = None,
    conditions: str | Sequence[str] | None = None,
    subjects: Sequence[SubjectSettings] | None = None,
    seed: int | None = None,
    first: int = 0,
    workers: int = 1,
    progress: Callable[[int], None] = lambda _: None,
) -> Iterator[Batch]:
    """Simulate PRBS epochs and yield them a chunk at a time, so that memory stays as it is.

    Each epoch starts from rest on a rig of its own, and is to the bit what the loop would record on
    a `SimulatedRig` with the generator `epoch_generator(seed, number)`.

    Parameters
    ----------
    settings : Settings
    n_epochs : int
    chunk : int
        Epochs to yield at a time; the results do not depend on it.
    perturbation_nm : array, shape (ticks,) or (n_epochs, ticks), optional
        One for all epochs or one each, in N·m; that of `settings.prbs` if not given.
    joints : sequence of JointDynamics, optional
        One an epoch; drawn from the subject if not given.
    conditions : str or sequence of str, optional
        Of all epochs or of each; the first of `settings.subject` if not given.
    subjects : sequence of SubjectSettings, optional
        One an epoch; those of the conditions if not given.
    seed : int, optional
        `settings.seed` if not given.
    first : int
        Number of the first epoch; that of ``simulate_epochs(..., 1, first=7)`` is the eighth of a
        longer run.
    workers : int
        Threads; the results do not depend on it.
    progress : callable
        Takes how many epochs are done.

    Raises
    ------
    UserError
        If a condition has no subject.
    ValueError
        If a count is below 1 or what is given has not one entry for each epoch.
    """
    if n_epochs < 1 or first < 0:
        raise ValueError(f"need at least 1 epoch from number 0 on, got {n_epochs} from {first}")
    if chunk < 1 or workers < 1:
        raise ValueError(f"chunk and workers must be at least 1, got {chunk} and {workers}")
    if conditions is None:
        conditions = next(iter(settings.subject))
    names = [conditions] * n_epochs if isinstance(conditions, str) else conditions
    for what, given in (("joints", joints), ("conditions", names), ("subjects", subjects)):
        if given is not None and len(given) != n_epochs:
            raise ValueError(f"{n_epochs} epochs need as many {what}, got {len(given)}")
    whose = _subjects(settings, names) if subjects is None else subjects
    if perturbation_nm is None:
        perturbation_nm = prbs_nm(settings.prbs, settings.rig.tick_rate_hz)
    perturbation = perturbation_rows(perturbation_nm, n_epochs)
    rig = bench(settings, perturbation.shape[1])
    root = settings.seed if seed is None else seed

    def run_chunk(start: int, stop: int, pool: ThreadPoolExecutor) -> Batch:
        """Run the epochs of one chunk; each is a row that no other thread writes."""
        rows = empty_rows(stop - start, rig)

        def run(i: int) -> JointDynamics:
            joint = None if joints is None else joints[i]
            inputs = draw_inputs(rig, whose[i], epoch_generator(root, first + i), joint)
            run_row(rows, i - start, rig, perturbation[i], inputs)
            return inputs.joint

        found = []
        for done, joint in enumerate(pool.map(run, range(start, stop)), start=start + 1):
            found.append(joint)
            progress(done)
        return batch_of(
            rows,
            rig,
            perturbation[start:stop],
            found,
            names[start:stop],
            source=f"batch of seed {root}",
            first=first + start,
        )

    def chunks() -> Iterator[Batch]:
        with ThreadPoolExecutor(workers) as pool:
            for start in range(0, n_epochs, chunk):
                yield run_chunk(start, min(start + chunk, n_epochs), pool)

    return chunks()


def _subjects(settings: Settings, conditions: Sequence[str]) -> list[SubjectSettings]:
    for name in conditions:
        if name not in settings.subject:
            known = ", ".join(sorted(settings.subject))
            raise UserError(f"there is no [subject.{name}]; known conditions: {known}")
    return [settings.subject[name] for name in conditions]
