"""How large the rooms are, which circles they form, and how far a request travels.

    python -m benchmarks.house               the rooms, circles, names taken from inside
    python -m benchmarks.house --ceilings    the same as `tests/house.toml` holds it
    python -m benchmarks.house --trips       what a CSV and a small study enter (a minute); fails
                                             above the ceilings of `tests/house.toml`
    python -m benchmarks.house --trip ARG …  what one call enters, module by module

A room is a package of `core`, `analysis` or `rig`, or another island. Code lines are lines without
blanks, comments and docstrings. A circle is of imports, also of those inside functions, through the
fronts that hand names on; those of `TYPE_CHECKING` do not count. A trip counts the modules and
functions (`def`) that a call enters, after all modules were imported.
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
import tokenize
import tomllib
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from importlib import import_module
from inspect import CO_NEWLOCALS
from pathlib import Path
from types import FrameType
from typing import Any, NamedTuple

ROOT = Path(__file__).parents[1]
SOURCE = ROOT / "src"
PACKAGE = "rigidimeter"
ISLANDS = ("analysis", "rig", "core")
"""Those that have rooms."""
STUDY = f"{PACKAGE}.analysis.study"
"""What an estimate of one file has no need of."""
NO_CODE = {
    *(tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE),
    *(tokenize.INDENT, tokenize.DEDENT, tokenize.ENDMARKER),
}
DOCUMENTED = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)


def code_lines(text: str) -> set[int]:
    """Return the numbers of the lines of a source that hold code.

    Examples
    --------
    >>> code_lines('\"\"\"A docstring.\"\"\"\\n\\n# A comment.\\nx = (\\n    1\\n)\\n')
    {4, 5, 6}
    """
    documented: set[int] = set()
    for node in ast.walk(ast.parse(text)):
        first = node.body[0] if isinstance(node, DOCUMENTED) and node.body else None
        text_of = first.value if isinstance(first, ast.Expr) else None
        if isinstance(text_of, ast.Constant) and isinstance(text_of.value, str):
            documented |= set(range(text_of.lineno, (text_of.end_lineno or text_of.lineno) + 1))
    lines: set[int] = set()
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type not in NO_CODE:
            lines |= set(range(token.start[0], token.end[0] + 1))
    return lines - documented


class Module:
    """One file: its dotted name, its room, its lines, and what it imports."""

    def __init__(self, path: Path, base: Path) -> None:
        self.path = path
        self.text = path.read_text("utf-8")
        self.is_front = path.name == "__init__.py"
        parts = path.relative_to(base).with_suffix("").parts
        self.name = ".".join(parts[:-1] if self.is_front else parts)

    @cached_property
    def tree(self) -> ast.Module:
        return ast.parse(self.text)

    @cached_property
    def room(self) -> str:
        parts = self.path.relative_to(SOURCE / PACKAGE).parts
        if len(parts) == 1:
            return "(top)"
        return ".".join(parts[:2]) if parts[0] in ISLANDS and len(parts) > 2 else parts[0]

    def imports(self, node: ast.AST | None = None) -> Iterator[tuple[str, str]]:
        """Yield each imported module and name (empty for a module as such)."""
        for child in ast.iter_child_nodes(node or self.tree):
            typing = isinstance(child, ast.If) and "TYPE_CHECKING" in ast.dump(child.test)
            if isinstance(child, ast.Import):
                yield from ((one.name, "") for one in child.names)
            elif isinstance(child, ast.ImportFrom):
                yield from ((self._base(child), one.name) for one in child.names)
            elif isinstance(child, ast.If) and typing and not self.is_front:
                for other in child.orelse:
                    yield from self.imports(ast.Module([other], []))
            else:
                yield from self.imports(child)

    def _base(self, node: ast.ImportFrom) -> str:
        """Return the module that is imported from, also of a relative import."""
        parts = self.name.split(".")
        above = parts[: len(parts) + self.is_front - node.level] if node.level else []
        return ".".join([*above, *([node.module] if node.module else [])])


class House:
    """The modules of the package."""

    def __init__(self) -> None:
        files = sorted((SOURCE / PACKAGE).rglob("*.py"))
        self.modules = {one.name: one for one in (Module(path, SOURCE) for path in files)}

    @cached_property
    def rooms(self) -> dict[str, tuple[int, int]]:
        """Return code lines and number of modules of each room."""
        code: Counter[str] = Counter()
        count: Counter[str] = Counter()
        for one in self.modules.values():
            if "vendored" not in one.path.parts:
                code[one.room] += len(code_lines(one.text))
                count[one.room] += 1
        return {room: (code[room], count[room]) for room in sorted(count)}

    def target(self, module: str, name: str) -> tuple[str, str]:
        """Return what is imported: a submodule as such, else the module with the name."""
        return (f"{module}.{name}", "") if f"{module}.{name}" in self.modules else (module, name)

    def needs(self) -> dict[str, set[str]]:
        """Return which module needs which, names resolved through the fronts that hand them on."""
        taken = {
            name: [
                found
                for found in (self.target(*pair) for pair in one.imports())
                if found[0] in self.modules
            ]
            for name, one in self.modules.items()
        }
        handed = {
            (front, name): module
            for front, one in self.modules.items()
            if one.is_front
            for module, name in taken[front]
            if name
        }

        def home(module: str, name: str) -> str:
            seen: set[tuple[str, str]] = set()
            while (module, name) in handed and (module, name) not in seen:
                seen.add((module, name))
                module = handed[module, name]
            return module

        return {
            name: set() if one.is_front else {home(*pair) for pair in taken[name]} - {name}
            for name, one in self.modules.items()
        }

    @cached_property
    def circles(self) -> list[list[str]]:
        """Return the circles of modules, the largest first (strongly connected components)."""
        from scipy.sparse import csr_array
        from scipy.sparse.csgraph import connected_components

        needs = self.needs()
        number = {name: k for k, name in enumerate(needs)}
        edges = [(number[a], number[b]) for a, others in needs.items() for b in others]
        rows, columns = zip(*edges, strict=True)
        shape = (len(number), len(number))
        graph = csr_array(([1] * len(edges), (rows, columns)), shape=shape)
        labels = connected_components(graph, directed=True, connection="strong")[1]
        grouped: dict[int, list[str]] = {}
        for name, label in zip(needs, labels, strict=True):
            grouped.setdefault(int(label), []).append(name)
        return sorted((one for one in grouped.values() if len(one) > 1), key=len, reverse=True)

    def taken_from_inside(self) -> dict[str, int]:
        """Return how many names others take from inside each room, past its front."""
        counted: Counter[str] = Counter()
        others = [
            Module(path, ROOT)
            for folder in ("tests", "benchmarks")
            for path in sorted((ROOT / folder).rglob("*.py"))
        ]
        for one in [*self.modules.values(), *others]:
            own = one.room if one.name in self.modules else ""
            for pair in one.imports():
                target = self.modules.get(self.target(*pair)[0])
                if target is None or target.is_front or "." not in target.room:
                    continue
                if target.room != own:
                    counted[target.room] += 1
        return dict(sorted(counted.items()))


def exceptions_of_contracts() -> int:
    """Return how many imports the contracts of `pyproject.toml` leave out."""
    tool = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"]["importlinter"]
    return sum(len(one.get("ignore_imports", [])) for one in tool["contracts"])


def ceilings(house: House) -> dict[str, dict[str, int]]:
    """Return everything that has a ceiling in `tests/house.toml`, as it is now."""
    circles = house.circles
    return {
        "rooms": {room: code for room, (code, _) in house.rooms.items()},
        "inside": house.taken_from_inside(),
        "house": {
            "largest_circle": len(circles[0]) if circles else 0,
            "exceptions_of_contracts": exceptions_of_contracts(),
        },
    }


CEILINGS = ROOT / "tests" / "house.toml"


def highest() -> dict[str, dict[str, int]]:
    """Return the ceilings as they are agreed, in `tests/house.toml`."""
    return tomllib.loads(CEILINGS.read_text("utf-8"))


def above(now: Mapping[str, Mapping[str, int]], most: Mapping[str, Mapping[str, int]]) -> list[str]:
    """Return what is above its ceiling, a sentence each; what has none has the ceiling 0."""
    return [
        f"[{part}] {name}: {count}, ceiling {most[part].get(name, 0)}"
        for part, counts in now.items()
        for name, count in counts.items()
        if count > most[part].get(name, 0)
    ]


class Trip(NamedTuple):
    """What a call enters: modules in their order, functions, and its exit status."""

    modules: list[str]
    functions: int
    status: int


def _enter(arguments: Sequence[str]) -> Trip:
    """Return what one call of the command line enters, in this process."""
    package = import_module(PACKAGE)
    for found in pkgutil.walk_packages(package.__path__, PACKAGE + "."):
        if not found.name.endswith("__main__"):
            with contextlib.suppress(ImportError):
                import_module(found.name)
    seen: dict[tuple[str, int, str], None] = {}

    def watch(frame: FrameType, event: str, _: object) -> None:
        code, name = frame.f_code, frame.f_globals.get("__name__", "")
        if event != "call" or not code.co_flags & CO_NEWLOCALS or code.co_name.startswith("<"):
            return  # bodies of classes and modules, comprehensions and lambdas
        if name.partition(".")[0] == PACKAGE:
            seen.setdefault((name, code.co_firstlineno, code.co_name))

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
    return Trip(list(dict.fromkeys(key[0] for key in seen)), len(seen), status)


def trip(*arguments: object) -> Trip:
    """Return the trip of a call, in a process of its own."""
    command = [sys.executable, "-m", "benchmarks.house", "--entered", *map(str, arguments)]
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
        torque = np.repeat(rng.choice([-0.4, 0.4], 400), 50)
        angle = signal.lfilter(np.ravel(numerator), denominator, torque)
        time_s = (epoch - 1) * 30.0 + np.arange(torque.size) / 1000.0
        noisy = torque + 0.01 * rng.standard_normal(torque.size)
        rows.append(np.column_stack([time_s, noisy, angle, torque, np.full(torque.size, epoch)]))
    head = "time_s,torque_nm,angle_rad,perturbation_nm,epoch"
    np.savetxt(path, np.concatenate(rows), fmt="%.9g", delimiter=",", header=head, comments="")
    return path


def trips(folder: Path) -> dict[str, Trip]:
    """Return the trips of a CSV through `estimate` and of a small study through `compare`."""
    from tests.small_study import build

    study = build(folder / "study", "prbs")
    return {
        "estimate": trip("estimate", small_csv(folder / "elbow.csv")),
        "compare": trip("compare", study, "--resamples", "499"),
    }


def ways(found: Mapping[str, Trip]) -> dict[str, int]:
    """Return trips as numbers that have ceilings."""
    modules = {f"{name} modules": len(one.modules) for name, one in found.items()}
    functions = {f"{name} functions": one.functions for name, one in found.items()}
    of_study = [one for one in found["estimate"].modules if one.startswith(STUDY)]
    return modules | functions | {"estimate modules of study": len(of_study)}


def toml(found: Mapping[str, Mapping[str, Any]]) -> str:
    """Return the ceilings as TOML."""
    parts = [
        f"[{part}]\n" + "".join(f'"{name}" = {count}\n' for name, count in counts.items())
        for part, counts in found.items()
    ]
    return "\n".join(parts)


def main(arguments: Sequence[str] | None = None) -> int:
    """Print what is asked; return 1 if a trip is longer than its ceiling."""
    words = [*(sys.argv[1:] if arguments is None else arguments)]
    if words[:1] == ["--entered"]:
        print(json.dumps(_enter(words[1:])))
    elif words[:1] == ["--trip"]:
        one = trip(*words[1:])
        print(*one.modules, f"{len(one.modules)} modules, {one.functions} functions", sep="\n")
    elif words == ["--trips"]:
        with tempfile.TemporaryDirectory() as folder:
            found = {"ways": ways(trips(Path(folder)))}
        print(toml(found), *above(found, highest()), sep="\n")
        return int(bool(above(found, highest())))
    elif words == ["--ceilings"]:
        print(toml(ceilings(House())), end="")
    else:
        house = House()
        for room, (code, count) in house.rooms.items():
            print(f"{room:24}{code:8} code lines{count:5} modules")
        print("circles of modules:", ", ".join(str(len(one)) for one in house.circles) or 0)
        print("taken from inside, past a front:", house.taken_from_inside())
    return 0


if __name__ == "__main__":
    sys.exit(main())
