"""Run packages on recordings, and keep their estimates as tables."""

from __future__ import annotations

import csv
import sys
import tempfile
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from benchmarks.joint_impedance import packages, recordings, score
from rigidimeter.core.executor import each

COLUMNS = (
    "scenario", "recording", "status",
    *(name + end for name in score.PARAMETERS for end in ("", "_low", "_high")), "reason",
)  # fmt: skip

Task = tuple[str, int, tuple[str, ...]]
Rows = list[dict[str, str]]


def run(task: Task) -> dict[str, dict[str, str]]:
    """Return the rows of the packages for one recording."""
    name, number, chosen = task
    made = checked(name, number)
    with tempfile.TemporaryDirectory() as place:
        path = Path(place) / made.name
        path.write_text(made.text, encoding="utf-8")
        return {package: _row(made, packages.estimate(package, path)) for package in chosen}


def checked(name: str, number: int) -> recordings.Recording:
    """Return a recording whose digest is that of the table."""
    made = recordings.recording(name, number)
    key = name, str(number)
    (row,) = (r for r in recordings.truth_rows() if (r["scenario"], r["recording"]) == key)
    if row["sha256"] != made.digest:
        print(f"warning: {made.name} differs from its digest in truth.csv", file=sys.stderr)
    return made


def _row(made: recordings.Recording, found: packages.Estimate) -> dict[str, str]:
    numbers = {
        name + end: f"{values[k]:.6g}" if values[k] == values[k] else ""
        for end, values in (("", found.value), ("_low", found.low), ("_high", found.high))
        for k, name in enumerate(score.PARAMETERS)
    }
    about = {"scenario": made.scenario, "recording": str(made.number), "status": found.status}
    return {**about, **numbers, "reason": " ".join(found.reason.split())}


def write_results(package: str, rows: Iterable[Mapping[str, str]], folder: Path) -> None:
    """Write the estimates of a package."""
    with (folder / f"{package}.csv").open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


def stored(folder: Path) -> dict[str, Rows]:
    """Return the stored estimates by package, in the order of the table."""
    there = {path.stem: score.read(path) for path in sorted(folder.glob("*.csv"))}
    known = [name for name in packages.PACKAGES if name in there]
    return {name: there[name] for name in (*known, *(n for n in there if n not in known))}


def measured(chosen: Sequence[str], names: Mapping[str, int], jobs: int) -> dict[str, Rows]:
    """Return the rows of these packages on so many recordings of each scenario."""
    tasks = [(n, k, tuple(chosen)) for n, count in names.items() for k in range(1, count + 1)]
    found: dict[tuple[str, int], dict[str, dict[str, str]]] = {}
    for (name, number, _), rows in each(run, tasks, jobs=jobs):
        found[name, number] = rows
        if number == names[name]:
            print(f"{len(found)} of {len(tasks)} recordings", file=sys.stderr, flush=True)
    return {one: [found[name, k][one] for name, k, _ in tasks] for one in chosen}
