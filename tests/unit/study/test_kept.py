"""What is kept of an analysis, and what is said to be new the next time."""

import json
from pathlib import Path

import pytest

from rigidimeter.study import UNCHANGED, analyse_study, keep, read_study

RESAMPLES = 100


def kept(folder: Path, **options) -> list[str]:
    read = read_study(folder, **options)
    study = analyse_study(read, resamples=RESAMPLES)
    assert study.cohort is not None
    return keep(read, study, study.cohort, 1, RESAMPLES)


def state(folder: Path) -> dict[str, tuple[bytes, int]]:
    return {p.name: (p.read_bytes(), p.stat().st_mtime_ns) for p in (folder / "analysis").iterdir()}


def test_the_second_time_nothing_is_written(study: Path) -> None:
    assert kept(study) == []
    before = state(study)
    assert {"inputs.json", "estimates.json", "comparison.json", "days.csv"} <= set(before)
    assert kept(study) == [UNCHANGED]
    assert state(study) == before


def test_another_place_gives_the_same_bytes(study: Path, tmp_path: Path) -> None:
    kept(study)
    moved = tmp_path / "elsewhere"
    one = {name: data for name, (data, _) in state(study).items()}
    study.rename(moved)
    assert kept(moved) == [UNCHANGED]
    assert {name: data for name, (data, _) in state(moved).items()} == one


def test_inputs_hold_a_digest_of_every_file(study: Path) -> None:
    kept(study)
    inputs = json.loads((study / "analysis/inputs.json").read_text())
    assert inputs["schema"] == "rigidimeter.study-inputs/1"
    sessions = [p for p in (study / "sessions").rglob("*") if p.is_file()]
    names = {str(p.relative_to(study)) for p in sessions}
    assert set(inputs["files"]) == names | {"study.toml", "sessions.csv", "ratings.csv"}
    assert inputs["seed"] == 1
    assert inputs["settings"]["scores"]["cycles"] == 4


def test_a_new_exclusion_is_told_with_the_numbers_it_moved(study: Path) -> None:
    kept(study)
    before = json.loads((study / "analysis/comparison.json").read_text())
    (study / "exclusions.csv").write_text("path,epoch,reason,by\nsessions/2-OFF,1,coughed,NB\n")
    said = kept(study)
    after = json.loads((study / "analysis/comparison.json").read_text())
    assert "inputs that are new: exclusions.csv" in said
    impulse = next(text for text in said if text.startswith("impulse_nm_s:"))
    one, two = (found["comparisons"][0]["p"] for found in (before, after))
    assert f"p {one:.4g} → {two:.4g}" in impulse
    assert "n OFF 6 → 5" in impulse
    assert "epochs left out: count 0 → 1" in said
    (study / "exclusions.csv").unlink()
    assert "inputs that are gone: exclusions.csv" in kept(study)
    assert json.loads((study / "analysis/comparison.json").read_text()) == before


def test_a_changed_input_without_effect_says_only_that(study: Path) -> None:
    kept(study)
    with (study / "sessions.csv").open("a") as file:
        file.write("\n")
    assert kept(study) == ["inputs that are changed: sessions.csv"]


def test_changed_settings_are_named(study: Path) -> None:
    kept(study)
    from rigidimeter.settings import dump_settings, parse_settings

    read = read_study(study)
    values = dump_settings(read.settings)
    values["scores"]["band_high_hz"] = 6.0
    said = kept(study, settings=parse_settings(values))
    assert "setting scores.band_high_hz: 5.0 → 6.0" in said


def test_a_result_that_was_edited_is_noticed_and_not_lost(study: Path) -> None:
    kept(study)
    path = study / "analysis/comparison.json"
    written = path.read_text()
    path.write_text(written.replace("Small study", "Large study"))
    said = kept(study)
    assert len(said) == 1
    assert "analysis/comparison.json was changed by hand" in said[0]
    assert path.read_text() == written
    assert "Large study" in (study / "analysis/comparison.json.edited").read_text()
    assert kept(study) == [UNCHANGED]


def test_a_result_that_is_gone_is_written_again(study: Path) -> None:
    kept(study)
    (study / "analysis/days.csv").unlink()
    assert kept(study) == ["analysis/days.csv was taken away; it is written again"]
    assert (study / "analysis/days.csv").exists()


def test_a_table_that_no_longer_exists_is_taken_away(study: Path) -> None:
    kept(study)
    (study / "ratings.csv").unlink()
    said = kept(study)
    assert "ratings, contrast is no longer there" in said
    assert not (study / "analysis/ratings.csv").exists()


@pytest.mark.parametrize("text", ["{", "[]", '{"schema": "other"}'])
def test_damaged_inputs_are_said(study: Path, text: str) -> None:
    kept(study)
    (study / "analysis/inputs.json").write_text(text)
    assert kept(study) == ["analysis/inputs.json is damaged, so what has changed since is unknown"]
