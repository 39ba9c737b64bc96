"""What several rows share, made when the first of them asks for it."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Mapping
from functools import cached_property
from pathlib import Path

from rigidimeter.paper.virtual_data import VirtualStudy, counts_of, virtual_study
from rigidimeter.records import Analysis
from rigidimeter.settings import Settings
from rigidimeter.statistics import DayDifference, day_difference
from rigidimeter.study import MEASURES, Comparison, analyse, compare_analysis
from rigidimeter.virtual.study_design import PAPER, StudyDesign
from rigidimeter.virtual.study_plan import plan_study
from rigidimeter.virtual.virtual_study import study_length_s

__all__ = ["DEFAULT_SEED", "Workshop"]

DEFAULT_SEED = 2023


class Workshop:
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
        a temporary folder that is removed with the workshop.
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

    @cached_property
    def settings(self) -> Settings:
        """The defaults: the paper's values where it prints one."""
        return Settings(seed=self.seed)

    @property
    def counts(self) -> Mapping[str, Mapping[str, int]]:
        """Epochs by task, and ratings, of the virtual study, by condition."""
        return counts_of(plan_study(self.design, self.seed))

    @cached_property
    def study(self) -> VirtualStudy:
        """The virtual study, from its folder."""
        length_s = study_length_s(plan_study(self.design, self.seed))

        def reach(time_s: float) -> None:
            self._progress(time_s / length_s)

        if self._folder is not None:
            return self._study_in(self._folder, reach)
        with tempfile.TemporaryDirectory() as place:
            return self._study_in(Path(place) / "virtual-study", reach)

    def _study_in(self, folder: Path, progress: Callable[[float], None]) -> VirtualStudy:
        return virtual_study(
            folder, self.design, self.seed, processes=self._processes, progress=progress
        )

    @cached_property
    def analysis(self) -> Analysis:
        """Its epochs, estimated in two stages by the default method and scored."""
        return analyse(self.study.epochs, self.study.settings)

    @cached_property
    def _comparisons(self) -> Mapping[str, Comparison]:
        found = compare_analysis(self.analysis, "OFF", "DBS", resamples=0)
        return {each.measure.name: each for each in found.comparisons}

    def comparison(self, measure: str) -> Comparison:
        """Return one measure of the virtual study in OFF and DBS."""
        return self._comparisons[measure]

    def day_test(self, measure: str) -> DayDifference:
        """Return the test in which days count, OFF − DBS, of one measure."""
        results = next(m for m in MEASURES if m.name == measure).results(self.analysis)
        samples: dict[str, tuple[list[float], list[str]]] = {"OFF": ([], []), "DBS": ([], [])}
        for result in results:
            if result.outcome.included:
                values, days = samples[result.condition]
                values.append(float(getattr(result, measure)))
                days.append(self.study.days[result.source])
        (x, x_days), (y, y_days) = samples["OFF"], samples["DBS"]
        return day_difference(x, y, x_days, y_days, one_offset=True)  # so the study is made
