"""Where virtual data come from: a study of the paper's design and sizes, with a subject of ours.

The measured data of the animal were never published. What needs them is shown with a virtual
subject instead, and says so: `rigidimeter.virtual` runs its sessions on the virtual rig and states
what it assumes. They prove nothing about the animal.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from rigidimeter.documents import read_json, write_json
from rigidimeter.errors import UserError
from rigidimeter.recording import read_session
from rigidimeter.records import Epoch
from rigidimeter.settings import Settings
from rigidimeter.version import __version__
from rigidimeter.virtual.study_design import StudyDesign
from rigidimeter.virtual.study_plan import DayPlan, plan_study
from rigidimeter.virtual.virtual_study import write_virtual_study

__all__ = ["Rating", "VirtualStudy", "counts_of", "virtual_study"]

MADE = "made.json"
"""Says which design, seed and version a virtual study was made of."""


class Rating(NamedTuple):
    """One score of one examiner on one day."""

    condition: str
    examiner: str
    day: str
    score: float


@dataclass(frozen=True)
class VirtualStudy:
    """Epochs and ratings of both conditions.

    Attributes
    ----------
    settings : Settings
        Those of the first session; the others have another subject, seed and protocol.
    epochs : tuple of Epoch
        Of all sessions, in the order in which they were run.
    days : mapping of str to str
        The day of each source.
    ratings : tuple of Rating
    """

    settings: Settings
    epochs: tuple[Epoch, ...]
    days: Mapping[str, str]
    ratings: tuple[Rating, ...]


def virtual_study(
    folder: Path,
    design: StudyDesign,
    seed: int,
    *,
    processes: int = 2,
    progress: Callable[[float], None] = lambda _: None,
) -> VirtualStudy:
    """Return the virtual study in a folder, made if it is not there yet.

    Parameters
    ----------
    folder : Path
        A study folder, to be read by ``rigidimeter compare`` as well.
    design : StudyDesign
    seed : int
        Of everything random.
    processes : int
        Sessions that run side by side.
    progress : callable
        As `write_virtual_study`.

    Raises
    ------
    UserError
        If the folder holds something else: another seed, design or version, or an unfinished study.
    """
    wanted = {"design": design.name, "seed": seed, "rigidimeter": __version__}
    made = folder / MADE
    if made.is_file():
        found = read_json(made)
        if found != wanted:
            raise UserError(
                f"{folder}: is the virtual study {_named(found)}, not {_named(wanted)}; name "
                "another folder"
            )
        plans = plan_study(design, seed)
    else:
        plans = write_virtual_study(folder, design, seed, processes=processes, progress=progress)
        write_json(made, wanted)
    epochs: list[Epoch] = []
    days: dict[str, str] = {}
    for plan in plans:
        found_epochs, _ = read_session(folder / plan.folder)
        epochs += found_epochs
        days |= {epoch.source: plan.day for epoch in found_epochs}
    ratings = tuple(
        Rating(plan.condition, rating.examiner, plan.day, rating.score)
        for plan in plans
        for rating in plan.ratings
    )
    return VirtualStudy(plans[0].settings, tuple(epochs), days, ratings)


def counts_of(plans: Sequence[DayPlan]) -> dict[str, dict[str, int]]:
    """Return epochs by task and ratings, by condition."""
    counted: dict[str, dict[str, int]] = {"ratings": {}, "sinusoid": {}, "prbs": {}}
    for plan in plans:
        name = plan.condition
        counted["ratings"][name] = counted["ratings"].get(name, 0) + len(plan.ratings)
        for block in plan.settings.protocol.blocks:
            counted[block.task][name] = counted[block.task].get(name, 0) + block.epochs
    return counted


def _named(made: Mapping[str, object]) -> str:
    return (
        f"of design {made.get('design')}, seed {made.get('seed')}, "
        f"version {made.get('rigidimeter')}"
    )
