"""Whether p-values and intervals keep their word: the mixed model, effect sizes, their differences.

A documented experiment on invented scores, from fixed seeds. Run by hand,

    python -m benchmarks.calibration

some minutes; it prints the tables of `docs/development/calibration.md`. With a number it
takes that fraction of the runs.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import f as f_distribution
from scipy.stats import kstest, norm

from rigidimeter.analysis.statistics import (
    TwoGroups,
    compare_effects,
    difference,
    effect_sizes,
    rank_biserial_interval,
    two_groups,
)
from rigidimeter.analysis.study import table_ratings
from rigidimeter.core.files import TextTable

EXAMINERS = "ABC"
COLUMNS = {name: name for name in ("condition", "score", "examiner", "subject", "day")}
WIDE = (-100.0, 100.0)
"""A scale that no score leaves."""


@dataclass(frozen=True)
class Scores:
    """How scores without an effect of the condition differ, and how they are modelled.

    Attributes
    ----------
    name : str
    examiner, day, own : float
        SDs of the offsets of examiners, of days and of conditions within a day; the residual has
        0.45.
    off, dbs : range
        Days of each condition; a number in both is one day.
    rounded : bool
        To half steps from 0 to 3.
    random : tuple of str or None
        As `table_ratings` takes it; None for its default, with days.
    """

    name: str
    examiner: float = 0.4
    day: float = 0.0
    own: float = 0.0
    off: range = range(9)
    dbs: range = range(9, 13)
    rounded: bool = False
    random: tuple[str, ...] | None = ("examiner",)

    def table(self, rng: np.random.Generator) -> TextTable:
        """Draw a table of scores."""
        offsets = rng.normal(0, self.examiner, len(EXAMINERS))
        of_days: dict[int, float] = {}
        rows = []
        for condition, days in (("OFF", self.off), ("DBS", self.dbs)):
            for day in days:
                of_day = of_days.setdefault(day, rng.normal(0, self.day))
                if self.own:
                    of_day += rng.normal(0, self.own)
                for index, name in enumerate(EXAMINERS):
                    score = 1.8 + offsets[index] + of_day + rng.normal(0, 0.45)
                    if self.rounded:
                        score = float(np.clip(np.round(2 * score) / 2, 0, 3))
                    rows.append((condition, repr(float(score)), name, "", f"{day}"))
        columns = dict(zip(COLUMNS, zip(*rows, strict=True), strict=True))
        return TextTable("scores", columns, tuple(range(2, len(rows) + 2)))


def _scores() -> Iterator[Scores]:
    yield Scores("examiners differ (SD 0.4)")
    yield Scores("examiners hardly differ (SD 0.1)", examiner=0.1)
    yield Scores("examiners do not differ", examiner=0.0)
    yield Scores("SD 0.4, half steps from 0 to 3", rounded=True)
    nine, four = range(9), range(4)
    for name, changes in {
        "days differ (SD 0.3)": {"day": 0.3},
        "4 of 9 days with both, a day moves both alike": {"day": 0.3, "dbs": four},
        "4 of 9 days with both, each by itself": {"own": 0.3, "dbs": four},
        "5 days with both, each by itself": {"own": 0.3, "off": range(5), "dbs": range(5)},
        "3 days each, none shared": {"day": 0.3, "off": range(3), "dbs": range(3, 6)},
    }.items():
        case = replace(Scores(name, off=nine), **changes)
        yield replace(case, name=f"{name}, not modelled")
        yield replace(case, name=f"{name}, modelled", random=None)


def mixed(runs: int) -> None:
    """Print the share of p < .05 under the null, by the choice of degrees of freedom."""
    names = ("p_residual", "p_satterthwaite", "p_kenward_roger")
    print("| scores without an effect | residual | Satterthwaite | Kenward-Roger | at zero |")
    print("| --- | ---: | ---: | ---: | ---: |")
    for case in _scores():
        rng = np.random.default_rng(11)
        p = np.empty((runs, 3))
        zero = 0
        for run in range(runs):
            table = case.table(rng)
            found, pair = table_ratings(table, COLUMNS, case.random, scale=WIDE, step=0)
            contrast = difference(found.fit, *reversed(pair))
            p[run] = [getattr(contrast, name) for name in names]
            zero += "examiner" in found.fit.at_zero
        cells = [
            f"{100 * np.mean(column < 0.05):.1f} % (KS p {kstest(column, 'uniform').pvalue:.2g})"
            for column in p.T
        ]
        print(f"| {case.name} | {' | '.join(cells)} | {100 * zero / runs:.0f} % |", flush=True)


def balanced(runs: int) -> None:
    """Print the same for complete tables, from the mean squares that REML then reduces to."""
    m, k = 9 + 4, len(EXAMINERS)
    n = m * k
    print("\n| complete table, without an effect | residual | Satterthwaite | at zero |")
    print("| --- | ---: | ---: | ---: |")
    rng = np.random.default_rng(10)
    for examiner in (0.4, 0.1, 0.0):
        error = 0.45**2 * rng.chisquare(n - k - 1, runs)
        between = (0.45**2 + m * examiner**2) * rng.chisquare(k - 1, runs)
        effect = 0.45**2 * rng.chisquare(1, runs)
        inside = between / (k - 1) > error / (n - k - 1)
        variance = np.where(inside, error / (n - k - 1), (error + between) / (n - 2))
        shares = [
            100 * np.mean(f_distribution.sf(effect / variance, 1, df) < 0.05)
            for df in (n - 2, np.where(inside, n - k - 1, n - 2))
        ]
        print(
            f"| examiners' SD {examiner} | {shares[0]:.2f} % | {shares[1]:.2f} % | "
            f"{100 * np.mean(~inside):.0f} % |",
            flush=True,
        )


def effects(runs: int) -> None:
    """Print how often 95 % intervals of the rank-biserial correlation hold the truth."""
    print("\n| sizes, true correlation | BCa or Newcombe | Newcombe alone |")
    print("| --- | ---: | ---: |")
    for m, n in ((92, 46), (78, 23), (27, 12), (9, 4)):
        for shift in (0.0, 0.8, 1.8):
            rng = np.random.default_rng(12)
            truth = 2 * float(norm.cdf(shift / math.sqrt(2))) - 1
            hit = np.zeros(2)
            for _ in range(runs):
                groups = two_groups(rng.normal(shift, 1, m), rng.standard_normal(n))
                found = effect_sizes(groups, rng, resamples=1000)
                low, high = rank_biserial_interval(found.rank_biserial, m, n)
                hit += [
                    found.rank_biserial_low <= truth <= found.rank_biserial_high,
                    low <= truth <= high,
                ]
            shares = [f"{100 * share:.1f} %" for share in hit / runs]
            print(f"| {m} and {n}, {truth:.2f} | {shares[0]} | {shares[1]} |", flush=True)


def _measure(rng: np.random.Generator, shared: np.ndarray, m: int, common: float) -> TwoGroups:
    values = common * shared + math.sqrt(1 - common**2) * rng.standard_normal(shared.size)
    values[:m] += 0.8
    return two_groups(values[:m], values[m:])


def differences(runs: int) -> None:
    """Print the share of p < .05 where two measures part the conditions equally well."""
    print("\n| two equal effects (rank-biserial 0.43) | p < .05 |")
    print("| --- | ---: |")
    for m, n in ((78, 23), (27, 12)):
        for common in (0.0, 0.7):
            rng = np.random.default_rng(13)
            below = 0
            for _ in range(runs):
                shared = rng.standard_normal(m + n)
                pair = [_measure(rng, shared, m, common) for _ in range(2)]
                below += compare_effects(*pair, rng, paired=True, resamples=1000).p < 0.05
            said = f"same epochs, correlation {common**2:.2g}"
            print(f"| {m} and {n}, {said} | {100 * below / runs:.1f} % |", flush=True)
    rng = np.random.default_rng(14)
    below = 0
    for _ in range(runs):
        pair = [_measure(rng, rng.standard_normal(m + n), m, 0.0) for m, n in ((78, 23), (92, 46))]
        below += compare_effects(*pair, rng, paired=False, resamples=1000).p < 0.05
    print(f"| 78 and 23 against 92 and 46, other epochs | {100 * below / runs:.1f} % |")


def main() -> None:
    """Print all tables."""
    share = float(sys.argv[1]) if len(sys.argv) > 1 else 1.0
    mixed(round(4000 * share))
    balanced(round(1_000_000 * share))
    effects(round(1000 * share))
    differences(round(1000 * share))


if __name__ == "__main__":
    main()
