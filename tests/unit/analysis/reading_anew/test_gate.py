"""The rules of the gate: each with a file that it must catch and one that it must let pass."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from tests.known_joint import angle_rad, torque_nm

from rigidimeter.analysis.reading_anew import RULES, columns_of, mapping_of, read_file, verdict
from rigidimeter.core.errors import UserError

RATE_HZ = 200.0
T = np.arange(4000) / RATE_HZ
M, A, W = torque_nm(T, 1), angle_rad(T, 1), angle_rad(T, 1, 1)
D = np.degrees(A)
SLOW_T = np.arange(800) / 10
SLOW_A = 0.3 * np.sin(2 * np.pi * SLOW_T / 40) + 0.02 * np.sin(2 * np.pi * 0.3 * SLOW_T)
FAST_T = np.arange(40_000) / 1e4
TURNING = 3.0 * T

Table = dict[str, np.ndarray]
ANGLE, VELOCITY = "angle_rad", "velocity_rad_s"


def table(motion: str, values: np.ndarray, torque: np.ndarray = M, time_s: np.ndarray = T) -> Table:
    return {"time_s": time_s, "torque_nm": torque, motion: values}


def knee() -> np.ndarray:
    """Return 300 N·m of an isokinetic knee: large for an arm, possible for a joint."""
    return M * 300.0 / np.max(np.abs(M))


CASES: dict[tuple[str, str], tuple[Table, Table]] = {
    # rule and motion: what it must catch, what it must let pass
    ("rate", ANGLE): (table(ANGLE, A, time_s=1e3 * T), table(ANGLE, SLOW_A, SLOW_A, SLOW_T)),
    ("rate", VELOCITY): (
        table(VELOCITY, W, time_s=1e3 * T),
        table(VELOCITY, np.gradient(SLOW_A, SLOW_T), SLOW_A, SLOW_T),
    ),
    ("slow motion", ANGLE): (
        table(ANGLE, np.repeat(A, 50)[:20_000], np.repeat(M, 50)[:20_000], np.arange(20_000) / 6.0),
        table(ANGLE, SLOW_A, SLOW_A, SLOW_T),
    ),
    ("slow motion", VELOCITY): (
        table(
            VELOCITY, np.repeat(W, 50)[:20_000], np.repeat(M, 50)[:20_000], np.arange(20_000) / 6.0
        ),
        table(VELOCITY, np.gradient(SLOW_A, SLOW_T), SLOW_A, SLOW_T),
    ),
    ("fast motion", ANGLE): (
        table(ANGLE, A, time_s=1e-3 * T),
        table(ANGLE, angle_rad(FAST_T, 1), torque_nm(FAST_T, 1), FAST_T),
    ),
    ("fast motion", VELOCITY): (
        table(VELOCITY, W, time_s=1e-3 * T),
        table(VELOCITY, angle_rad(FAST_T, 1, 1), torque_nm(FAST_T, 1), FAST_T),
    ),
    ("large torque", ANGLE): (table(ANGLE, A, 1e4 * M), table(ANGLE, A, knee())),
    ("large torque", VELOCITY): (table(VELOCITY, W, 1e4 * M), table(VELOCITY, W, knee())),
    ("one turn", ANGLE): (table(ANGLE, D + 40), table(ANGLE, TURNING + A, M)),
    ("speed of the angle", ANGLE): (
        table(ANGLE, D / 8 * (2 * np.pi / np.max(np.abs(D / 8))) * 0.99),
        table(ANGLE, A * 8 / np.quantile(np.abs(W), 0.99)),
    ),
    ("speed of the velocity", VELOCITY): (
        table(VELOCITY, np.degrees(W)),
        table(VELOCITY, W * 8 / np.quantile(np.abs(W), 0.99)),
    ),
    ("both motions", VELOCITY): (
        {**table(ANGLE, A), VELOCITY: np.degrees(W) / 10},
        {**table(ANGLE, A), VELOCITY: W + np.random.default_rng(1).normal(scale=0.3, size=T.size)},
    ),
    ("N·m or N·mm", ANGLE): (table(ANGLE, A, knee()), table(ANGLE, A)),
    ("N·m or N·mm", VELOCITY): (table(VELOCITY, W, knee()), table(VELOCITY, W)),
    ("rad or deg", ANGLE): (
        table(ANGLE, A * 8 / np.quantile(np.abs(W), 0.99)),
        table(ANGLE, A * 2.2 / np.quantile(np.abs(W), 0.99)),
    ),
    ("rad/s or deg/s", VELOCITY): (
        table(VELOCITY, W * 8 / np.quantile(np.abs(W), 0.99)),
        table(VELOCITY, W * 2.2 / np.quantile(np.abs(W), 0.99)),
    ),
}


def broken_by(folder: Path, columns: Table) -> set[str]:
    """Return the rules that a file of these columns breaks."""
    path = folder / "r.csv"
    rows = np.column_stack([*columns.values()])
    np.savetxt(path, rows, fmt="%.9g", delimiter=",", header=",".join(columns), comments="")
    said = mapping_of()
    return {fault.rule for fault in verdict(columns_of(path, said), said).faults}


def test_every_rule_has_its_two_files_for_every_motion_that_it_is_about() -> None:
    of_motion = {"angle": {ANGLE}, "velocity": {VELOCITY}}
    needed = {
        (rule.name, motion)
        for rule in RULES
        for motion in of_motion.get(rule.quantity, {ANGLE, VELOCITY})
    }
    assert needed == set(CASES)


@pytest.mark.parametrize(("rule", "motion"), CASES)
def test_a_rule_catches_what_it_is_for(tmp_path: Path, rule: str, motion: str) -> None:
    assert rule in broken_by(tmp_path, CASES[rule, motion][0])


@pytest.mark.parametrize(("rule", "motion"), CASES)
def test_a_rule_lets_pass_what_a_joint_can_do(tmp_path: Path, rule: str, motion: str) -> None:
    assert rule not in broken_by(tmp_path, CASES[rule, motion][1])


@pytest.mark.parametrize(
    ("columns", "rule"),
    [
        (table(ANGLE, A, -M), "sign"),
        (table(VELOCITY, W, -M), "sign"),
        (table(ANGLE, M, A), "exchanged"),
        (table(ANGLE, A), ""),
        (table(VELOCITY, W), ""),
    ],
)
def test_signs_and_exchanged_columns(tmp_path: Path, columns: Table, rule: str) -> None:
    assert broken_by(tmp_path, columns) == ({rule} if rule else set())


def test_a_wrong_clock_is_said_before_what_follows_from_it(tmp_path: Path) -> None:
    assert broken_by(tmp_path, table(ANGLE, A, -M, 1e3 * T)) <= {"rate", "slow motion"}


def test_what_a_person_says_is_believed_and_said(tmp_path: Path) -> None:
    path = tmp_path / "r.csv"
    rows = np.column_stack([T, M, A * 8 / np.quantile(np.abs(W), 0.99)])
    np.savetxt(path, rows, delimiter=",", header="t [s],M [Nm],phi [rad]", comments="")
    with pytest.raises(UserError, match="unusually fast"):
        read_file(path)
    found = read_file(path, mapping_of(unit={"angle": "rad"}))
    assert any("it is read as the unit that was given says" in n.text for n in found.notices)


def test_a_short_recording_is_not_judged(tmp_path: Path) -> None:
    short = {name: values[:800] for name, values in table(ANGLE, D + 40).items()}
    assert broken_by(tmp_path, short) == set()
