"""What is kept of an analysis, and what is said to be new the next time."""

import hashlib
import json
import shutil
from collections.abc import Callable
from pathlib import Path
from pkgutil import resolve_name

import pytest

from rigidimeter.analysis.study import (
    TABLES,
    UNCHANGED,
    analyse,
    comparison_document,
    conclude_study,
    keep,
    kept_study,
    load_study,
    result_table,
)
from rigidimeter.core.settings import changed_settings, dump_settings, parse_settings

WRITES = "rigidimeter.analysis.study.store._write_new"
"""What a run that is cut off calls for each file."""


def kept(folder: Path, *, seed: int = 1, between: Callable[[Path], object] = str, **options):
    """Return what is said of an analysis; the folder may be changed `between` reading and that."""
    loaded = load_study(folder, **options)
    between(folder)
    return keep(loaded, conclude_study(analyse(loaded), seed=seed, resamples=100))


def state(folder: Path) -> dict[str, tuple[bytes, int]]:
    return {p.name: (p.read_bytes(), p.stat().st_mtime_ns) for p in (folder / "analysis").iterdir()}


@pytest.fixture(scope="module")
def analysed(scored_study: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the study with what is kept of its analysis; it is not to be changed."""
    folder = Path(shutil.copytree(scored_study, tmp_path_factory.mktemp("kept") / "study"))
    assert kept(folder) == []
    assert kept(folder) == [UNCHANGED]
    return folder


@pytest.fixture
def study(analysed: Path, tmp_path: Path) -> Path:
    """Return a copy of it that a test may change."""
    return Path(shutil.copytree(analysed, tmp_path / "study"))


def test_nothing_is_written_again_and_another_place_gives_the_same_bytes(
    study: Path, tmp_path: Path
) -> None:
    before = state(study)
    assert {"inputs.json", "estimates.json", "comparison.json", "days.csv"} <= set(before)
    moved = study.rename(tmp_path / "elsewhere")
    assert kept(moved) == [UNCHANGED]
    assert state(moved) == before


def test_inputs_hold_a_digest_of_every_file_as_it_was_read(study: Path) -> None:
    def change(folder: Path) -> None:  # after it was read, before the result is written
        for name in read:
            (folder / name).write_bytes((folder / name).read_bytes() + b"\n")

    read = {"study.toml", "sessions.csv", "ratings.csv"}
    read |= {str(p.relative_to(study)) for p in (study / "sessions").rglob("*") if p.is_file()}
    before = {name: hashlib.sha256((study / name).read_bytes()).hexdigest() for name in read}
    kept(study, between=change)
    inputs = json.loads((study / "analysis/inputs.json").read_text())
    assert inputs["files"] == before
    assert inputs["schema"] == "rigidimeter.study-inputs/1"
    assert (inputs["seed"], inputs["resamples"]) == (1, 100)
    assert inputs["settings"]["scores"]["cycles"] == 4


def test_a_new_exclusion_is_told_with_the_numbers_it_moved(study: Path) -> None:
    path = study / "analysis/comparison.json"
    before = json.loads(path.read_text())
    (study / "exclusions.csv").write_text("path,epoch,reason,by\nsessions/2-OFF,1,coughed,NB\n")
    said = kept(study)
    after = json.loads(path.read_text())
    assert said[0] == "inputs that are new: exclusions.csv"
    impulse = next(text for text in said if text.startswith("impulse_nm_s:"))
    one, two = (found["comparisons"][0]["p"] for found in (before, after))
    assert f"p {one:.4g} → {two:.4g}" in impulse
    assert "n OFF 6 → 5" in impulse
    assert said[-1] == "epochs left out: count 0 → 1"
    (study / "exclusions.csv").unlink()
    assert "inputs that are gone: exclusions.csv" in kept(study)
    assert json.loads(path.read_text()) == before


def ending(folder: Path) -> None:
    with (folder / "sessions.csv").open("a") as file:
        file.write("\n")


def other_band(folder: Path) -> dict:
    values = dump_settings(load_study(folder).settings)
    values["scores"]["band_high_hz"] = 6.0
    return {"settings": parse_settings(values)}


def adjusted(_: Path) -> dict:
    return {"adjust": lambda settings: changed_settings(settings, {"seed": 9}, "")}


def without_ratings(folder: Path) -> None:
    (folder / "ratings.csv").unlink()


CHANGED = "inputs that are changed: sessions.csv"
BAND = "setting scores.band_high_hz: 5.0 → 6.0"


@pytest.mark.parametrize(
    ("change", "first", "beside"),
    [
        (ending, CHANGED, ()),  # without effect
        (other_band, BAND, ("work_j: ",)),
        (without_ratings, "inputs that are gone: ratings.csv",
         ("ratings, contrast is no longer there",)),
        (lambda _: {"seed": 2}, "seed: 1 → 2",
         ("work_j, effect size: r_low", "impulse_nm_s − work_j, difference of effect sizes: ")),
        (lambda _: {"pair": ("DBS", "OFF")}, "reference: OFF → DBS", ("other: DBS → OFF",)),
    ],
)  # fmt: skip
def test_what_is_new_is_named_with_what_it_moved(study: Path, change, first, beside) -> None:
    options = change(study) or {}
    said = kept(study, **options)
    assert said[0] == first
    for words in beside:
        assert any(text.startswith(words) for text in said)
    assert beside or len(said) == 1
    if "seed" in options:
        assert not any(text.startswith(("work_j:", "impulse_nm_s:")) for text in said)
    assert (study / "analysis/ratings.csv").exists() == (study / "ratings.csv").exists()
    assert kept(study, **options) == [UNCHANGED]


def coded(folder: Path) -> None:
    for name in ("sessions.csv", "ratings.csv"):
        path = folder / name
        path.write_text(path.read_text().replace(",OFF", ",X7").replace(",DBS", ",X3"))


def test_what_has_changed_never_tells_what_codes_are(study: Path) -> None:
    coded(study)
    key = study.parent / "key.csv"
    key.write_text("code,condition\nX7,OFF\nX3,DBS\n")
    kept(study, key=key)
    (said,) = kept(study)
    assert said.startswith("condition names differ from last time")
    assert not [word for word in ("OFF", "DBS", "0.") if word in said]
    assert kept(study) == [UNCHANGED]
    assert "reference: X3 → OFF" in kept(study, key=key)


def test_no_edit_is_lost_and_each_is_said(study: Path) -> None:
    path = study / "analysis/days.csv"
    written = path.read_text()
    for k, text in enumerate(("one", "two", "three")):
        path.write_text(text)
        (said,) = kept(study)
        assert said.startswith(
            "analysis/days.csv was changed by hand after it was written; it is written again; the "
            f"previous one is stored as days.csv.edited{f'-{k + 1}' if k else ''}"
        )
        assert path.read_text() == written
    names = ("days.csv.edited", "days.csv.edited-2", "days.csv.edited-3")
    assert [(study / "analysis" / n).read_text() for n in names] == ["one", "two", "three"]
    assert kept(study) == [UNCHANGED]


def test_an_edit_is_not_lost_where_the_record_is(study: Path) -> None:
    (study / "analysis/inputs.json").unlink()
    (study / "analysis/days.csv").write_text("mine")
    (said,) = kept(study)
    assert "days.csv was there already" in said
    assert (study / "analysis/days.csv.edited").read_text() == "mine"


@pytest.mark.parametrize("written", [0, 3, 6])
def test_a_run_that_was_cut_off_is_made_up_for(
    study: Path, monkeypatch: pytest.MonkeyPatch, edit, written: int
) -> None:
    edit(study / "ratings.csv", "M1,1,OFF,A,2.0", "M1,1,OFF,A,2.5")
    left = iter(range(written))
    whole = resolve_name(WRITES)

    def cut_off(path: Path, text: str) -> None:
        if next(left, None) is None:
            raise KeyboardInterrupt
        whole(path, text)

    with monkeypatch.context() as patched:
        patched.setattr(WRITES, cut_off)
        with pytest.raises(KeyboardInterrupt):
            kept(study)
    said = kept(study)
    assert said[0] == "inputs that are changed: ratings.csv"
    assert any(text.startswith("ratings, contrast: estimate") for text in said)
    assert not list((study / "analysis").glob("*.edited*"))


def test_a_result_that_is_gone_is_written_again(study: Path) -> None:
    (study / "analysis/days.csv").unlink()
    assert kept(study) == ["analysis/days.csv was taken away; it is written again"]
    assert (study / "analysis/days.csv").exists()


DAMAGED = '{"schema": "rigidimeter.study-inputs/1", "settings": [2], "files": {}, "results": ""}'


@pytest.mark.parametrize("text", ["{", "[]", '{"schema": "other"}', DAMAGED])
def test_damaged_inputs_are_said(study: Path, text: str) -> None:
    (study / "analysis/inputs.json").write_text(text)
    assert kept(study) == ["analysis/inputs.json is damaged, so what has changed since is unknown"]


class TestTwice:
    """Nothing is computed twice, and nothing that could be another is taken for the same."""

    def test_a_kept_study_says_the_same(self, study: Path) -> None:
        (study / "exclusions.csv").write_text("path,epoch,reason,by\nsessions/2-OFF,1,coughed,\n")
        loaded = load_study(study)
        found = conclude_study(analyse(loaded), resamples=100)
        keep(loaded, found)
        before = state(study)
        shutil.copytree(study / "sessions", study.parent / "away")
        again, kept_one = kept_study(study)
        shutil.rmtree(study / "sessions")  # no recording is read again
        result = conclude_study(kept_one, resamples=100)
        place = str(study)
        assert comparison_document(result, place) == comparison_document(found, place)
        for name in TABLES:
            assert [*map(str, result_table(result, name))] == [*map(str, result_table(found, name))]
        assert keep(again, result) == [UNCHANGED]
        assert state(study) == before
        shutil.move(study.parent / "away", study / "sessions")
        assert len(kept_one.folder_read().epochs) == len(loaded.epochs)

    @pytest.mark.parametrize(
        "path",
        ["sessions/2-OFF/samples.arrows", "sessions/2-OFF/manifest.json", "ratings.csv",
         "study.toml", "analysis/rows.parquet", "analysis/estimates.json", "new.csv",
         "analysis/inputs.json"],
    )  # fmt: skip
    def test_any_other_byte_and_any_new_file_ends_it(self, study: Path, path: str) -> None:
        assert kept_study(study) is not None
        file = study / path
        content = file.read_bytes() if file.exists() else b"x"
        if path.endswith("inputs.json"):
            file.write_text("{}")
        else:  # of the same size
            file.write_bytes(content[:-9] + bytes([content[-9:][0] ^ 1]) + content[-8:][:8])
        assert kept_study(study) is None

    @pytest.mark.parametrize(
        "asked", [{"method": "published"}, {"pair": ("DBS", "OFF")}, other_band, adjusted]
    )
    def test_what_was_asked_otherwise_is_another_study(self, study: Path, asked) -> None:
        assert kept_study(study, **(asked(study) if callable(asked) else asked)) is None

    def test_the_command_reads_no_recording_again(
        self, study: Path, rigidimeter, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        command = ("compare", study, "--resamples", "100")
        first = rigidimeter(*command)
        with monkeypatch.context() as patched:
            patched.delattr("rigidimeter.cli.study_inputs.load_study")
            assert rigidimeter(*command) == first
            with pytest.raises(NameError):
                rigidimeter(*command, "--band-hz", "0.3", "20")
        assert "setting estimation.band_low" in rigidimeter(*command, "--band-hz", "0.3", "20").out

    def test_other_software_computes_anew(self, study: Path, monkeypatch) -> None:
        monkeypatch.setattr("rigidimeter.analysis.study.reuse.__version__", "0")
        assert kept_study(study) is None

    def test_a_folder_where_a_session_was_missing_ends_it(self, study: Path) -> None:
        shutil.rmtree(study / "sessions/1-OFF")
        kept(study)
        assert kept_study(study) is not None
        (study / "sessions/1-OFF").mkdir()
        assert kept_study(study) is None

    @pytest.mark.parametrize("target", ["sessions", "nowhere"])
    def test_nothing_is_kept_with_a_linked_folder_nor_what_cannot_be_read(
        self, study: Path, target: str
    ) -> None:
        (study / "linked").symlink_to(study / target)
        kept(study)
        assert kept_study(study) is None
        assert not (study / "analysis/rows.parquet").exists()

    def test_a_key_with_an_error_is_named_where_it_is(self, study: Path) -> None:
        coded(study)
        for name in ("one", "two"):
            key = study.parent / f"{name}.csv"
            key.write_text("code,condition\nX7,OFF\nX3,DBS\nX9,NONE\n")
            assert kept_study(study, key=key) is None
            kept(study, key=key)
