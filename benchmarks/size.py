"""How large the package is, room by room, and where it is hard to read.

A room is a package of `core`, `analysis` or `rig`, or another island as a whole. Code lines are
lines without blanks, comments and docstrings.

    python -m benchmarks.size
    python -m benchmarks.size --against main    # beside another revision: before -> after
"""

from __future__ import annotations

import argparse
import ast
import io
import json
import subprocess
import sys
import tarfile
import tempfile
import tokenize
from collections import defaultdict
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[1]
SOURCE = Path("src") / "rigidimeter"
LONG = 350
"""Lines of a module from which it is listed."""
COMPLEX = 15
"""Cyclomatic complexity above which a function is listed."""
ISLANDS = ("core", "analysis", "rig")
"""Those that have rooms."""
EVERYWHERE = {"__init__.py"}
"""Names that every package has."""
NO_CODE = {
    tokenize.COMMENT,
    tokenize.NL,
    tokenize.NEWLINE,
    tokenize.INDENT,
    tokenize.DEDENT,
    tokenize.ENDMARKER,
}


class Module(NamedTuple):
    """One file: its path below the package, its lines of code and all its lines."""

    path: Path
    code: int
    total: int

    @property
    def room(self) -> str:
        """The room of an island that has rooms, else the island."""
        island, *rest = self.path.parts
        depth = 2 if island in ISLANDS and len(rest) > 1 else 1
        return ".".join(self.path.parts[:depth]).removesuffix(".py")

    def __str__(self) -> str:
        return f"{self.path} {self.code} ({self.total})"


class Room(NamedTuple):
    """The modules of a room together."""

    code: int
    modules: int
    largest: Module


def code_lines(source: str) -> int:
    """Count the lines of a source without blanks, comments and docstrings.

    Examples
    --------
    >>> code_lines('\"\"\"A docstring.\"\"\"\\n\\n# A comment.\\nx = (\\n    1\\n)\\n')
    3
    """
    documented: set[int] = set()
    for node in ast.walk(ast.parse(source)):
        if (text := _docstring(node)) is not None:
            documented.update(range(text.lineno, (text.end_lineno or text.lineno) + 1))
    lines: set[int] = set()
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type not in NO_CODE:
            lines.update(range(token.start[0], token.end[0] + 1))
    return len(lines - documented)


def _docstring(node: ast.AST) -> ast.Expr | None:
    """Return the statement that documents a module, class or function."""
    documented = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
    if not isinstance(node, documented) or not node.body:
        return None
    first = node.body[0]
    if not isinstance(first, ast.Expr) or not isinstance(first.value, ast.Constant):
        return None
    return first if isinstance(first.value.value, str) else None


def modules(package: Path) -> list[Module]:
    """Return every module of a package."""
    found = []
    for path in sorted(package.rglob("*.py")):
        source = path.read_text(encoding="utf-8")
        total = len(source.splitlines())
        found.append(Module(path.relative_to(package), code_lines(source), total))
    return found


def rooms(found: Iterable[Module]) -> dict[str, Room]:
    """Return the rooms by name."""
    by_room: dict[str, list[Module]] = defaultdict(list)
    for module in found:
        by_room[module.room].append(module)
    return {
        name: Room(
            sum(module.code for module in inside),
            len(inside),
            max(inside, key=lambda module: module.code),
        )
        for name, inside in sorted(by_room.items())
    }


def complex_functions(package: Path) -> list[str]:
    """Return the functions above the limit of cyclomatic complexity, as ruff counts it."""
    command = [
        *(sys.executable, "-m", "ruff", "check", "--isolated", "--select", "C901"),
        *("--config", f"lint.mccabe.max-complexity={COMPLEX}", "--output-format", "json"),
    ]
    ran = subprocess.run([*command, package], capture_output=True, text=True, check=False)
    if ran.returncode > 1:
        raise SystemExit(f"ruff: {ran.stderr}")
    return sorted(
        f"{Path(one['filename']).relative_to(package.resolve())}:{one['location']['row']} "
        f"{one['message']}"
        for one in json.loads(ran.stdout)
    )


def same_names(found: Iterable[Module]) -> dict[str, list[Path]]:
    """Return the file names that occur more than once, with their places."""
    places: dict[str, list[Path]] = defaultdict(list)
    for module in found:
        places[module.path.name].append(module.path)
    return {
        name: paths
        for name, paths in sorted(places.items())
        if len(paths) > 1 and name not in EVERYWHERE
    }


def checked_out(revision: str, folder: Path) -> Path:
    """Put the source of a revision into a folder and return its package."""
    command = ["git", "-C", str(ROOT), "archive", revision, SOURCE.as_posix()]
    ran = subprocess.run(command, capture_output=True, check=False)
    if ran.returncode:
        raise SystemExit(f"--against {revision}: {ran.stderr.decode().strip()}")
    with tarfile.open(fileobj=io.BytesIO(ran.stdout)) as archive:
        archive.extractall(folder, filter="data")
    return folder / SOURCE


def report(packages: Sequence[Path]) -> list[str]:
    """Return what is said of one package, or of two: before and after."""
    found = [modules(package) for package in packages]
    by_room = [rooms(one) for one in found]
    many = [complex_functions(package) for package in packages]
    lines = _table(by_room)
    long = [[str(one) for one in each if one.total > LONG] for each in found]
    lines += ["", *_listed(f"modules above {LONG} lines, code (all)", long)]
    lines += ["", *_listed(f"functions of complexity above {COMPLEX}", many)]
    repeated = [
        [f"{name}: {', '.join(str(path.parent) for path in paths)}" for name, paths in one.items()]
        for one in map(same_names, found)
    ]
    return [*lines, "", *_listed("file names that occur more than once", repeated)]


def _table(by_room: Sequence[dict[str, Room]]) -> list[str]:
    """Return rooms as rows; a room that a side lacks has a dash there."""
    names = sorted(set().union(*by_room))
    sides = ["", " before"][: len(by_room)][::-1]
    counted = [f"{what}{side}" for what in ("code", "modules") for side in sides]
    rows = [["room", *counted, "largest module: code (all lines)"]]
    for name in names:
        there = [one.get(name) for one in by_room]
        largest = there[-1] or there[0]
        assert largest is not None
        rows.append(
            [
                name,
                *(str(room.code) if room else "–" for room in there),
                *(str(room.modules) if room else "–" for room in there),
                str(largest.largest) if there[-1] else "–",
            ]
        )
    code = [str(sum(room.code for room in one.values())) for one in by_room]
    count = [str(sum(room.modules for room in one.values())) for one in by_room]
    rows.append(["total", *code, *count, ""])
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    return [
        "  ".join(
            cell.rjust(width) if 0 < column < len(row) - 1 else cell.ljust(width)
            for column, (cell, width) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in rows
    ]


def _listed(title: str, sides: Sequence[list[str]]) -> list[str]:
    counts = " -> ".join(str(len(side)) for side in sides)
    return [f"{title}: {counts}", *(f"  {line}" for line in sides[-1])]


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the sizes."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.size", description=(__doc__ or "").partition("\n")[0]
    )
    parser.add_argument("--against", metavar="REF", help="another revision, shown as before")
    against = parser.parse_args(arguments).against
    with tempfile.TemporaryDirectory() as folder:
        before = [checked_out(against, Path(folder))] if against else []
        print("\n".join(report([*before, ROOT / SOURCE])))


if __name__ == "__main__":
    main()
