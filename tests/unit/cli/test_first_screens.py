"""What a command prints by default is one screen: 24 lines of 80 columns."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.unit.analysis.report.cohorts import Design, made_study

from rigidimeter.analysis.reading import Recording
from rigidimeter.analysis.report import Shown
from rigidimeter.cli.comparison_text import comparison_blocks
from rigidimeter.cli.estimate_text import estimate_blocks
from rigidimeter.cli.terminal_tables import text_lines
from rigidimeter.core.records import Analysis

ROWS, COLUMNS = 24, 80


def assert_one_screen(lines: list[str]) -> None:
    shown = "\n".join(lines)
    assert len(lines) <= ROWS, shown
    assert max(map(len, lines)) <= COLUMNS, shown


@pytest.fixture(scope="module")
def study() -> Shown:
    return made_study(Design(days=(6, 6), epochs=(5, 5), scores=(3, 3), both_on_a_day=True))


def of_sources(study: Shown, *sources: str) -> tuple[Recording, Analysis]:
    """Return these recordings, and what was estimated of them."""
    fits, scores = (
        tuple(one for one in results if one.source in sources)
        for results in (study.analysis.fits, study.analysis.scores)
    )
    analysis = replace(study.analysis, fits=fits, fixed_inertia=fits, scores=scores)
    epochs = tuple(epoch for epoch in study.epochs if epoch.source in sources)
    return Recording(epochs, (), study.study.settings, ()), analysis


def test_estimates_of_one_session_of_five_epochs_and_three_sinusoids(study) -> None:
    read, analysis = of_sources(study, study.study.sessions[6].source)
    assert (len(analysis.fits), len(analysis.scores)) == (5, 3)
    assert_one_screen(text_lines(estimate_blocks(read, analysis)))


def test_estimates_of_sixteen_sessions() -> None:
    made = made_study(Design(days=(8, 8), epochs=(5, 5), scores=(3, 3), both_on_a_day=True))
    read, analysis = of_sources(made, *(session.source for session in made.study.sessions))
    assert len({fit.source for fit in analysis.fits}) == 16
    assert_one_screen(text_lines(estimate_blocks(read, analysis)))


def test_a_study_with_ratings(study) -> None:
    assert study.study.ratings is not None
    assert_one_screen(text_lines(comparison_blocks(study)))


def test_one_recording_of_each_condition(study) -> None:
    read, analysis = of_sources(study, *(session.source for session in study.study.sessions[4:6]))
    assert {fit.condition for fit in analysis.fits} == {"OFF", "DBS"}
    shown = Shown.of_recording(read, analysis)
    assert_one_screen(text_lines(comparison_blocks(shown)))


def test_commands_on_files(rigidimeter, tmp_path: Path, monkeypatch) -> None:
    """A file without the perturbation, of 5 epochs: `estimate`, and `compare` with another."""
    monkeypatch.chdir(tmp_path)
    rng = np.random.default_rng(1)
    time_s = np.arange(10_000) / 200
    for name, stiffness in (("off", 1.751), ("dbs", 1.3)):
        parts = [(f, rng.uniform(0, 2 * np.pi)) for f in (0.3, 0.7, 1.3, 2.3, 3.7, 5.3, 7.1)]
        angle = sum(0.02 * np.sin(2 * np.pi * f * time_s + phase) for f, phase in parts)
        velocity = np.gradient(angle, time_s)
        torque = 0.0045 * np.gradient(velocity, time_s) + 0.137 * velocity + stiffness * angle
        torque += 0.01 * rng.standard_normal(torque.size)
        np.savez(f"{name}.npz", time_s=time_s, torque_nm=torque, angle_rad=angle)
    options = ("--epoch-length-s", 10)
    ran = rigidimeter("estimate", "off.npz", *options)
    assert ran.status == 0, ran.err
    assert_one_screen(ran.out.splitlines())
    names = ("--condition", "OFF", "--condition", "DBS")
    ran = rigidimeter("compare", "off.npz", "dbs.npz", *names, *options)
    assert ran.status == 0, ran.err
    assert_one_screen(ran.out.splitlines())


@pytest.fixture
def noisy(tmp_path: Path, monkeypatch) -> list[str]:
    """Three recordings whose torque has friction, a tremor and noise, is late and is clipped."""
    monkeypatch.chdir(tmp_path)
    rng = np.random.default_rng(7)
    time_s = np.arange(12_000) / 200
    names = ["a.npz", "b.npz", "c.npz"]
    for name in names:
        parts = [(f, rng.uniform(0, 2 * np.pi)) for f in (0.3, 0.7, 1.3, 2.3, 3.7, 5.3, 7.1, 11.3)]
        angle = sum(0.02 * np.sin(2 * np.pi * f * time_s + phase) for f, phase in parts)
        velocity = np.gradient(angle, time_s)
        torque = 0.0045 * np.gradient(velocity, time_s) + 0.137 * velocity + 1.7 * angle
        torque += 0.15 * np.sign(velocity) + 0.3 * np.sin(2 * np.pi * 5.1 * time_s)
        torque = np.roll(torque + 0.2 * rng.standard_normal(time_s.size), 2)
        torque = np.clip(torque, -0.9, 0.9)
        np.savez(name, time_s=time_s, torque_nm=torque, angle_rad=angle)
    return names


def test_estimates_of_three_noisy_recordings(rigidimeter, noisy) -> None:
    """Three findings of two lines at most, and excluded epochs with their recordings."""
    ran = rigidimeter("estimate", *noisy, "--epoch-length-s", 10)
    assert ran.status == 1, ran.err  # no epoch counts
    assert_one_screen(ran.out.splitlines())
    assert ran.out.count("\n caution") + ran.out.count("\n exclude ") <= 3
    excluded = [line for line in ran.out.splitlines() if line.startswith(" excluded ")]
    assert len(excluded) == 1
    assert ".npz: " in excluded[0]
