"""How far a request travels, and how finely the code is cut.

    python -m benchmarks.trips                          # the table
    python -m benchmarks.trips estimate elbow.csv       # one call, with the modules that it enters

A trip counts the modules and functions of the package that one call of the command line enters.
Everything is imported first, so that lazy and eager imports count alike; bodies of modules and
classes are no functions, and what child processes enter is not seen. The rest is read from the
source: nothing is won by cutting functions out or by putting them together, since both are counted.
"""

from __future__ import annotations

import ast
import contextlib
import io
import json
import pkgutil
import subprocess
import sys
import tempfile
from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping, Sequence
from importlib import import_module
from inspect import CO_NEWLOCALS
from pathlib import Path
from types import FrameType
from typing import NamedTuple

from benchmarks.size import COMPLEX, ROOT, SOURCE, complex_functions

PACKAGE = "rigidimeter"
LONG_FUNCTION = 60
CONSTANT = (ast.Constant, ast.UnaryOp, ast.BinOp)


class Trip(NamedTuple):
    """What a call enters: modules in their order, functions, pairs of modules, its exit status."""

    modules: list[str]
    functions: int
    pairs: int
    status: int


def _ours(frame: FrameType | None) -> str | None:
    name = frame.f_globals.get("__name__", "") if frame is not None else ""
    return name if name.partition(".")[0] == PACKAGE else None


def trip(arguments: Sequence[str]) -> Trip:
    """Return what one call of the command line enters, in this process."""
    package = import_module(PACKAGE)
    for found in pkgutil.walk_packages(package.__path__, PACKAGE + "."):
        if not found.name.endswith("__main__"):
            with contextlib.suppress(ImportError):
                import_module(found.name)
    functions: dict[tuple[str, int, str], None] = {}
    pairs: set[tuple[str, str]] = set()

    def watch(frame: FrameType, event: str, _: object) -> None:
        code = frame.f_code
        if event != "call" or not code.co_flags & CO_NEWLOCALS:
            return
        if (here := _ours(frame)) is None:
            return
        functions.setdefault((here, code.co_firstlineno, code.co_name))
        caller = _ours(frame.f_back)
        if caller is not None and caller != here:
            pairs.add((caller, here))

    main = import_module(f"{PACKAGE}.cli.main").main
    sys.argv = [PACKAGE, *arguments]
    status = 0
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
        sys.setprofile(watch)
        try:
            main()
        except SystemExit as end:
            status = end.code if isinstance(end.code, int) else int(end.code is not None)
        finally:
            sys.setprofile(None)
    return Trip(
        list(dict.fromkeys(key[0] for key in functions)), len(functions), len(pairs), status
    )


def _elsewhere(arguments: Sequence[object]) -> Trip:
    """Return the trip of a call in a process of its own."""
    command = [sys.executable, "-m", "benchmarks.trips", "--json", *map(str, arguments)]
    ran = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    return Trip(*json.loads(ran.stdout.splitlines()[-1]))


def small_csv(path: Path) -> Path:
    """Write two epochs of 20 s of J 0.005, B 0.14, K 1.75 pushed by a random binary torque."""
    import numpy as np
    from scipy import signal

    numerator, denominator, _ = signal.cont2discrete(([1.0], [0.005, 0.14, 1.75]), 1e-3)
    rng = np.random.default_rng(1)
    rows = []
    for epoch in (1, 2):
        torque = np.repeat(rng.choice([-0.5, 0.5], 400), 50)
        angle = signal.lfilter(np.ravel(numerator), denominator, torque)
        noisy = torque + rng.normal(0.0, 0.005, torque.size)
        time_s = (epoch - 1) * 25.0 + np.arange(torque.size) / 1000.0
        columns = zip(time_s, noisy, angle, torque, strict=True)
        rows += [f"{t:.3f},{m:.6f},{a:.8f},{p:.3f},{epoch},OFF" for t, m, a, p in columns]
    head = "time_s,torque_nm,angle_rad,perturbation_nm,epoch,condition\n"
    path.write_text(head + "\n".join(rows) + "\n", encoding="utf-8")
    return path


def trips(folder: Path) -> Iterator[tuple[str, Trip]]:
    """Yield each trip of the table with what it is."""
    from tests.small_study import build

    elbow = small_csv(folder / "elbow.csv")
    yield "a CSV → `estimate`", _elsewhere(["estimate", elbow])
    yield "the same → `report`", _elsewhere(["report", elbow, "--out", folder / "page"])
    study = build(folder / "study", "prbs")
    yield "a study folder → `compare`", _elsewhere(["compare", study, "--resamples", "499"])


def _trees(package: Path) -> Mapping[str, ast.Module]:
    return {
        ".".join(path.relative_to(package.parent).with_suffix("").parts): ast.parse(
            path.read_text(encoding="utf-8")
        )
        for path in sorted(package.rglob("*.py"))
    }


def cut(package: Path) -> Iterator[tuple[str, str]]:
    """Yield how finely the source is cut, a row of the table each."""
    trees = _trees(package)
    functions = [
        node
        for tree in trees.values()
        for node in ast.walk(tree)
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef))
    ]
    once = sum(_private_and_used_once(tree) for tree in trees.values())
    share = 100 * once / len(functions)
    yield "private functions used once, of all", f"{once} of {len(functions)}, {share:.0f} %"
    long = [node.name for node in functions if _lines(node) > LONG_FUNCTION]
    yield f"functions above {LONG_FUNCTION} lines", str(len(long))
    yield f"functions of complexity above {COMPLEX}", str(len(complex_functions(package)))
    importers = _importers(trees)
    yield (
        "modules, with exactly one importer",
        (f"{len(trees)}, {sum(len(who) == 1 for who in importers.values())}"),
    )
    constants = sum(
        isinstance(node, (ast.Assign, ast.AnnAssign))
        and isinstance(node.value, CONSTANT)
        and any(isinstance(part, ast.Constant) and isinstance(part.value, (int, float))
                for part in ast.walk(node.value))
        for tree in trees.values() for node in tree.body
    )  # fmt: skip
    yield "numeric constants of modules", str(constants)
    names = _public_names(trees)
    twice = sorted(name for name, places in names.items() if len(places) > 1)
    yield "public classes of one name in two modules", f"{len(twice)}: {', '.join(twice)}"


def _lines(node: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    return (node.end_lineno or node.lineno) - node.lineno + 1


def _private_and_used_once(tree: ast.Module) -> int:
    """Count private functions that their module names once."""
    used = Counter(node.id for node in ast.walk(tree) if isinstance(node, ast.Name))
    used += Counter(node.attr for node in ast.walk(tree) if isinstance(node, ast.Attribute))
    return sum(
        isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef))
        and node.name.startswith("_")
        and not node.name.startswith("__")
        and used[node.name] == 1
        for node in ast.walk(tree)
    )


def _importers(trees: Mapping[str, ast.Module]) -> Mapping[str, set[str]]:
    """Return for each module of the package which others import it."""
    found: dict[str, set[str]] = defaultdict(set)
    for name, tree in trees.items():
        for node in ast.walk(tree):
            if isinstance(node, ast.ImportFrom) and node.module:
                for target in (node.module, *(f"{node.module}.{one.name}" for one in node.names)):
                    if target in trees and target != name:
                        found[target].add(name)
            elif isinstance(node, ast.Import):
                for one in node.names:
                    if one.name in trees:
                        found[one.name].add(name)
    return found


def _public_names(trees: Mapping[str, ast.Module]) -> Mapping[str, set[str]]:
    found: dict[str, set[str]] = defaultdict(set)
    for name, tree in trees.items():
        for node in tree.body:
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                found[node.name].add(name)
    return found


def main() -> int:
    """Print the table, or what one call enters."""
    if sys.argv[1:2] == ["--json"]:
        print(json.dumps(trip(sys.argv[2:])))
        return 0
    if arguments := sys.argv[1:]:
        found = _elsewhere(arguments)
        print("\n".join(found.modules))
        print(f"{len(found.modules)} modules, {found.functions} functions, {found.pairs} pairs")
        return found.status
    print("| what | now |\n| --- | --- |")
    with tempfile.TemporaryDirectory() as folder:
        for what, found in trips(Path(folder)):
            print(f"| {what}: modules, functions | {len(found.modules)}, {found.functions} |")
    for what, number in cut(ROOT / SOURCE):
        print(f"| {what} | {number} |")
    return 0


if __name__ == "__main__":
    sys.exit(main())
