"""What is kept of an analysis, and what is said to be new the next time."""

import hashlib
import json
import shutil
from pathlib import Path

import pytest

import rigidimeter.analysis.study.archive
from rigidimeter.analysis.study import UNCHANGED, analyse_study, keep, read_study

RESAMPLES = 100
_DAMAGED = """{"schema": "rigidimeter.study-inputs/1", "settings": [2], "files": {},
 "results": {"..": "x", "": "y"}}"""


def kept(folder: Path, **options) -> list[str]:
    read = read_study(folder, **options)
    return keep(read, analyse_study(read, resamples=RESAMPLES))


def state(folder: Path) -> dict[str, tuple[bytes, int]]:
    return {p.name: (p.read_bytes(), p.stat().st_mtime_ns) for p in (folder / "analysis").iterdir()}


@pytest.fixture(scope="module")
def analysed(scored_study: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the study with what is kept of its analysis; it is not to be changed."""
    folder = Path(shutil.copytree(scored_study, tmp_path_factory.mktemp("kept") / "study"))
    assert kept(folder) == []
    return folder


@pytest.fixture
def study(analysed: Path, tmp_path: Path) -> Path:
    """Return a copy of it that a test may change."""
    return Path(shutil.copytree(analysed, tmp_path / "study"))


def test_the_second_time_nothing_is_written(study: Path) -> None:
    before = state(study)
    assert {"inputs.json", "estimates.json", "comparison.json", "days.csv"} <= set(before)
    assert kept(study) == [UNCHANGED]
    assert state(study) == before


def test_another_place_gives_the_same_bytes(study: Path, tmp_path: Path) -> None:
    moved = tmp_path / "elsewhere"
    one = {name: data for name, (data, _) in state(study).items()}
    study.rename(moved)
    assert kept(moved) == [UNCHANGED]
    assert {name: data for name, (data, _) in state(moved).items()} == one


def test_inputs_hold_a_digest_of_every_file(study: Path) -> None:
    inputs = json.loads((study / "analysis/inputs.json").read_text())
    assert inputs["schema"] == "rigidimeter.study-inputs/1"
    sessions = [p for p in (study / "sessions").rglob("*") if p.is_file()]
    names = {str(p.relative_to(study)) for p in sessions}
    assert set(inputs["files"]) == names | {"study.toml", "sessions.csv", "ratings.csv"}
    assert inputs["seed"] == 1
    assert inputs["settings"]["scores"]["cycles"] == 4


def test_digests_are_of_what_was_read_not_of_what_lies_there_now(study: Path) -> None:
    names = ["study.toml", "sessions.csv", "ratings.csv", "sessions/2-OFF/samples.arrows"]
    before = {name: hashlib.sha256((study / name).read_bytes()).hexdigest() for name in names}
    read = read_study(study)
    for name in names:  # changed after it was read, before the result is written
        (study / name).write_bytes((study / name).read_bytes() + b"\n")
    keep(read, analyse_study(read, resamples=RESAMPLES))
    files = json.loads((study / "analysis/inputs.json").read_text())["files"]
    assert {name: files[name] for name in names} == before


def test_a_new_exclusion_is_told_with_the_numbers_it_moved(study: Path) -> None:
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
    with (study / "sessions.csv").open("a") as file:
        file.write("\n")
    assert kept(study) == ["inputs that are changed: sessions.csv"]


def test_changed_settings_are_named(study: Path) -> None:
    from rigidimeter.core.settings import dump_settings, parse_settings

    read = read_study(study)
    values = dump_settings(read.settings)
    values["scores"]["band_high_hz"] = 6.0
    said = kept(study, settings=parse_settings(values))
    assert "setting scores.band_high_hz: 5.0 → 6.0" in said


def test_a_result_that_was_edited_is_noticed_and_not_lost(study: Path) -> None:
    path = study / "analysis/comparison.json"
    written = path.read_text()
    path.write_text(written.replace("Small study", "Large study"))
    said = kept(study)
    assert len(said) == 1
    assert "analysis/comparison.json was changed by hand" in said[0]
    assert path.read_text() == written
    assert "Large study" in (study / "analysis/comparison.json.edited").read_text()
    assert kept(study) == [UNCHANGED]


def test_a_second_edit_does_not_replace_the_first(study: Path) -> None:
    path = study / "analysis/days.csv"
    written = path.read_text()
    for text in ("one", "two", "three"):
        path.write_text(text)
        kept(study)
    assert path.read_text() == written
    names = ("days.csv.edited", "days.csv.edited-2", "days.csv.edited-3")
    assert [(study / "analysis" / n).read_text() for n in names] == ["one", "two", "three"]


def test_an_edit_is_not_lost_where_the_record_is(study: Path) -> None:
    (study / "analysis/inputs.json").unlink()
    (study / "analysis/days.csv").write_text("mine")
    (said,) = kept(study)
    assert "days.csv was there already" in said
    assert (study / "analysis/days.csv.edited").read_text() == "mine"


@pytest.mark.parametrize("written", [0, 3, 6])
def test_a_run_that_was_cut_off_is_made_up_for(
    study: Path, monkeypatch: pytest.MonkeyPatch, written: int
) -> None:
    (study / "ratings.csv").write_text(
        (study / "ratings.csv").read_text().replace("M1,1,OFF,A,2.0", "M1,1,OFF,A,2.5")
    )
    left = iter(range(written))
    whole = rigidimeter.analysis.study.archive._write_new

    def cut_off(path: Path, text: str) -> None:
        if next(left, None) is None:
            raise KeyboardInterrupt
        whole(path, text)

    with monkeypatch.context() as patched:
        patched.setattr(rigidimeter.analysis.study.archive, "_write_new", cut_off)
        with pytest.raises(KeyboardInterrupt):
            kept(study)
    said = kept(study)
    assert said[0] == "inputs that are changed: ratings.csv"
    assert any(text.startswith("ratings, contrast: estimate") for text in said)
    assert not list((study / "analysis").glob("*.edited*"))


def test_what_the_seed_moves_is_told(study: Path) -> None:
    read = read_study(study)
    found = analyse_study(read, seed=2, resamples=RESAMPLES)
    said = keep(read, found)
    assert said[0] == "seed: 1 → 2"
    assert any("effect size: r_low" in text for text in said)
    assert any("difference of effect sizes: " in text for text in said)
    assert not any(text.startswith(("work_j:", "impulse_nm_s:")) for text in said)


def test_a_result_that_is_gone_is_written_again(study: Path) -> None:
    (study / "analysis/days.csv").unlink()
    assert kept(study) == ["analysis/days.csv was taken away; it is written again"]
    assert (study / "analysis/days.csv").exists()


def test_a_table_that_no_longer_exists_is_taken_away(study: Path) -> None:
    (study / "ratings.csv").unlink()
    said = kept(study)
    assert "ratings, contrast is no longer there" in said
    assert not (study / "analysis/ratings.csv").exists()


@pytest.mark.parametrize("text", ["{", "[]", '{"schema": "other"}', _DAMAGED])
def test_damaged_inputs_are_said(study: Path, text: str) -> None:
    (study / "analysis/inputs.json").write_text(text)
    assert kept(study) == ["analysis/inputs.json is damaged, so what has changed since is unknown"]
