"""No test runs a session that is not replayed."""

from __future__ import annotations

import re
from pathlib import Path

from tests import replayed
from tests.unit.rig.acquisition.whole_session import session

TESTS = Path(__file__).parents[2]
RUNS = re.compile(r"\brun_(virtual_)?session\(")
REPLAYS = ("assert_folder_replayed", "sessions_replayed")
DEFINES = {"tests/replayed.py", "tests/faults/session.py"}
"""The second is another process, whose sessions `tests.faults.kills` ends and replays."""


def test_every_file_that_runs_a_session_replays_it_or_stands_in_a_folder_whose_sessions_are():
    found, without = 0, []
    for path in sorted(TESTS.rglob("*.py")):
        name = path.relative_to(TESTS.parent).as_posix()
        if name in DEFINES or not RUNS.search(path.read_text(encoding="utf-8")):
            continue
        found += 1
        places = [path, *(folder / "conftest.py" for folder in path.parents)]
        inside = [place for place in places if TESTS in place.parents and place.is_file()]
        texts = [place.read_text(encoding="utf-8") for place in inside]
        if "assert_folder_replayed" not in texts[0] and not any(
            "sessions_replayed" in text for text in texts
        ):
            without.append(name)
    assert found > 10
    assert without == []


def test_a_session_that_a_test_runs_is_taken_down_and_counted():
    before = dict(replayed.COUNTED)
    ran = session()
    assert replayed.COUNTED["run"] == before["run"] + 1
    (kept,) = replayed.Recorded.kept
    assert kept.samples == ran.sink.samples
    assert replayed.COUNTED["replayed"] == before["run"]  # of all that were run before this one
