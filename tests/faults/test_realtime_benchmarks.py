"""The benchmarks that keep real time or need a browser run to their end, in their smallest form."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


def printed_by(name: str, *arguments: object) -> str:
    """Run a benchmark in a process of its own and return what it printed."""
    command = [sys.executable, "-m", f"benchmarks.{name}", *map(str, arguments)]
    ran = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stderr
    return ran.stdout


@pytest.mark.skipif(
    shutil.which("cyclictest") is None or os.geteuid() != 0,
    reason="needs root and cyclictest: `apt-get install rt-tests`",
)
def test_lateness_of_the_loop():
    lines = printed_by("loop", "--seconds", 3, "--runs", 1, "--rates", 1000).splitlines()
    recorded, lost = lines[-1].split("|")[2:4]
    assert int(recorded) > 1000
    assert int(lost) == 0
    assert "missed ticks / of cyclictest" in lines[-2]


def test_ticks_beside_emg():
    """EMG is recorded without a gap beside the loop."""
    pytest.importorskip("pylsl", reason="pip install 'rigidimeter[lsl]'")
    case = "two channels at 2 kHz"
    printed = printed_by("emg", "--seconds", 2, "--runs", 1, "--cases", case)
    row, _, words = printed.splitlines()[2:]
    assert words.startswith("The machine was ")
    *_, emg, gaps = row.split("|")[1:-1]
    assert int(emg) > 2000
    assert int(gaps) == 0


@pytest.mark.usefixtures("browser")
def test_stops_from_the_page():
    assert "| click |" in printed_by("console", "--clicks", 1, "--freezes", 1)


@pytest.mark.usefixtures("browser")
def test_opening_a_page(tmp_path):
    page = tmp_path / "report.html"
    page.write_text("<!DOCTYPE html><title>Report</title>", encoding="utf-8")
    assert "loaded after" in printed_by("page", page, "--repeats", 1)
