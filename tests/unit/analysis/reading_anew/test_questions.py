"""What is asked of a person: all at once, as what can be pasted, and nothing that helps nobody."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import numpy as np
import pytest
from tests.known_joint import angle_rad, torque_nm

from rigidimeter.analysis.reading_anew import (
    Mapping,
    Pick,
    columns_of,
    mapping_of,
    mapping_text,
    merged,
    propose,
    read_file,
    read_mapping,
    verdict,
    words,
)
from rigidimeter.core.errors import UserError

T = np.arange(4000) / 200.0
M, A, W = torque_nm(T, 1), angle_rad(T, 1), angle_rad(T, 1, 1)
D = np.degrees(A)


def csv(folder: Path, head: str, *columns: np.ndarray) -> Path:
    path = folder / "r.csv"
    np.savetxt(path, np.column_stack(columns), "%.9g", ",", header=head, comments="")
    return path


def asked(path: Path, said: Mapping | None = None) -> list[str]:
    said = said or Mapping()
    return verdict(columns_of(path, said), said).sentences


def pasted(text: str) -> Mapping:
    """Return options of the command line, as a person would paste them."""
    given: dict[str, dict[str, str]] = {}
    others: dict[str, object] = {}
    tokens = iter(shlex.split(text))
    for token in tokens:
        key = token.removeprefix("--").replace("-", "_")
        if key in Pick.model_fields:
            name, _, value = next(tokens).partition("=")
            given.setdefault(key, {})[name] = value
        elif key == "reaction":
            others[key] = True
        elif key == "names":
            others[key] = next(tokens).split(",")
        else:
            value = next(tokens)
            kind = {"rate_hz": float, "epoch_length_s": float, "skip_rows": int}.get(key, str)
            others[key] = kind(value)
    return mapping_of(**given, **others)


EVERY = Mapping(
    torque=Pick(column="Fz raw", scale="0.2 m", offset="1 N"),
    angle=Pick(column="phi", unit="deg"),
    velocity=Pick(column="none"),
    epoch_column="Trial",
    rate_hz=250.0,
    reaction=True,
    epoch_length_s=20.0,
    task="prbs",
    skip_rows=3,
    names=("a", "b c"),
    table="Sheet 1",
    missing="0,-999",
)


def test_four_spellings_say_the_same(tmp_path: Path) -> None:
    path = tmp_path / "m.toml"
    path.write_text(mapping_text(EVERY), "utf-8")
    assert read_mapping(path) == EVERY
    assert pasted(shlex.join(words(EVERY))) == EVERY


def test_what_the_user_says_comes_before_the_mapping_file() -> None:
    said = mapping_of(unit={"torque": "N"}, rate_hz=100)
    found = merged(EVERY, said)
    assert (found.torque.unit, found.torque.scale, found.rate_hz) == ("N", "0.2 m", 100.0)
    assert found.epoch_column == "Trial"


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({"column": {"torqe": "x"}}, "the nearest is torque"),
        ({"rate_hz": -1.0}, "rate_hz = -1.0"),
        ({"missing": "0;1"}, "must be numbers with commas"),
        ({"task": "step"}, "'prbs' or 'sinusoid'"),
        ({"column": "torque"}, "column maps quantities to texts"),
    ],
)
def test_a_wrong_keyword_is_named(given: dict[str, object], sentence: str) -> None:
    with pytest.raises(UserError, match=re.escape(sentence)):
        mapping_of(**given)


def test_a_quantity_by_its_stored_name_says_the_unit_of_its_column() -> None:
    assert mapping_of(column={"torque_nm": "Fz"}).torque == Pick(column="Fz", unit="Nm")
    scaled = mapping_of(column={"torque_nm": "Fz"}, scale={"torque": "0.2 m"})
    assert scaled.torque == Pick(column="Fz", scale="0.2 m")


def test_all_questions_come_at_once(tmp_path: Path) -> None:
    path = csv(tmp_path, "t [s],M1 [Nm],M2 [Nm],phi1 [V],phi2 [V]", T, M, M, D, D)
    shown = "\n".join(asked(path))
    for option in ("torque='M1 [Nm]'", "--column 'torque=M2 [Nm]'", "angle=phi1 [V]"):
        assert option.replace("'", "") in shown.replace("'", "")


def test_every_option_of_a_question_leads_on(tmp_path: Path) -> None:
    path = csv(tmp_path, "t [s],M1 [Nm],M2 [Nm],phi [deg]", T, M, M / 2, D)
    (question,) = asked(path)
    options = question.partition("; say ")[2].split(" or ")
    found = [read_file(path, pasted(option)) for option in options]
    assert [len(one.epochs) for one in found] == [1, 1]


def test_columns_that_never_change_are_not_offered(tmp_path: Path) -> None:
    path = csv(tmp_path, "t [s],M1 [Nm],M2 [Nm],M3 [Nm],phi [deg]", T, M, 0 * T + 3, M / 2, D)
    (question,) = asked(path)
    assert "M2" not in question
    assert question.count("--column") == 2


def test_a_quantity_is_left_out_on_purpose(tmp_path: Path) -> None:
    noisy = 0.36 * W + np.random.default_rng(1).normal(scale=0.02, size=T.size)
    path = csv(tmp_path, "t [s],M [Nm],phi [rad],omega [rad/s]", T, M, A, noisy)
    (question,) = asked(path)
    assert "--column velocity=none" in question
    found = read_file(path, mapping_of(column={"velocity": "none"}))
    again = read_file(path, found.mapping)
    for one in (found, again):
        assert set(one.epochs[0].channels) == {"torque_nm", "angle_rad"}


def test_a_time_that_starts_anew_offers_its_runs_as_epochs(tmp_path: Path) -> None:
    runs = np.concatenate([T[:1500], T[:1500], T[:1000]])
    path = csv(tmp_path, "time_s,M [Nm],phi [deg]", runs, M, D)
    (question,) = asked(path)
    option = question.partition("; say ")[2]
    found = read_file(path, pasted(option))
    sizes = [len(one.channels["torque_nm"]) for one in found.epochs]
    assert sizes == [1500, 1500, 1000]


def test_a_factor_that_the_file_states_is_offered_and_can_be_pasted(tmp_path: Path) -> None:
    path = tmp_path / "r.csv"
    rows = np.column_stack([T, M / 1.7, D / 20])
    head = "# torque cell: 1.7 Nm/V\n# goniometer: 20 deg/V\nt [s],torque (V),angle (V)"
    np.savetxt(path, rows, "%.9g", ",", header=head, comments="")
    options = [line.partition("; say ")[2].removesuffix(" (as the file states)")
               for line in asked(path)]  # fmt: skip
    found = read_file(path, pasted(" ".join(options)))
    assert np.allclose(found.epochs[0].channels["angle_rad"].values, A, atol=1e-8)


@pytest.mark.parametrize("label", ["DBS", "stim", "marker", "valid", "state", "set", "phase"])
def test_a_label_that_is_not_used_is_said_with_what_would_use_it(
    tmp_path: Path, label: str
) -> None:
    path = csv(tmp_path, f"t [s],M [Nm],phi [deg],{label}", T, M, D, T > 10)
    texts = [one.text for one in read_file(path).notices]
    assert any(f"--column epoch={label} or --column condition={label}" in text for text in texts)


def test_what_is_proposed_reads_the_file_and_says_why(tmp_path: Path) -> None:
    path = csv(tmp_path, "time,torque [Nm],angle,Trial", 1e3 * T + 0.5, -M, D, T // 10)
    found = propose(columns_of(path, Mapping()), Mapping())
    assert found.verdict.sentences == []
    assert len(found.reasons) == 3
    again = read_file(path, pasted(shlex.join(words(found.mapping))))
    assert [one.label for one in again.epochs] == ["0", "1"]
    assert again.mapping.angle.unit == "deg"


def test_the_unit_of_a_torque_is_never_proposed(tmp_path: Path) -> None:
    path = csv(tmp_path, "t [s],torque,phi [deg]", T, M, D)
    found = propose(columns_of(path, Mapping()), Mapping())
    assert "the unit of 'torque' is stated nowhere" in found.verdict.sentences[0]
