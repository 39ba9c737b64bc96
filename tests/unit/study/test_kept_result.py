"""A kept result is taken while nothing changed that it came from, and never otherwise."""

import json
import re
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from tests.small_study import build, record

from rigidimeter.recording.checksum import ZEROS, with_checksum
from rigidimeter.study import StudyResult, analyse_study, keep, read_study
from rigidimeter.study.archive import UNCHANGED
from rigidimeter.study.drawing import drawn_signals
from rigidimeter.study.kept_result import keep_result, take_kept

ASKED = {"--method": "auto", "--band-hz": None, "--seed": 1}
KEPT = "analysis/kept.json"


def analysed(folder: Path) -> StudyResult:
    """Analyse a study and keep the result."""
    read = read_study(folder)
    result = analyse_study(read, resamples=100)
    result = replace(result, drawn=drawn_signals(result))
    keep(read, result)
    keep_result(read, result, ASKED)
    return result


@pytest.fixture(scope="module")
def kept_once(scored_study: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a study of scores whose analysis is kept; it is not to be changed."""
    folder = Path(shutil.copytree(scored_study, tmp_path_factory.mktemp("kept") / "study"))
    analysed(folder)
    return folder


@pytest.fixture
def kept(kept_once: Path, tmp_path: Path) -> Path:
    """Return a copy that a test may change: it lies elsewhere, and holds all the same."""
    return Path(shutil.copytree(kept_once, tmp_path / "study"))


def shown(value: object) -> str:
    """Return a record as text; the type of a number does not matter, every digit does."""
    return re.sub(r"np\.(?:float|int)64\((.*?)\)", r"\1", repr(value))


def reason(folder: Path, **asked: object) -> str:
    """Return why the kept result does not hold."""
    found, said = take_kept(folder, ASKED | asked)
    assert found is None
    return said


def test_every_number_comes_back_as_it_was(fitted_study: Path, tmp_path: Path) -> None:
    folder = Path(shutil.copytree(fitted_study, tmp_path / "study"))
    for name in ("sessions.csv", "ratings.csv"):  # two days of each condition are enough
        lines = (folder / name).read_text().splitlines()
        left = [line for line in lines if ",3,OFF" not in line and ",4,DBS" not in line]
        (folder / name).write_text("\n".join(left) + "\n")
    for condition in ("OFF", "DBS"):
        record(folder / f"sessions/2-{condition}-sine", condition, seed=41, task="sinusoid")
        with (folder / "sessions.csv").open("a") as table:
            table.write(f"sessions/2-{condition}-sine,M1,2,{condition}\n")
    made = analysed(folder)
    found, said = take_kept(folder, ASKED)
    assert found is not None
    assert said == ""
    again = found.result
    assert again.analysis.fits == made.analysis.fits
    assert again.analysis.pooled == made.analysis.pooled
    assert shown(again.comparisons) == shown(made.comparisons)
    assert shown(again.ratings) == shown(made.ratings)
    assert shown(again.sensitivity) == shown(made.sensitivity)
    assert (again.settings, again.sessions, again.notices) == (
        made.settings,
        made.sessions,
        made.notices,
    )
    assert [vars(epoch) | {"channels": 0} for epoch in again.epochs] == [
        vars(epoch) | {"channels": 0} for epoch in made.epochs
    ]
    assert shown(again.drawn) == shown(made.drawn)
    assert again.changes == (UNCHANGED,)
    assert made.drawn is not None
    assert again.drawn is not None
    for one, two in zip(made.drawn.examples, again.drawn.examples, strict=True):
        for name, channel in one.channels.items():
            assert channel.values.tobytes() == two.channels[name].values.tobytes()
            assert channel.time_s.tobytes() == two.channels[name].time_s.tobytes()


def test_without_a_file_nothing_is_said(scored_study: Path) -> None:
    assert take_kept(scored_study, ASKED) == (None, "")


def test_the_same_result_is_not_written_again(kept: Path) -> None:
    before = (kept / KEPT).stat().st_mtime_ns, (kept / KEPT).read_bytes()
    analysed(kept)
    assert ((kept / KEPT).stat().st_mtime_ns, (kept / KEPT).read_bytes()) == before


def test_samples_that_are_not_held_are_not_taken_for_none(kept: Path) -> None:
    found, _ = take_kept(kept, ASKED)
    assert found is not None
    with pytest.raises(LookupError, match="are not held"):
        _ = "torque_nm" in found.result.epochs[0].channels


def change_sample(study: Path) -> None:
    samples = study / "sessions/2-OFF/samples.arrows"
    content = bytearray(samples.read_bytes())
    content[len(content) // 2] ^= 1
    samples.write_bytes(bytes(content))


def exclude(study: Path) -> None:
    (study / "exclusions.csv").write_text("path,epoch,reason,by\nsessions/2-OFF,1,coughed,NB\n")


def change_rating(study: Path) -> None:
    path = study / "ratings.csv"
    path.write_text(path.read_text().replace("M1,1,OFF,A,2.0", "M1,1,OFF,A,2.5"))


def add_session(study: Path) -> None:
    with (study / "sessions.csv").open("a") as table:
        table.write("sessions/5-OFF,M1,5,OFF\n")


def add_file_beside(study: Path) -> None:
    (study / "sessions/2-OFF/notes.json").write_text("{}")


def link_to_another(study: Path) -> None:
    (study / "sessions/2-OFF").rename(study / "moved")
    (study / "sessions/2-OFF").symlink_to(study / "moved")


def reseal(study: Path, change: Callable[[dict], object]) -> None:
    """Change what is in the file and give it a checksum that holds."""
    document = json.loads((study / KEPT).read_text())
    change(document)
    content = json.dumps(document | {"checksum": ZEROS}, ensure_ascii=False).encode()
    (study / KEPT).write_bytes(with_checksum(content))


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (change_sample, "sessions/2-OFF/samples.arrows has changed"),
        (exclude, "exclusions.csv has changed"),
        (change_rating, "ratings.csv has changed"),
        (add_session, "sessions.csv has changed"),
        (add_file_beside, "the files of sessions/2-OFF are not those of then"),
        (link_to_another, "the files of sessions/2-OFF are not those of then"),
        (
            lambda study: shutil.rmtree(study / "sessions/2-OFF"),
            "the files of sessions/2-OFF are not those of then",
        ),
        (lambda study: (study / "ratings.csv").unlink(), "ratings.csv has changed"),
        (lambda study: (study / "ratings.csv").write_text("a"), "a table cannot be read"),
        (
            lambda study: (study / "analysis/comparison.json").write_text("{}"),
            "analysis/comparison.json has changed",
        ),
        (
            lambda study: (study / "analysis/inputs.json").unlink(),
            "analysis/inputs.json has changed",
        ),
        (
            lambda study: reseal(study, lambda d: d["made_by"].update({"source code": "0"})),
            "source code has changed",
        ),
        (
            lambda study: reseal(study, lambda d: d["made_by"].update({"numpy": "1.0"})),
            'numpy was "1.0", and is ',
        ),
    ],
)
def test_whatever_changed_ends_it(kept: Path, change: Callable[[Path], object], said: str) -> None:
    change(kept)
    assert reason(kept).startswith(said)


def test_other_options_are_another_analysis(kept: Path) -> None:
    assert reason(kept, **{"--seed": 7}) == "--seed was 1, and is 7"
    assert reason(kept, **{"--band-hz": [1.0, 9.0]}) == "--band-hz was null, and is [1.0, 9.0]"


def test_a_message_that_names_the_study_otherwise_is_not_taken(kept: Path) -> None:
    reseal(kept, lambda document: document.update(folder="elsewhere"))
    assert reason(kept) == f'the study was named "elsewhere", and is {kept}'


def class_name(document: dict) -> None:
    document["result"]["comparisons"][0]["measure"] = {"__class__": "os.system"}


def endless(document: dict) -> None:
    document["drawn"]["examples"][0]["channels"]["torque_nm"]["values"]["shape"] = [10**12]


DAMAGE: list[Callable[[Path], object]] = [
    lambda study: (study / KEPT).write_bytes(b""),
    lambda study: (study / KEPT).write_bytes((study / KEPT).read_bytes()[:-1000]),
    lambda study: (study / KEPT).write_bytes(
        (study / KEPT).read_bytes().replace(b"0.1", b"0.2", 1)
    ),
    lambda study: (study / KEPT).write_bytes(b"[" * 100_000),
    lambda study: (study / KEPT).write_bytes(b"\x80\x04\x95\x1a\x00\x00\x00\x00\x00\x00\x8c"),
    lambda study: reseal(study, class_name),
    lambda study: reseal(study, endless),
    lambda study: reseal(study, lambda d: d["epochs"][0].update(closed=[[[1]]])),
    lambda study: reseal(study, lambda d: d["result"].update(seed="1")),
    lambda study: reseal(study, lambda d: d["result"].update(analysis=None)),
    lambda study: reseal(study, lambda d: d["settings"].update(rig={"tick_rate_hz": -1.0})),
    lambda study: reseal(study, lambda d: d.pop("drawn")),
    lambda study: reseal(study, lambda d: d["epochs"].pop()),
]


@pytest.mark.parametrize("damage", DAMAGE)
def test_a_damaged_file_is_not_taken(kept: Path, damage: Callable[[Path], object]) -> None:
    damage(kept)
    assert reason(kept) == f"{KEPT} is damaged"


def test_two_studies_do_not_mix(kept: Path, tmp_path: Path) -> None:
    other = build(tmp_path / "other", "prbs")
    shutil.copytree(kept / "analysis", other / "analysis")
    assert reason(other).endswith("has changed")


def test_what_is_read_from_elsewhere_is_not_kept(kept: Path, tmp_path: Path) -> None:
    read = read_study(kept)
    result = analyse_study(read, resamples=100)
    result = replace(result, drawn=drawn_signals(result))
    outside = replace(read, gathered=replace(read.gathered, elsewhere=(tmp_path / "a.json",)))
    keep_result(outside, result, ASKED)
    assert not (kept / KEPT).exists()
