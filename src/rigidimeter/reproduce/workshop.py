"""What several rows share, made when the first of them asks for it."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property

from rigidimeter.records import Analysis
from rigidimeter.reproduce.printed import COUNTS
from rigidimeter.reproduce.virtual import VirtualStudy, virtual_study
from rigidimeter.settings import Settings
from rigidimeter.study import Comparison, analyse, compare

__all__ = ["DEFAULT_SEED", "Workshop"]

DEFAULT_SEED = 2023


class Workshop:
    """The seed, the sizes, and the virtual study with its analyses.

    Parameters
    ----------
    seed : int
        Of everything random.
    runs : int
        Simulations of Sec. 3.4; the paper made 100.
    pooled_epochs : int
        Epochs with voluntary torque that are estimated together.
    counts : mapping
        Sizes of the virtual study; those of Table 1 if not given.
    """

    def __init__(
        self,
        seed: int = DEFAULT_SEED,
        *,
        runs: int = 100,
        pooled_epochs: int = 10,
        counts: Mapping[str, Mapping[str, int]] = COUNTS,
    ) -> None:
        self.seed = seed
        self.runs = runs
        self.pooled_epochs = pooled_epochs
        self.counts = counts

    @cached_property
    def settings(self) -> Settings:
        """The defaults: the paper's values where it prints one."""
        return Settings(seed=self.seed)

    @cached_property
    def study(self) -> VirtualStudy:
        """The virtual study."""
        return virtual_study(self.seed, self.counts)

    @cached_property
    def fits(self) -> Analysis:
        """Its PRBS epochs, estimated in two stages by the default method."""
        return analyse(self.study.prbs, self.study.settings)

    @cached_property
    def scores(self) -> Analysis:
        """Its sinusoidal epochs, scored."""
        return analyse(self.study.sinusoid, self.study.settings)

    def comparison(self, measure: str) -> Comparison:
        """Return one measure of the virtual study in OFF and DBS."""
        analysis = self.scores if measure in ("impulse_nm_s", "work_j") else self.fits
        found = compare(analysis, "OFF", "DBS")
        return next(comparison for comparison in found if comparison.measure == measure)
