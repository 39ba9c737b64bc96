"""What several rows share, made when the first of them asks for it.

The recordings of the animal were never published. What needs them is shown with a virtual study of
the paper's design and sizes instead, and says so.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Mapping
from functools import cached_property
from pathlib import Path
from typing import Any, TypeVar

from rigidimeter.analysis.study import StudyResult, analyse, conclude_study, load_study
from rigidimeter.analysis.traces import Prepared, prepared_epochs
from rigidimeter.core.errors import UserError
from rigidimeter.core.files import read_json, write_json
from rigidimeter.core.settings import Settings
from rigidimeter.core.version import __version__
from rigidimeter.virtual import PAPER, StudyDesign, plan_study, study_length_s, write_virtual_study

DEFAULT_SEED = 2023

T = TypeVar("T")

MADE = "made.json"
"""Says which design, seed and version a virtual study was made of."""


class Context:
    """The seed, the sizes, and the virtual study with its analysis.

    Parameters
    ----------
    seed : int
        Of everything random.
    runs : int
        Simulations of Sec. 3.4; the paper made 100.
    pooled_epochs : int
        Epochs with voluntary torque that are estimated together.
    design : StudyDesign
        Of the virtual study.
    folder : Path, optional
        Where the virtual study is written and kept, or read if it is there. Without one it goes to
        a temporary folder that is removed once it was analysed.
    processes : int
        Sessions of the study that run side by side.
    progress : callable
        Takes the share of the virtual study that is done, from 0 to 1.
    """

    def __init__(
        self,
        seed: int = DEFAULT_SEED,
        *,
        runs: int = 100,
        pooled_epochs: int = 10,
        design: StudyDesign = PAPER,
        folder: Path | None = None,
        processes: int = 2,
        progress: Callable[[float], None] = lambda _: None,
    ) -> None:
        self.seed = seed
        self.runs = runs
        self.pooled_epochs = pooled_epochs
        self.design = design
        self._folder = folder
        self._processes = processes
        self._progress = progress
        self._made: dict[Callable[[Context], Any], Any] = {}

    def once(self, make: Callable[[Context], T]) -> T:
        """Return what `make` gives for this context; it is made for the first row that asks."""
        if make not in self._made:
            self._made[make] = make(self)
        found: T = self._made[make]
        return found

    @cached_property
    def settings(self) -> Settings:
        """The defaults: the paper's values where it prints one."""
        return Settings(seed=self.seed)

    @property
    def counts(self) -> Mapping[str, Mapping[str, int]]:
        """Epochs by task, and ratings, of the virtual study, by condition."""
        counted: dict[str, dict[str, int]] = {"ratings": {}, "sinusoid": {}, "prbs": {}}
        for plan in plan_study(self.design, self.seed):
            made = [("ratings", len(plan.ratings))]
            made += [(block.task, block.epochs) for block in plan.settings.protocol.blocks]
            for task, count in made:
                counted[task][plan.condition] = counted[task].get(plan.condition, 0) + count
        return counted

    @property
    def study(self) -> StudyResult:
        """The virtual study, compared and concluded: rank-sum tests, tests by days, and ratings.

        Raises
        ------
        UserError
            If the folder holds another seed, design or version, or an unfinished study.
        """
        return self._read[0]

    @property
    def prepared(self) -> Prepared:
        """The epochs of the virtual study as they were analysed."""
        return self._read[1]

    @cached_property
    def _read(self) -> tuple[StudyResult, Prepared]:
        if self._folder is not None:
            return self._read_from(self._folder)
        with tempfile.TemporaryDirectory() as place:
            return self._read_from(Path(place) / "virtual-study")

    def _read_from(self, folder: Path) -> tuple[StudyResult, Prepared]:
        wanted = {"design": self.design.name, "seed": self.seed, "rigidimeter": __version__}
        made = folder / MADE
        if made.is_file():
            found = read_json(made)
            if found != wanted:
                raise UserError(
                    f"{folder}: is the virtual study {_named(found)}, not {_named(wanted)}; name "
                    "another folder"
                )
        else:
            length_s = study_length_s(plan_study(self.design, self.seed))
            write_virtual_study(
                folder,
                self.design,
                self.seed,
                processes=self._processes,
                progress=lambda time_s: self._progress(time_s / length_s),
            )
            write_json(made, wanted)
        loaded = load_study(folder)
        study = analyse(loaded)
        prepared = prepared_epochs(loaded.epochs, study.analysis, study.settings)
        return conclude_study(study, resamples=0), prepared


def _named(made: Mapping[str, object]) -> str:
    return (
        f"of design {made.get('design')}, seed {made.get('seed')}, "
        f"version {made.get('rigidimeter')}"
    )
