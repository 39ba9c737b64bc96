"""Two estimations on the same recordings of the scenarios, old and new in turn, row by row.

    python -m benchmarks.rebuilt --new package.module:function --recordings 30 --jobs 2
    python -m benchmarks.rebuilt --new … --only tremor --methods iv --recordings 4

A function takes epochs, settings and the name of a method and returns an `Analysis`. Rows are
counted as in `benchmarks.scenarios`; `false` is in how many of the recordings a finding is false if
the answer is right, and CPU is of an epoch, with every check, in multiples of numpy.linalg.lstsq on
20,000 × 3 in the same process (set OPENBLAS_NUM_THREADS=1). What raises has no answer, and the
error is its finding. Under each row stands what is worse or better beyond chance: p below 0.001 by
Fisher's exact test, and for an error that grew by more than 0.1 % by the sign test over epochs.

With `--keep` the recordings go to that file, by function; those that are in it stay, so the old
ones are computed once.
"""

from __future__ import annotations

import argparse
import json
import pkgutil
import statistics
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import groupby
from pathlib import Path

import numpy as np
from scipy.stats import binomtest, fisher_exact
from tests.scenarios.catalogue import SCENARIOS
from tests.scenarios.scenario import Scenario

from benchmarks.paired import cpu_in_regressions
from benchmarks.scenarios.__main__ import chosen
from benchmarks.scenarios.measure import EPOCHS, METHODS, Kept, kept, seen_by
from benchmarks.scenarios.page import HEADER, cells, summary
from benchmarks.scenarios.rule import Row, row
from benchmarks.shipped import NAME, Estimation, named
from rigidimeter.core.executor import each
from rigidimeter.core.records import Epoch
from rigidimeter.core.settings import Settings

CHANCE = 1e-3
"""A table of 76 rows by three methods asks some 2,000 times: two by chance."""

LEAST_BIAS = 1e-3
"""Of the truth: an error that grew by less is none."""

Task = tuple[str, int, tuple[str, ...], tuple[str, ...]]


def of_recording(task: Task) -> dict[str, dict[str, Kept]]:
    """Return one recording by each function and method."""
    scenario, number, methods, functions = task
    if not functions:
        return {}
    made = SCENARIOS[scenario]
    simulated, truth = made.simulated(number, EPOCHS)
    settings, found = made.analysed_with(), {name: {} for name in functions}
    for turn, method in enumerate(methods, number):
        epochs = seen_by(method, simulated)
        for name in functions[:: 1 if turn % 2 else -1]:  # neither is always the first
            own = [replace(epoch) for epoch in epochs]
            found[name][method] = _timed(name, own, settings, METHODS[method], truth.tolist())
    return found


def _timed(
    name: str, epochs: Sequence[Epoch], settings: Settings, method: str, truth: list[list[float]]
) -> Kept:
    """Return what one function found, and the CPU time of an epoch in regressions."""
    function: Estimation = pkgutil.resolve_name(name)
    found: Kept = {}

    def work() -> None:
        try:
            with np.errstate(all="ignore"):
                found.update(kept(truth, function(epochs, settings, method)))
        except Exception as error:  # a function that is being written
            doubt = f"{type(error).__name__}: {error}"[:80].replace("|", "/")
            fit = {**dict.fromkeys(("value", "low", "high"), [None] * 3), "doubts": [doubt]}
            found.update({"truth": truth, "fits": [fit] * len(truth), "pooled": []})

    cost = cpu_in_regressions(work) / len(truth)
    return found | {"cost": float(f"{cost:.4g}")}


def rated(scenario: str, recordings: Sequence[Kept]) -> Row:
    """Return the row of a scenario."""
    made = SCENARIOS[scenario]
    return row(recordings, made.findings, made.other_model)


def worse(scenario: Scenario, ours: Sequence[Kept], other: Sequence[Kept]) -> list[str]:
    """Return in what one of two is worse than the other on the same recordings."""
    mine, others = (row(one, scenario.findings, scenario.other_model) for one in (ours, other))
    found = []

    def compare(what: str, shares: tuple[float, float], counts: tuple[int, int]) -> None:
        """Add what happens more often in the first."""
        hits = [round(s * n) if n else 0 for s, n in zip(shares, counts, strict=True)]
        missed = [n - hit for n, hit in zip(counts, hits, strict=True)]
        if fisher_exact([hits, missed], alternative="greater").pvalue < CHANCE:
            found.append(what)

    n = (mine.recordings, others.recordings)
    for part in ("epochs", "pooled"):
        one, two = getattr(mine, part), getattr(others, part)
        for name, a, b in zip("JBK", one.coverage, two.coverage, strict=True):
            compare(f"{part}: coverage of {name}", (1 - a, 1 - b), (one.count, two.count))
    fits = (sum(len(one["fits"]) for one in ours), sum(len(one["fits"]) for one in other))
    no_answer = (1 - mine.epochs.count / fits[0], 1 - others.epochs.count / fits[1])
    compare("epochs without an answer", no_answer, fits)
    if mine.wrong:
        # Where the other is right it need not be reported.
        said = others.raised if others.wrong else 1.0
        compare("wrong, silent", (1 - mine.raised, 1 - said), n)
    if not mine.wrong:
        compare("false findings", (mine.in_vain, others.in_vain), n)
    return found + [f"bias of {name}" for name in _farther(ours, other)]


def _farther(ours: Sequence[Kept], other: Sequence[Kept]) -> Iterator[str]:
    """Yield the parameters whose errors are larger in more of the epochs than chance has it."""
    errors = []
    for recordings in (ours, other):
        value, truth = (
            np.array([v for one in recordings for v in part(one)], dtype=float)
            for part in (lambda one: [f["value"] for f in one["fits"]], lambda one: one["truth"])
        )
        errors.append(value / truth - 1.0)
    if errors[0].shape != errors[1].shape:
        return
    both = np.isfinite(errors[0]).all(axis=1) & np.isfinite(errors[1]).all(axis=1)
    mine, others = errors[0][both], errors[1][both]
    for name, a, b in zip("JBK", mine.T, others.T, strict=True):
        apart = np.abs(a) - np.abs(b)
        count = int(np.count_nonzero(apart))
        if count and abs(np.mean(a)) - abs(np.mean(b)) > LEAST_BIAS:
            larger = int(np.count_nonzero(apart > 0))
            if binomtest(larger, count, alternative="greater").pvalue < CHANCE:
                yield name


def lines_of(scenario: str, method: str, old: Sequence[Kept], new: Sequence[Kept]) -> Iterator[str]:
    """Yield a row of the table: the old, the new, and what is worse or better beyond chance."""
    made = SCENARIOS[scenario]
    for name, recordings in (("old", old), ("new", new)):
        its = rated(scenario, recordings)
        cost = statistics.median(one["cost"] for one in recordings)
        more = ("–" if its.wrong else f"{100 * its.in_vain:.0f}", f"{cost:.3g}")
        yield "| " + " | ".join([name, *cells(scenario, method, its), *more]) + " |"
    for word, pair in (("**worse**", (new, old)), ("better", (old, new))):
        if found := worse(made, *pair):
            yield f"| {word} | {method} | {scenario} | {'; '.join(found)} |" + " |" * 9


TITLES = ("", *HEADER, "false (%)", "CPU (lstsq)")


Found = dict[str, dict[str, dict[str, list[Kept]]]]
"""By function, scenario and method: the recordings."""


def measured(
    found: Found, names: Sequence[str], methods: Sequence[str], count: int, jobs: int
) -> Iterator[str]:
    """Measure what is missing in `found`; yield each scenario when it is there."""
    tasks: list[Task] = []
    for name in names:
        missing = {
            function: min(len(by_name.get(name, {}).get(m, [])) for m in methods)
            for function, by_name in found.items()
        }
        for number in range(count):
            due = tuple(function for function, there in missing.items() if there <= number)
            tasks.append((name, number, tuple(methods), due))
    done = each(of_recording, tasks, jobs=jobs, in_order=True)
    for name, own in groupby(done, lambda one: one[0][0]):
        for task, by_function in own:
            for function, by_method in by_function.items():
                kept_there = found[function].setdefault(name, {})
                for method, recording in by_method.items():
                    kept_there[method] = [*kept_there.get(method, [])[: task[1]], recording]
        yield name


def states(rows: Mapping[tuple[str, str], Row]) -> Iterator[str]:
    """Yield how many rows are wrong and reported, and how many wrong and not, by method."""
    for method in dict.fromkeys(method for _, method in rows):
        own = [one for (_, name), one in rows.items() if name == method]
        wrong = [one for one in own if one.wrong]
        silent = sum(one.breaks.startswith(("silent", "misnamed")) for one in wrong)
        yield (
            f"- `{method}`: {len(wrong) - silent} of {len(own)} rows wrong, reported; {silent} "
            f"wrong, silent or misnamed; {sum(one.breaks == 'false alarm' for one in own)} false "
            "alarms."
        )


def main() -> None:
    """Measure both and print the table, scenario by scenario, and the counts."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--old", type=named, default=NAME, metavar="MODULE:FUNCTION")
    parser.add_argument("--new", type=named, default=NAME, metavar="MODULE:FUNCTION")
    parser.add_argument("--only", nargs="+", default=[""], help="names of rows, or words in them")
    parser.add_argument("--methods", default=",".join(METHODS))
    parser.add_argument("--recordings", type=int, default=30)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--keep", type=Path, help="file of the recordings' results")
    options = parser.parse_args()
    names, methods = chosen(options.only), options.methods.split(",")
    if not names or not set(methods) <= set(METHODS):
        parser.error(f"no scenario, or a method that is none of {', '.join(METHODS)}")
    both = (options.old, options.new)
    stored: Found = {}
    if options.keep and options.keep.exists():
        stored = json.loads(options.keep.read_text("utf-8"))
    found: Found = {name: stored.setdefault(name, {}) for name in dict.fromkeys(both)}
    print("| " + " | ".join(TITLES) + " |\n|" + " --- |" * len(TITLES))
    rows: list[dict[tuple[str, str], Row]] = [{}, {}]
    for name in measured(found, names, methods, options.recordings, options.jobs):
        if options.keep:
            options.keep.write_text(json.dumps(stored), encoding="utf-8")
        for method in methods:
            old, new = (found[function][name][method][: options.recordings] for function in both)
            print("\n".join(lines_of(name, method, old, new)), flush=True)
            for kind, recordings in zip(rows, (old, new), strict=True):
                kind[name, method] = rated(name, recordings)
    for function, kind in zip(both, rows, strict=True):
        print(f"\n{function}:", *summary(kind), *states(kind), sep="\n")


if __name__ == "__main__":
    main()
