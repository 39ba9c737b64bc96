"""A room is imported through its front: what stands in its `__init__`, or the module it is."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

from benchmarks.house import highest

ROOT = Path(__file__).parents[2]
SOURCE = ROOT / "src"
ISLANDS = ("core", "model", "planning", "analysis", "rig", "virtual", "paper", "testing", "cli")

ALSO = (
    "rigidimeter.rig.acquisition.processes",  # beside the loop: what it does not need it leaves out
    "rigidimeter.rig.console.page",  # loads a web server
    "rigidimeter.rig.devices.base",  # what every driver is written against
    "rigidimeter.virtual.batch",  # compiled
)
"""Fronts within a room."""

NOT_YET = tuple(f"rigidimeter.analysis.{room}" for room in ("reading",))
"""Rooms whose insides are imported; fewer with time, since the ceiling of their number may fall."""

COMMANDS = "rigidimeter.cli"
"""The shell, which nothing but its tests imports."""


def fronts() -> set[str]:
    """Return every island without rooms, every room and every module beside them."""
    found = set(ALSO)
    for island in ISLANDS:
        rooms = {
            path.stem
            for path in (SOURCE / "rigidimeter" / island).iterdir()
            if path.name != "__init__.py"
            and (path.suffix == ".py" or (path / "__init__.py").exists())
        }
        whole = island in ("model", "planning", "virtual", "paper", "testing", "cli")
        found |= (
            {f"rigidimeter.{island}"} if whole else {f"rigidimeter.{island}.{r}" for r in rooms}
        )
    return found


def module_of(path: Path) -> str:
    parts = path.relative_to(SOURCE if SOURCE in path.parents else ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def imports(path: Path) -> Iterator[tuple[int, str]]:
    if path.suffix == ".md":
        for number, line in enumerate(path.read_text("utf-8").splitlines(), start=1):
            if found := re.match(r"\s*from (rigidimeter[.\w]*) import", line):
                yield number, found[1]
        return
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.module and not node.level:
            yield node.lineno, node.module
        elif isinstance(node, ast.Import):
            yield from ((node.lineno, alias.name) for alias in node.names)


def past_a_front() -> Iterator[tuple[str, str]]:
    """Yield each room whose inside is imported from outside, and where."""
    known = fronts()

    def front_of(module: str) -> str:
        return max(
            (front for front in known if f"{module}.".startswith(f"{front}.")), key=len, default=""
        )

    for folder in ("src", "tests", "benchmarks", "examples", "docs"):
        for path in sorted([*(ROOT / folder).rglob("*.py"), *(ROOT / folder).rglob("*.md")]):
            own = front_of(module_of(path))
            for line, module in imports(path):
                front = front_of(module)
                if front not in (module, own, "", COMMANDS):
                    yield front, f"{path.relative_to(ROOT)}:{line} imports {module}, not {front}"


def test_every_room_is_imported_through_its_front() -> None:
    found = list(past_a_front())
    past = [sentence for front, sentence in found if front not in NOT_YET]
    assert not past, "\n".join(past)
    assert set(NOT_YET) == {front for front, _ in found}, "a room that has its front leaves NOT_YET"


def test_no_room_is_added_to_those_without_a_front() -> None:
    assert len(NOT_YET) <= highest()["fronts"]["not_yet"]
