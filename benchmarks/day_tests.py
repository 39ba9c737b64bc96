"""How often tests find a difference when epochs of one day are alike: one that is not there, or is.

No effect of the condition; epochs have SD 1. A day has an offset, and where both conditions are
recorded on one day, either the same offset for both or one for each. 78 epochs of nine days and
23 of four, dealt to the days in turn. Run: `python -m benchmarks.day_tests 2000`; the table is in
`docs/explanation/days-not-epochs.md`.
"""

from __future__ import annotations

import sys

import numpy as np

from rigidimeter.statistics import day_difference, ranksum

EPOCHS, DAYS = (78, 23), (9, 4)
LEVEL = 0.05
SEED = 20
EFFECT = 1.2
"""Of a difference, in SD of epochs within a day: about the paper's."""
CASES = (
    ("days of one condition", 0.0, 0.0, False),
    ("days of one condition", 0.5, 0.0, False),
    ("days of one condition", 1.0, 0.0, False),
    ("four days with both, one offset a day", 0.5, 0.0, True),
    ("four days with both, one offset a day", 1.0, 0.0, True),
    ("four days with both, an offset for each", 0.0, 0.5, True),
    ("four days with both, an offset for each", 0.0, 1.0, True),
)
"""What is drawn: its name, the SD of days, the SD of condition within day, days in common."""


def rejected(
    rng: np.random.Generator,
    draws: int,
    day_sd: float,
    own_sd: float,
    common: bool,
    effect: float = 0.0,
) -> tuple[float, ...]:
    """Return the shares of p < .05: rank-sum of epochs, both mixed models, that of day medians."""
    place = [np.arange(n) % d for n, d in zip(EPOCHS, DAYS, strict=True)]
    second = "a" if common else "b"
    labels = [[f"a{k}" for k in place[0]], [f"{second}{k}" for k in place[1]]]
    hits = np.zeros(4)
    for _ in range(draws):
        offsets = [day_sd * rng.standard_normal(d) for d in DAYS]
        if common:
            offsets[1] = offsets[0][: DAYS[1]].copy()
        x, y = (
            shift
            + (offset + own_sd * rng.standard_normal(offset.size))[where]
            + rng.standard_normal(where.size)
            for shift, offset, where in zip((0.0, effect), offsets, place, strict=True)
        )
        found = day_difference(x, y, *labels)
        alike = day_difference(x, y, *labels, one_offset=True) if common else found
        hits += np.array([ranksum(x, y).p, found.p, alike.p, found.p_days]) < LEVEL
    return tuple((hits / draws).tolist())


def main(draws: int) -> None:
    """Print the table."""
    for effect in (0.0, EFFECT):
        what = f"the other condition {effect:g} SD higher" if effect else "no difference"
        print(f"\nShare of p < {LEVEL:g}, {what}, {draws} draws each, seed {SEED}.\n")
        print("| days | SD of days | epochs | mixed | mixed, one offset | day medians |")
        print("| --- | ---: | ---: | ---: | ---: | ---: |")
        for k, (name, day_sd, own_sd, common) in enumerate(CASES):
            rng = np.random.default_rng([SEED, k])
            shares = rejected(rng, draws, day_sd, own_sd, common, effect)
            told = " | ".join(f"{100 * share:.1f} %" for share in shares)
            print(f"| {name} | {max(day_sd, own_sd):g} | {told} |", flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 2000)
