"""The examples of the how-to: what is added from outside the package by one file and --load."""

import json
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rigidimeter.analysis.estimation import CHECKS, METHODS, TERMS
from rigidimeter.core.findings import KINDS

ROOT = Path(__file__).parents[3]
HOW_TO = ROOT / "docs" / "development" / "add-an-estimator.md"
EXAMPLES = re.findall(r"```python\n(.*?)```", HOW_TO.read_text("utf-8"), re.S)
ESTIMATOR, CHECK, TERM = EXAMPLES


@pytest.fixture(autouse=True)
def _forget() -> Iterator[None]:
    """Take out of the lists what a test has loaded."""
    lists: tuple[list[Any], ...] = (METHODS, CHECKS, TERMS)
    kinds = dict(KINDS)
    known = [each[:] for each in lists]
    yield
    for each, before in zip(lists, known, strict=True):
        each[:] = before
    KINDS.clear()
    KINDS.update(kinds)


@pytest.fixture
def estimator(tmp_path: Path) -> Path:
    path = tmp_path / "robust.py"
    path.write_text(ESTIMATOR)
    return path


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    t = np.arange(8000) / 400.0
    w = 2 * np.pi * np.arange(0.2, 20.0, 0.35)
    phase = np.outer(w, t) + np.random.default_rng(1).uniform(0, 2 * np.pi, w.size)[:, None]
    size = 0.05 / (1 + w)
    x, v, a = size @ np.sin(phase), (size * w) @ np.cos(phase), -(size * w**2) @ np.sin(phase)
    table = np.column_stack([t, 0.0045 * a + 0.14 * v + 1.7 * x, x])
    path = tmp_path / "joint.csv"
    header = "time_s,torque_nm,angle_rad"
    np.savetxt(path, table, "%.17g", delimiter=",", header=header, comments="")
    return path


def test_the_help_names_it(rigidimeter, estimator):
    named = "robust (least squares in which large residuals count less)"
    assert named not in " ".join(rigidimeter("estimate", "--help-all").out.split())
    ran = rigidimeter("--load", estimator, "estimate", "--help-all")
    assert named in " ".join(ran.out.split())
    assert "bandlimited (least squares" in " ".join(ran.out.split())


def test_estimate_and_report_use_it(rigidimeter, estimator, recording, tmp_path):
    chosen = ["--method", "robust", recording]
    ran = rigidimeter("estimate", *chosen)
    assert ran.status == 1
    assert "known: auto, published, bandlimited, iv, spectral)" in ran.err
    ran = rigidimeter("--load", estimator, "estimate", *chosen, "--json", tmp_path / "e.json")
    assert ran.status == 0, ran.err
    document = json.loads((tmp_path / "e.json").read_text())
    assert document["method"] == "robust"
    (epoch,), (fixed,) = document["epochs"], document["fixed_inertia"]["epochs"]
    assert epoch["stiffness_nm_rad"] == pytest.approx(1.7, rel=0.01)
    assert fixed["inertia_kg_m2"] == epoch["inertia_kg_m2"] == pytest.approx(0.0045, rel=0.02)
    assert epoch["stiffness_nm_rad_se"] is None
    ran = rigidimeter("report", *chosen, "--out", tmp_path / "report")
    assert ran.status == 0, ran.err
    page = (tmp_path / "report" / "report.html").read_text("utf-8")
    assert "least squares in which large residuals count less" in page


def test_a_check_is_one_entry(rigidimeter, recording, tmp_path):
    (tmp_path / "near_range.py").write_text(CHECK.replace("9.0", "0.001"))
    ran = rigidimeter(
        "--load",
        tmp_path / "near_range.py",
        "estimate",
        recording,
        "--full",
        "--json",
        tmp_path / "e.json",
    )
    assert ran.status == 0, ran.err
    (epoch,) = json.loads((tmp_path / "e.json").read_text())["epochs"]
    (found,) = (found for found in epoch["findings"] if found["name"] == "near_range")
    assert (found["level"], found["unit"]) == ("caution", "N·m")
    assert found["headline"] == f"The torque reaches {found['value']:.3g} N·m"
    assert f"caution near_range {found['headline']}" in " ".join(ran.out.split())
    ran = rigidimeter("--load", tmp_path / "near_range.py", "explain", "near_range")
    assert "The torque reaches 9.7 N·m." in ran.out
    assert "Use a smaller perturbation." in ran.out


@pytest.mark.parametrize(("where", "level"), [("if pull", "caution"), ("if not pull", "note")])
def test_a_check_may_say_where_its_failure_is_harmless(
    rigidimeter, recording, tmp_path, where, level
):
    """The recording has no perturbation, so that only the second of the two says a reason."""
    check = CHECK.replace("9.0", "0.001").replace("if pull", where)
    (tmp_path / "near_range.py").write_text(check)
    out = tmp_path / "e.json"
    ran = rigidimeter("--load", tmp_path / "near_range.py", "estimate", recording, "--json", out)
    assert ran.status == 0, ran.err
    (epoch,) = json.loads(out.read_text())["epochs"]
    (found,) = (found for found in epoch["findings"] if found["name"] == "near_range")
    assert found["level"] == level


def test_a_term_of_the_torque_is_one_entry(rigidimeter, recording, tmp_path):
    path = tmp_path / "quintic.py"
    path.write_text(TERM)
    assert "quintic" in rigidimeter("--load", path, "model", "--help-all").out
    ran = rigidimeter("--load", path, "model", recording, "--terms", "stiffness,quintic")
    assert ran.status == 0, ran.err
    assert "N·m/rad⁵" in ran.out


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("absent.py", None, "absent.py: there is no such file"),
        ("bad.py", "1 / 0", "bad.py: ZeroDivisionError: division by zero"),
        ("bad.py", "def", "bad.py: SyntaxError: invalid syntax"),
        ("notes.txt", "text", "is not a Python file; its name must end in .py"),
    ],
)
def test_a_file_that_cannot_be_loaded_is_named(rigidimeter, tmp_path, name, text, words):
    if text is not None:
        (tmp_path / name).write_text(text)
    ran = rigidimeter("--load", tmp_path / name, "estimate", "--help-all")
    assert ran.status == 1
    assert words in ran.err


def test_an_interruption_is_one_line(rigidimeter, tmp_path):
    path = tmp_path / "interrupts.py"
    path.write_text("raise KeyboardInterrupt")
    ran = rigidimeter("--load", path, "estimate", "--help-all")
    assert (ran.status, ran.err.strip()) == (130, "rigidimeter: interrupted")


def test_an_interruption_while_the_commands_are_built_is_one_line():
    code = """
import signal
from rigidimeter.cli import main
main.app = lambda: signal.raise_signal(signal.SIGINT)
try:
    main.main()
finally:
    signal.raise_signal(signal.SIGINT)  # once more: it ends already
"""
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert (ran.returncode, ran.stderr.strip()) == (130, "rigidimeter: interrupted")
