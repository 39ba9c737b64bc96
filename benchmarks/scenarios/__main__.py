"""Bias, scatter, coverage and findings on recordings of an independent simulator.

    python -m benchmarks.scenarios --only tremor --recordings 10    # rows whose name holds the word
    python -m benchmarks.scenarios --keep kept.json --jobs 2        # all of it, and the page

With `--keep` the recordings of each row go to that file, row by row, and rows that are in it stay
unless they are measured again; ``--recordings 0`` only writes. The table of
`docs/development/scenarios.md` is written when every row of it is kept. A recording of four epochs
by three methods takes about 2.5 s: 100 of each row are two hours on two cores.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from tests.docs.measured import between_the_marks
from tests.scenarios.catalogue import SCENARIOS

from benchmarks.scenarios.measure import METHODS, measure
from benchmarks.scenarios.page import measured, summary, table
from benchmarks.scenarios.rule import Row, row

PAGE = Path(__file__).parents[2] / "docs" / "development" / "scenarios.md"

Found = dict[str, dict[str, list[dict[str, Any]]]]
"""By scenario and method: the recordings."""


def rows(found: Found, names: Sequence[str], methods: Sequence[str]) -> dict[tuple[str, str], Row]:
    """Return the rows that were measured, in the order of the catalogue."""
    return {
        (name, method): row(
            found[name][method], SCENARIOS[name].findings, SCENARIOS[name].other_model
        )
        for name in SCENARIOS
        if name in names
        for method in methods
        if found.get(name, {}).get(method)
    }


def chosen(words: Sequence[str]) -> list[str]:
    """Return the scenarios of those names, or whose names hold one of the words."""
    return [
        name
        for name in SCENARIOS
        if any(word == name or (word not in SCENARIOS and word in name) for word in words)
    ]


def fewest(found: Found, name: str, methods: Sequence[str]) -> int:
    """Return how many recordings of a scenario are kept by each of the methods."""
    return min(len(found.get(name, {}).get(method, [])) for method in methods)


def main() -> None:
    """Measure, print, and write the page if it is whole."""
    parser = argparse.ArgumentParser(description="estimates and findings, scenario by scenario")
    parser.add_argument("--recordings", type=int, default=40)
    parser.add_argument(
        "--only", nargs="+", default=[""], help="names of rows, or words that names of rows hold"
    )
    parser.add_argument("--methods", default=",".join(METHODS))
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--keep", type=Path, help="file of the recordings' results")
    parser.add_argument(
        "--more",
        action="store_true",
        help="so many recordings more than are kept, of the same code",
    )
    options = parser.parse_args()
    names = chosen(options.only)
    methods = options.methods.split(",")
    if not names or not set(methods) <= set(METHODS):
        parser.error(f"no scenario, or a method that is none of {', '.join(METHODS)}")
    found: Found = {}
    if options.keep and options.keep.exists():
        found = json.loads(options.keep.read_text("utf-8"))
    begun_s = time.monotonic()
    numbers = {
        name: range(begin, begin + options.recordings)
        for name in names
        for begin in [fewest(found, name, methods) if options.more else 0]
    }
    for name, by_method in measure(numbers, methods, options.jobs):
        own = found.setdefault(name, {})
        for method, recordings in by_method.items():
            own[method] = own.get(method, [])[: numbers[name].start] + recordings
        if options.keep:
            options.keep.write_text(json.dumps(found), encoding="utf-8")
        print("\n".join(table(rows(found, [name], methods))[2:]), flush=True)
    print("\n".join(summary(rows(found, names, methods))))
    print(f"{time.monotonic() - begun_s:.0f} s")
    everything = rows(found, list(SCENARIOS), list(METHODS))
    if options.keep and len(everything) == len(SCENARIOS) * len(METHODS):
        between_the_marks(PAGE, measured(everything))
        print(f"wrote {PAGE}")


if __name__ == "__main__":
    main()
