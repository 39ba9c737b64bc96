"""The examples for MATLAB and R read our files, and we read theirs; Octave runs those of MATLAB."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest
from typer.testing import CliRunner

import rigidimeter as rm
from rigidimeter.cli.main import app

EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What the commands of the pages make, of a session of two epochs."""
    made = tmp_path_factory.mktemp("languages")
    session = made / "session"
    for words in (
        ["simulate", "--out", str(session), "--task", "prbs", "--epochs", "2"],
        ["export", str(session), "--to", "mat", "--out", str(made / "session.mat")],
        ["estimate", str(session), "--json", str(made / "estimates.json")],
        ["estimate", str(session), "--csv", str(made / "estimates.csv")],
    ):
        assert CliRunner().invoke(app, words).exit_code == 0, words
    return made


def ran(program: str, folder: Path, *words: str) -> str:
    """Run a program in the folder, and return what it printed; skip where it is not installed."""
    if shutil.which(program) is None:
        pytest.skip(f"{program} is not installed")
    done = subprocess.run(
        [program, *words], cwd=folder, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_matlab(folder: Path) -> None:
    printed = ran("octave-cli", folder, "--quiet", str(EXAMPLES / "matlab" / "elbow.m"))
    found = re.findall(r"epoch (\d): .* K ([\d.]+) \(", printed)
    assert [epoch for epoch, _ in found] == ["1", "2"]
    assert float(found[0][1]) == pytest.approx(1.75, rel=0.01)  # [subject.OFF] by default
    assert_read(folder / "mine.mat")


def test_r(folder: Path) -> None:
    example = EXAMPLES / "r" / "read_estimates.R"
    printed = ran("Rscript", folder, str(example), "estimates.csv")
    assert float(printed.split()[-1]) == pytest.approx(1.75, rel=0.01)
    assert_read(folder / "mine.csv")


def assert_read(path: Path) -> None:
    """Check that the recording which the example wrote has its stiffness, 1.8 N·m/rad."""
    (fit,) = rm.estimate(rm.read(path)).fits
    assert fit.value[2] == pytest.approx(1.8, rel=0.01)
