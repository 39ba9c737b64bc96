"""How often tests find a difference when epochs of one day are alike: a false or a true one.

Epochs have SD 1. A day has an offset for both conditions (alike), for each (own), or both kinds.
Shown are the shares of p < .05 without a difference (size) and with one of 1.2 SD (power). The 95 %
interval of the test by days holds the true difference wherever p of the null is above .05, thus in
100 % less the size. Both mixed models, with offsets for days and conditions within days or for days
alone, are slow: they get fewer draws.

    python -m benchmarks.day_tests 4000 100     # draws, those of the mixed models; three minutes

The table is in `docs/development/day-tests.md`.

    python -m benchmarks.day_tests plan 2000    # studies a row; one minute

prints what `design` plans, days and the chance to show a difference, beside how many studies of so
many days show it by the test by days and the rule of the primary measures.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri, stdtr, stdtrit

from rigidimeter.analysis.statistics import (
    SubjectEpochs,
    difference,
    fit_mixed,
    holm,
    nested,
    test_by_levels,
)
from rigidimeter.core.study_files import primary_named, primary_words
from rigidimeter.planning import Detection, design, paired_power

Array = NDArray[np.float64]
Draw = Callable[[np.random.Generator, int], Array]

LEVEL = 0.05
SEED = 20
EFFECT = 1.2
"""In SD of epochs within a day: about the paper's."""


def student(rng: np.random.Generator, size: int) -> Array:
    """Return values of t with 3 degrees of freedom at SD 1."""
    return rng.standard_t(3, size) / math.sqrt(3)


def normal(rng: np.random.Generator, size: int) -> Array:
    return rng.standard_normal(size)


@dataclass(frozen=True)
class Case:
    """What is recorded, and how days differ.

    Attributes
    ----------
    name : str
    x, y : range
        Days of each condition; a number in both is one day.
    alike, own : float
        SD of a day for both its conditions, and of a condition within a day.
    epochs : (int, int)
        Of x and of y, dealt to their days in turn.
    y_scale : float
        Factor of everything that varies in y.
    draw : callable
    outlier : float
        Added to the first day of both conditions.
    subjects : int
        Each with these days, and an SD of 2 between them.
    uneven : bool
        Half of the epochs of a condition are of its first day.
    """

    name: str
    x: range
    y: range
    alike: float
    own: float
    epochs: tuple[int, int] = (0, 0)
    y_scale: float = 1.0
    draw: Draw = normal
    outlier: float = 0.0
    subjects: int = 1
    uneven: bool = False

    @cached_property
    def labels(self) -> list[tuple[list[str], list[str]]]:
        """Return subjects and days of the epochs of each condition."""
        found = []
        for days, wanted in zip((self.x, self.y), self.epochs, strict=True):
            n = wanted or 6 * len(days)
            place = np.arange(n) % len(days)
            if self.uneven:
                place[n // 2 :] = 0
            names = [f"d{days[k]}" for k in place]
            found.append(
                (
                    [f"s{s}" for s in range(self.subjects) for _ in names],
                    names * self.subjects,
                )
            )
        return found

    @cached_property
    def places(self) -> list[NDArray[np.int64]]:
        """Return the place of the day of each epoch among all days, by condition."""
        days = sorted({*self.x, *self.y})
        return [
            np.array(
                [days.index(int(label[1:])) for label in labels[: len(labels) // self.subjects]]
            )
            for _, labels in self.labels
        ]

    def values(self, rng: np.random.Generator) -> Iterator[Array]:
        """Yield the epochs of x and of y, without a difference."""
        shape = self.subjects * len({*self.x, *self.y})
        alike = self.alike * self.draw(rng, shape).reshape(self.subjects, -1)
        alike += 2.0 * rng.standard_normal((self.subjects, 1)) * (self.subjects > 1)
        alike[:, 0] += self.outlier
        for place, scale in zip(self.places, (1.0, self.y_scale), strict=True):
            own = alike + self.own * self.draw(rng, shape).reshape(self.subjects, -1)
            yield scale * (own[:, place].ravel() + self.draw(rng, place.size * self.subjects))


def _cases() -> Iterator[Case]:
    kinds = (("alike", 1.0, 0.0), ("each by itself", 0.0, 1.0), ("both", 0.7, 0.7))
    for n in (3, 5, 8):
        for kind, alike, own in kinds:
            yield Case(f"{n} days with both, {kind}", range(n), range(n), alike, own)
    for n in (3, 5, 8):
        yield Case(f"{n} days each, none shared", range(n), range(n, 2 * n), 0.0, 1.0)
    paper = (78, 23)
    yield Case("9 and 4 days, none shared", range(9), range(9, 13), 0.0, 1.0, paper)
    for kind, alike, own in (*kinds, ("days do not differ", 0.0, 0.0)):
        yield Case(f"9 days, 4 with both, {kind}", range(9), range(4), alike, own, paper)
    nine, four = range(9), range(4)
    for kind, alike, own in kinds[:2]:
        yield Case(f"5 days, 3 with both, {kind}", range(5), range(3), alike, own)
        yield Case(f"5 and 5 days, 2 of them shared, {kind}", range(5), range(3, 8), alike, own)
        yield Case(f"9 days, 4 with both, {kind}, y SD × 2.5", nine, four, alike, own, paper, 2.5)
        yield Case(
            f"9 days, 4 with both, {kind}, uneven epochs",
            nine,
            four,
            alike,
            own,
            paper,
            uneven=True,
        )
        yield Case(f"9 days, 4 with both, {kind}, t₃", nine, four, alike, own, paper, draw=student)
        yield Case(f"8 days with both, {kind}, t₃", range(8), range(8), alike, own, draw=student)
        yield Case(
            f"9 days, 4 with both, {kind}, a day 4 higher", nine, four, alike, own, paper, outlier=4
        )
        yield Case(f"4 subjects, 3 days with both, {kind}", range(3), range(3), alike, own,
                   subjects=4)  # fmt: skip
        yield Case(f"2 subjects, 4 days with both, {kind}", range(4), range(4), alike, own,
                   subjects=2)  # fmt: skip
    yield Case("8 and 3 days, none shared, y SD × 2.5", range(8), range(8, 11), 0.0, 1.0,
               y_scale=2.5)  # fmt: skip


def mixed_p(case: Case, x: Array, y: Array) -> tuple[float, float]:
    """Return p after Kenward and Roger with offsets for conditions within days, and without."""
    (x_subjects, x_days), (y_subjects, y_days) = case.labels
    conditions = ["x"] * x.size + ["y"] * y.size
    subjects = x_subjects + y_subjects
    days = nested(subjects, x_days + y_days)
    groups = {"day": days} if case.subjects == 1 else {"subject": subjects, "day": days}
    found = []
    for own in ({"condition in day": nested(days, conditions)}, {}):
        fit = fit_mixed(np.concatenate([x, y]), conditions, groups | own)
        found.append(difference(fit, "x", "y").p_kenward_roger)
    return found[0], found[1]


def rank_sum(x: Array, y: Array) -> bool:
    """Return whether the asymptotic rank-sum test of values without ties has p < `LEVEL`."""
    n = x.size + y.size
    ranks = np.empty(n)
    ranks[np.argsort(np.concatenate([x, y]))] = np.arange(1, n + 1)
    away = ranks[: x.size].sum() - x.size * (n + 1) / 2
    return bool(abs(away) > -ndtri(LEVEL / 2) * math.sqrt(x.size * y.size * (n + 1) / 12))


def by_day(case: Case, x: Array, y: Array) -> SubjectEpochs:
    """Return the epochs as the test by days takes them."""
    found: SubjectEpochs = {}
    for k, (values, labels) in enumerate(zip((x, y), case.labels, strict=True)):
        for value, subject, day in zip(values.tolist(), *labels, strict=True):
            found.setdefault(subject, {}).setdefault(day, ([], []))[k].append(value)
    return found


def shares(case: Case, draws: int, mixed: int, seed: list[int]) -> list[float]:
    """Return sizes and powers, of epochs, of both mixed models and by days."""
    rng = np.random.default_rng(seed)
    found = np.full((draws, 8), np.nan)
    for k in range(draws):
        x, y = case.values(rng)
        test = test_by_levels(by_day(case, x, y), ("x", "y"), "day")
        half = -float(stdtrit(test.df, LEVEL / 2)) * test.se
        for column, shift in enumerate((0.0, EFFECT * case.y_scale)):
            # What is subtracted from y is added to the difference, and to nothing else.
            found[k, column] = rank_sum(x, y - shift)
            if k < mixed:
                found[k, 2 + column : 6 : 2] = np.array(mixed_p(case, x, y - shift)) < LEVEL
            found[k, 6 + column] = abs(test.estimate + shift) > half
    return [float(share) for share in 100 * np.nanmean(found, axis=0)]


PLANS = (
    ("stiffness", "holm", "K 20 %", 5),
    ("stiffness", "holm", "K 12 %", 3),
    ("stiffness,damping", "holm", "K 20 %", 5),
    ("stiffness,damping", "holm", "B 15 %", 1),
    ("stiffness,damping", "holm", "K 20 %, B 20 %", 3),
    ("stiffness,damping", "sequence", "K 20 %, B 20 %", 3),
    ("damping,stiffness", "sequence", "B 13 %, K 18 %", 10),
)
"""Primary measures, their rule, by how much they are lower, and epochs a day and condition."""


def planned_rows(studies: int) -> Iterator[list[str]]:
    """Yield for each plan and measure the days, the chance that is planned, and what is found."""
    for k, (names, rule, effects, epochs) in enumerate(PLANS):
        differences = {
            {"K": "stiffness", "B": "damping"}[symbol]: share
            for symbol, share, _ in (effect.split() for effect in effects.split(", "))
        }
        wanted = [f"{name}={share}%" for name, share in differences.items()]
        found = {
            one.wanted.parameter: one
            for one in design(differences=wanted, primary=names, rule=rule).detections
        }
        for name, one in found.items():
            place = [each.epochs[0] for each in one.needed].index(epochs)
            days = one.needed[place].days
            assert days is not None
            chance = float(
                np.prod(
                    [
                        paired_power(each.difference, each.needed[place].day_sd, days,
                                     alpha=each.level)
                        for each in (*one.before, one)
                    ]
                )
            )  # fmt: skip
            shown = _shown(name, found, names.split(","), rule, epochs, days, studies, [SEED, k])
            row = [primary_words(primary_named(names, rule)), f"{effects} lower", f"{epochs}"]
            yield [*row, name, f"{days}", f"{100 * chance:.1f}", f"{100 * shown:.1f}"]


def _shown(
    name: str,
    found: dict[str, Detection],
    order: list[str],
    rule: str,
    epochs: int,
    days: int,
    studies: int,
    seed: list[int],
) -> float:
    """Return the share of studies that show a measure, with its sign.

    What is in no plan does not differ, and varies as the others do.
    """
    rng = np.random.default_rng([*seed, days])
    usual = next(iter(found.values()))
    shown = 0
    for _ in range(studies):
        p, right = [], {}
        for each in order:
            plan = found.get(each, usual)
            share = plan.difference / plan.value if each in found else 0.0
            test = test_by_levels({"": _days(rng, plan, share, epochs, days)}, ("x", "y"), "day")
            p.append(2.0 * float(stdtr(test.df, -abs(test.estimate / test.se))))
            right[each] = test.estimate > 0
        adjusted = holm(p) if rule == "holm" else np.maximum.accumulate(p)
        shown += adjusted[order.index(name)] < LEVEL and right[name]
    return shown / studies


def _days(
    rng: np.random.Generator, plan: Detection, share: float, epochs: int, days: int
) -> dict[str, tuple[list[float], list[float]]]:
    """Return epochs by day, the first condition of 1, as the plan assumes that they vary."""
    scatter = plan.scatter
    of_one = scatter.condition_in_day_percent / 100.0
    alike = np.sqrt((scatter.between_days_percent / 100.0) ** 2 - of_one**2)
    both = alike * rng.standard_normal((days, 1))
    x, y = (
        level
        + both
        + of_one * level * rng.standard_normal((days, 1))
        + np.hypot(scatter.between_epochs_percent / 100.0 * level, se / plan.value)
        * rng.standard_normal((days, epochs))
        for level, se in zip((1.0, 1.0 - share), plan.epoch_se, strict=True)
    )
    return {f"{day}": (list(x[day]), list(y[day])) for day in range(days)}


def print_plans(studies: int) -> None:
    """Print the table of plans."""
    print(
        f"{studies} studies a row, seed {SEED}; in % ({100 / studies**0.5:.1f} two SE at most).\n"
    )
    print("| primary measures | differences | epochs | shown | days | planned | found |")
    print("| --- | --- | ---: | --- | ---: | ---: | ---: |")
    for row in planned_rows(studies):
        print(f"| {' | '.join(row)} |", flush=True)


def main() -> None:
    """Print the table of the cases whose names hold some text."""
    if sys.argv[1:2] == ["plan"]:
        print_plans(int(sys.argv[2]) if sys.argv[2:] else 2000)
        return
    draws, mixed = map(int, sys.argv[1:3] or ("4000", "100"))
    chosen = " ".join(sys.argv[3:])
    print(f"{draws} draws, {mixed} of the mixed models, seed {SEED}; size / power in %.\n")
    print("| days | epochs | mixed | mixed, one offset a day | by days |")
    print("| --- | ---: | ---: | ---: | ---: |")
    for k, case in enumerate(_cases()):
        if chosen in case.name:
            found = shares(case, draws, mixed, [SEED, k])
            told = [f"{found[i]:.1f} / {found[i + 1]:.0f}" for i in range(0, 8, 2)]
            print(f"| {case.name} | {' | '.join(told)} |", flush=True)


if __name__ == "__main__":
    main()
