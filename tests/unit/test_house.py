"""The rooms stay within their ceilings; what a rebuilt room shall be is a test from the first day.

A ceiling falls when its number falls: `python -m benchmarks.house --ceilings` prints them. One is
raised in a commit that does nothing else and names the user it is for.
"""

from __future__ import annotations

import ast
import doctest
import hashlib

import pytest
from benchmarks import house
from benchmarks.house import ROOT, SOURCE, House, above, ceilings, code_lines, highest

ROOM = SOURCE / "rigidimeter" / "analysis" / "estimation"
GONE = {
    *("PreparedEpoch", "Look", "Member", "Misfit", "BandChange"),
    *("EpochMotion", "Solved", "VaryingLines", "BeyondLinear", "LineMethod"),
}
"""Types of the room that its rebuilding does without."""
READING = SOURCE / "rigidimeter" / "analysis" / "reading"
READING_DIGEST = "a1b1a0963899826e1fdc095122dd2de69e6e69de8f9c2b29ead715c93043b77f"
"""Of the files of that room, which does not change while its successor is written."""
STUDY = SOURCE / "rigidimeter" / "analysis" / "study"
"""Types for which a row of a comparison is enough."""
NOT_REACHED = pytest.mark.xfail(strict=True, reason="not reached")


@pytest.fixture(scope="module")
def rooms() -> House:
    return House()


@pytest.fixture(scope="module")
def now(rooms: House) -> dict[str, dict[str, int]]:
    return ceilings(rooms)


def test_lines_of_code_are_counted_as_the_example_says() -> None:
    found = doctest.testmod(house)
    assert found.attempted
    assert not found.failed


def test_nothing_is_above_its_ceiling(now: dict[str, dict[str, int]]) -> None:
    assert not above(now, highest())


def test_what_exceeds_its_ceiling_or_has_none_is_named() -> None:
    most = {"rooms": {"model": 10}}
    assert above({"rooms": {"model": 10}}, most) == []
    assert above({"rooms": {"model": 11, "new": 1}}, most) == [
        "[rooms] model: 11, ceiling 10",
        "[rooms] new: 1, ceiling 0",
    ]


def test_every_ceiling_is_of_a_room_that_exists(now: dict[str, dict[str, int]]) -> None:
    assert set(highest()["rooms"]) == set(now["rooms"])


def test_reading_stays_as_it_is_while_its_successor_is_written() -> None:
    digest = hashlib.sha256()
    for path in sorted(READING.rglob("*.py")):
        digest.update(path.relative_to(READING).as_posix().encode() + b"\0" + path.read_bytes())
    assert digest.hexdigest() == READING_DIGEST, f"{READING.relative_to(ROOT)} changed"


class TestEndOfEstimation:
    """The room built anew: what is missing of it is marked, a line each."""

    @pytest.mark.xfail(strict=True, reason="not reached")
    def test_code_lines(self, now: dict[str, dict[str, int]]) -> None:
        assert now["rooms"]["analysis.estimation"] <= 4300 + 487

    def test_code_lines_of_findings(self, now: dict[str, dict[str, int]]) -> None:
        assert now["rooms"]["core.findings"] <= 1050 + 179

    def test_modules(self, rooms: House) -> None:
        assert rooms.rooms["analysis.estimation"][1] <= 22

    def test_folders_and_types_that_are_gone(self, rooms: House) -> None:
        assert not {"closedloop", "diagnostics"} & {path.name for path in ROOM.iterdir()}
        own = [one.tree for one in rooms.modules.values() if one.room == "analysis.estimation"]
        defined = {n.name for tree in own for n in ast.walk(tree) if isinstance(n, ast.ClassDef)}
        assert not defined & GONE

    def test_nothing_is_taken_from_inside(self, now: dict[str, dict[str, int]]) -> None:
        assert not now["inside"].get("analysis.estimation")

    def test_lines_of_its_unit_tests(self) -> None:
        folder = ROOT / "tests" / "unit" / "analysis" / "estimation"
        lines = [len(code_lines(path.read_text("utf-8"))) for path in folder.rglob("*.py")]
        assert sum(lines) <= 1800

    def test_no_circle_touches_it_or_the_rooms_around_it(self, rooms: House) -> None:
        around = ("core.", "analysis.estimation", "analysis.report", "analysis.reading")
        names = [name for circle in rooms.circles for name in circle]
        assert not [n for n in names if n.startswith(tuple(f"rigidimeter.{r}" for r in around))]


class TestEndOfReading:
    """The room that is written in `reading_anew`: what is missing of it is marked, a line each."""

    @pytest.mark.xfail(strict=True, reason="not reached")
    def test_code_lines(self, now: dict[str, dict[str, int]]) -> None:
        assert now["rooms"]["analysis.reading"] <= 5000

    def test_code_lines_of_its_successor(self, now: dict[str, dict[str, int]]) -> None:
        assert now["rooms"].get("analysis.reading_anew", 0) <= 5000 + 537

    @pytest.mark.xfail(strict=True, reason="not reached")
    def test_code_lines_of_the_command_line(self, now: dict[str, dict[str, int]]) -> None:
        assert now["rooms"]["cli"] <= 2700

    @pytest.mark.xfail(strict=True, reason="not reached")
    def test_modules(self, rooms: House) -> None:
        assert rooms.rooms["analysis.reading"][1] <= 36

    @pytest.mark.xfail(strict=True, reason="not reached")
    def test_one_room(self) -> None:
        assert not READING.with_name("reading_anew").exists()

    @pytest.mark.xfail(strict=True, reason="not reached")
    def test_folder_that_is_gone(self) -> None:
        assert not (READING / "channels").exists()

    @pytest.mark.xfail(strict=True, reason="not reached")
    @pytest.mark.parametrize("name", ["Taken", "Choice", "TableChannels", "Said"])
    def test_types_that_are_gone(self, name: str) -> None:
        trees = [ast.parse(path.read_text("utf-8")) for path in READING.rglob("*.py")]
        defined = [n.name for t in trees for n in ast.walk(t) if isinstance(n, ast.ClassDef)]
        assert name not in defined

    @pytest.mark.xfail(strict=True, reason="not reached")
    def test_nothing_is_taken_from_inside(self, now: dict[str, dict[str, int]]) -> None:
        assert not now["inside"].get("analysis.reading")

    @pytest.mark.xfail(strict=True, reason="not reached")
    def test_every_room_has_its_front(self) -> None:
        assert highest()["fronts"]["not_yet"] == 0

    @pytest.mark.xfail(strict=True, reason="not reached")
    def test_lines_of_its_unit_tests(self) -> None:
        folder = ROOT / "tests" / "unit" / "analysis" / "reading"
        lines = [len(code_lines(path.read_text("utf-8"))) for path in folder.rglob("*.py")]
        assert sum(lines) <= 2200

    def test_no_circle_touches_it(self, rooms: House) -> None:
        names = [name for circle in rooms.circles for name in circle]
        assert not [n for n in names if n.startswith("rigidimeter.analysis.reading")]

    @pytest.mark.xfail(strict=True, reason="not reached")
    @pytest.mark.parametrize(("of", "most"), [("modules", 75), ("functions", 450)])
    def test_way_of_a_csv_to_its_estimate(self, of: str, most: int) -> None:
        assert highest()["ways"][f"estimate {of}"] <= most


class TestEndOfStudy:
    """The study as one long table: what is missing of it is marked, a line each."""

    @NOT_REACHED
    @pytest.mark.parametrize(
        ("parts", "most"),
        [
            (("analysis.study", "analysis.recording", "analysis.traces"), 2900 + 715),
            (("analysis.report", "analysis.figures"), 2900),
            (("cli",), 3000),
        ],
    )
    def test_code_lines(
        self, now: dict[str, dict[str, int]], parts: tuple[str, ...], most: int
    ) -> None:
        """What was moved out of a room counts with it."""
        assert sum(now["rooms"][room] for room in parts) <= most

    @NOT_REACHED
    def test_modules(self, rooms: House) -> None:
        assert rooms.rooms["analysis.study"][1] <= 18

    def test_one_room_alone(self) -> None:
        assert not STUDY.with_name("study_anew").exists()

    @pytest.mark.parametrize(
        "name",
        [
            "Test",
            "Difference",
            "Conclusion",
            "DifferenceRow",
            "DayMedian",
            "Preparation",
        ],
    )
    def test_types_that_are_gone(self, name: str) -> None:
        trees = [ast.parse(path.read_text("utf-8")) for path in STUDY.rglob("*.py")]
        defined = [n.name for t in trees for n in ast.walk(t) if isinstance(n, ast.ClassDef)]
        assert name not in defined

    @pytest.mark.parametrize(
        "room",
        [
            "analysis.study",
            "analysis.report",
        ],
    )
    def test_nothing_is_taken_from_inside(self, now: dict[str, dict[str, int]], room: str) -> None:
        assert not now["inside"].get(room)

    def test_the_room_that_has_no_front_yet_is_reading(self) -> None:
        assert highest()["fronts"]["not_yet"] <= 1

    @NOT_REACHED
    @pytest.mark.parametrize(
        ("parts", "most"),
        [(("study", "recording", "traces"), 1100), (("report", "figures"), 1800)],
    )
    def test_lines_of_unit_tests(self, parts: tuple[str, ...], most: int) -> None:
        folder = ROOT / "tests" / "unit" / "analysis"
        paths = [path for room in parts for path in (folder / room).rglob("*.py")]
        assert sum(len(code_lines(path.read_text("utf-8"))) for path in paths) <= most

    @pytest.mark.parametrize(
        ("way", "most"),
        [
            pytest.param("compare modules", 100, marks=NOT_REACHED),
            pytest.param("compare functions", 800, marks=NOT_REACHED),
            ("estimate modules of study", 0),
        ],
    )
    def test_ways_by_their_ceilings(self, way: str, most: int) -> None:
        """What CI measures is at most its ceiling (`python -m benchmarks.house --trips`)."""
        assert highest()["ways"][way] <= most

    def test_no_circle_anywhere(self, rooms: House) -> None:
        assert not rooms.circles
