"""The examples run as their docstrings say."""

import runpy
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from rigidimeter.cli.main import app

EXAMPLES = Path(__file__).parents[2] / "examples"


def run(name: str, argument: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "argv", [name, str(argument)])
    runpy.run_path(str(EXAMPLES / name), run_name="__main__")


@pytest.mark.usefixtures("no_figures")
def test_from_python_goes_from_design_to_report(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    example = runpy.run_path(str(EXAMPLES / "from_python.py"))
    for block in example["SETTINGS"]["protocol"]["blocks"]:
        block["epochs"] = 2  # of 3
    example["main"](tmp_path / "out")
    printed = capsys.readouterr().out
    stiffness = float(printed.split("K = ")[1].split()[0])
    assert stiffness == pytest.approx(1.751, rel=2e-3)  # [subject.OFF] by default
    assert (tmp_path / "out/report/report.html").exists()


def test_filter_alike_shows_that_a_filter_on_the_position_alone_biases(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    session = tmp_path / "session"
    words = ["simulate", "--out", str(session), "--task", "prbs", "--epochs", "2"]
    assert CliRunner().invoke(app, words).exit_code == 0
    run("filter_alike.py", session, monkeypatch)
    rows = [line.split() for line in capsys.readouterr().out.splitlines()[1:]]
    inertia_percent = {" ".join(row[:-4]): float(row[-4]) for row in rows}
    assert abs(inertia_percent["all four, zero phase"]) < 2.0
    assert abs(inertia_percent["position only, causal"]) > 10.0
