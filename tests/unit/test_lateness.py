"""The probe beside the tests by the clock: it sees a machine that stands still, and says so."""

import os
import re
import signal
import time
from pathlib import Path

import pytest
from tests import lateness
from tests.__main__ import TIMED, progress, too_many_unjudged
from tests.conftest import REALTIME
from tests.lateness import ATTEMPTS, LatenessProbe


def test_a_probe_that_was_held_up_says_for_how_long():
    with LatenessProbe() as probe:
        began_s = time.monotonic()
        os.kill(probe._process.pid, signal.SIGSTOP)
        time.sleep(0.2)
        assert probe.worst_s(began_s) > 0.15  # it is late just now
        os.kill(probe._process.pid, signal.SIGCONT)
        while probe.stood_still_s() < 0.15:
            time.sleep(0.001)
        assert probe.allowed_s > 0.15
        assert probe.stood_still_s() <= time.monotonic() - probe._began_s


class Still(LatenessProbe):
    """Beside a machine that stands still for 0.2 s in the first so many attempts."""

    left = 0

    def stood_still_s(self):
        return 0.2 if self.left >= 0 else 0.0

    def worst_s(self, since_s):
        self.allowed_s = self.stood_still_s()
        return self.allowed_s

    def __enter__(self):
        type(self).left -= 1
        self.allowed_s, self._began_s = 0.0, 0.0
        return self

    def __exit__(self, *_):
        pass


def judged_once(pytester, body, *options):
    """Run a test of that body beside the probe; `ran` gets a letter for each attempt."""
    pytester.makeconftest(
        "from tests.conftest import pytest_addoption, pytest_terminal_summary\n"
        "from tests.lateness import run_beside_probe\n"
        "def pytest_runtest_protocol(item, nextitem):\n"
        "    return run_beside_probe(item, nextitem)\n"
    )
    pytester.makepyfile(
        "import pytest\n"
        "from tests.lateness import PRESENT\n"
        "@pytest.mark.realtime\n"
        "def test_it():\n"
        "    with open('ran', 'a') as file:\n"
        "        file.write('x')\n"
        f"    {body}\n"
    )
    return pytester.runpytest_inprocess("-rs", "-p", "no:cacheprovider", "-W", "ignore", *options)


@pytest.mark.parametrize(
    ("body", "still", "outcome", "runs"),
    [
        ("assert True", 9, "passed", 1),  # it did not ask how late the machine was
        ("assert PRESENT[0].worst_s(0.0) < 9", 2, "passed", 3),
        ("assert PRESENT[0].worst_s(0.0) < 9", 9, "skipped", ATTEMPTS),
        ("assert False", 9, "skipped", ATTEMPTS),
        ("assert False", 0, "failed", 1),
    ],
)
def test_a_machine_that_stood_still_is_no_judge(pytester, monkeypatch, body, still, outcome, runs):
    monkeypatch.setattr(lateness, "LatenessProbe", Still)
    monkeypatch.setattr(Still, "left", still)
    monkeypatch.setattr(lateness, "PAUSE_S", 0.0)
    ran = judged_once(pytester, body)
    ran.assert_outcomes(**{outcome: 1})
    assert (pytester.path / "ran").read_text() == "x" * runs
    assert ("too busy to judge" in ran.stdout.str()) == (runs == ATTEMPTS)


@pytest.mark.parametrize(
    ("body", "error"),
    [
        ("assert PRESENT[0].worst_s(0.0) < 9", ""),
        ("assert False, 'late'", "; it last failed with AssertionError: late"),
    ],
)
def test_what_was_not_judged_is_named_and_counted(pytester, monkeypatch, capsys, body, error):
    monkeypatch.setattr(lateness, "LatenessProbe", Still)
    monkeypatch.setattr(Still, "left", 99)
    monkeypatch.setattr(lateness, "PAUSE_S", 0.0)
    name = "test_what_was_not_judged_is_named_and_counted.py::test_it"
    line = f"{name}: the machine is too busy to judge: it woke a sleeping process "
    ran = judged_once(pytester, body)
    assert "= not judged =" in ran.stdout.str()
    assert line in ran.stdout.str()
    path = pytester.path / "unjudged"
    judged_once(pytester, body, "--unjudged", path)
    capsys.readouterr()
    assert not too_many_unjudged(path, 1)
    assert too_many_unjudged(path, 0)
    said = capsys.readouterr().out
    assert said.count("not judged, which is neither passed nor failed: 1\n") == 2
    assert said.count(f"{line}200, 200, 200, 200, 200 ms late in 5 attempts, and this") == 2
    assert said.count(f" test resolves 50 ms{error}\n") == 2
    assert said.count("0 may be left without a result") == 1


def test_what_was_judged_is_not_counted(pytester, tmp_path, capsys):
    for k, body in enumerate(("assert True", "pytest.skip('not here')")):
        path = tmp_path / str(k)
        judged_once(pytester, body, "--unjudged", path)
        capsys.readouterr()
        assert not too_many_unjudged(path, 0)
    assert not too_many_unjudged(tmp_path / "broken off", 0)
    assert capsys.readouterr().out == ""


def test_what_is_shown_at_the_end_says_meanwhile_how_far_it_is():
    assert progress("bringing up nodes...\n") == "tests that keep no time: 0 % done"
    written = "bringing up nodes...\n..s... [  1%]\n.F.xE. [ 43%]\n..."
    assert progress(written) == "tests that keep no time: 43 % done, 2 failed"


def test_make_test_looks_for_tests_in_real_time_wherever_there_are_some():
    root = Path(__file__).parents[2]
    marked = [
        path.relative_to(root).as_posix()
        for path in (root / "tests").rglob("test_*.py")
        if re.search("^@pytest.mark.realtime", path.read_text("utf-8"), re.MULTILINE)
    ]
    assert marked
    assert [each for each in (*marked, *REALTIME) if not each.startswith(tuple(TIMED))] == []


def test_a_long_test_is_not_repeated_for_ever(pytester, monkeypatch):
    monkeypatch.setattr(lateness, "LatenessProbe", Still)
    monkeypatch.setattr(Still, "left", 9)
    monkeypatch.setattr(lateness, "PATIENCE_S", -1.0)
    judged_once(pytester, "assert False").assert_outcomes(skipped=1)
    assert (pytester.path / "ran").read_text() == "x"
