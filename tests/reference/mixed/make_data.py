"""Write the scores that `mixed_reference.R` fits; the numbers are invented, from fixed seeds."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np

HERE = Path(__file__).parent
COLUMNS = ("dataset", "condition", "subject", "day", "examiner", "score")


def scores(
    name: str,
    seed: int,
    means: dict[str, tuple[float, int]],
    examiners: int,
    subjects: int,
    spread: dict[str, float],
    kept: float,
) -> list[tuple[str, ...]]:
    """Draw half-step scores: means with days each, spreads by grouping, a share that is kept."""
    rng = np.random.default_rng(seed)
    by_examiner = rng.normal(0, spread["examiner"], examiners)
    rows = []
    for subject in range(subjects):
        of_subject = rng.normal(0, spread["subject"])
        for condition, (mean, days) in means.items():
            for day in range(1, days + 1):
                of_day = rng.normal(0, spread["day"])
                for examiner in range(examiners):
                    level = mean + by_examiner[examiner] + of_subject + of_day
                    score = np.round(2 * (level + rng.normal(0, spread["residual"]))) / 2
                    if rng.random() < kept:
                        rows.append(
                            (name, condition, f"s{subject + 1}", f"{condition[0]}{day}",
                             "ABCDEF"[examiner], f"{score:.1f}")
                        )  # fmt: skip
    return rows


def shared_days(
    name: str, seed: int, means: dict[str, tuple[float, int]], examiners: int
) -> list[tuple[str, ...]]:
    """Draw scores of days that have one condition or both, each with an offset of its own."""
    rng = np.random.default_rng(seed)
    by_examiner = rng.normal(0, 0.4, examiners)
    by_day = rng.normal(0, 0.5, max(days for _, days in means.values()))
    rows = []
    for condition, (mean, days) in means.items():
        for day, own in enumerate(by_day[:days] + rng.normal(0, 0.4, days), start=1):
            for examiner in range(examiners):
                level = mean + by_examiner[examiner] + own
                score = np.round(2 * (level + rng.normal(0, 0.3))) / 2
                if rng.random() < 0.85:
                    rows.append(
                        (name, condition, "s1", f"d{day}", "ABCDEF"[examiner], f"{score:.1f}")
                    )
    return rows


def main() -> None:
    noisy = {"examiner": 0.5, "subject": 0.0, "day": 0.0, "residual": 0.4}
    people = {"examiner": 0.0, "subject": 0.6, "day": 0.4, "residual": 0.4}
    no_days = {"examiner": 0.0, "subject": 0.6, "day": 0.0, "residual": 0.5}
    both = {"examiner": 0.4, "subject": 0.6, "day": 0.0, "residual": 0.4}
    days = {"examiner": 0.4, "subject": 0.0, "day": 0.5, "residual": 0.4}
    two = {"OFF": (2.0, 9), "DBS": (1.6, 4)}
    three = {"OFF": (2.0, 6), "LOW": (1.7, 4), "HIGH": (1.2, 5)}
    rows = [
        *scores("unbalanced", 3, two, 3, 1, noisy, 0.7),
        *scores("three", 4, three, 4, 1, noisy, 0.75),
        *scores("nested", 5, {"OFF": (2.0, 3), "DBS": (1.5, 2)}, 3, 5, people, 0.8),
        *scores("no_days", 7, {"OFF": (2.0, 3), "DBS": (1.5, 2)}, 3, 5, no_days, 0.8),
        *scores("crossed", 8, {"OFF": (2.0, 2), "DBS": (1.5, 2)}, 4, 5, both, 0.7),
        *scores("days", 9, two, 3, 1, days, 0.85),
        *shared_days("days_of_both", 10, {"OFF": (2.0, 9), "DBS": (1.6, 6)}, 4),
    ]
    with (HERE / "scores.csv").open("w", encoding="utf-8", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows([COLUMNS, *rows])


if __name__ == "__main__":
    main()
