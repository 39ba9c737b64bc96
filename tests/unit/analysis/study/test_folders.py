"""Study folders from their tables to their conclusions: what is said, and what is left out.

All of it is in `answers.txt`, a part for each folder here; some is held against parts by hand.
"""

import csv
import math
import shutil
from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.archive_files import write_bids_motion, write_nwb
from tests.instrument_files import Signal
from tests.known_joint import angle_rad, torque_nm
from tests.replayed import assert_folder_replayed
from tests.small_study import DAYS, record, tiny
from tests.unit.analysis.study.held import hold, said

from rigidimeter.analysis.estimation import estimate_recorded, prepare
from rigidimeter.analysis.statistics import difference, fit_mixed, holm, ranksum
from rigidimeter.analysis.study import (
    StudyResult,
    analyse,
    conclude_study,
    counting,
    load_study,
    result_table,
)
from rigidimeter.core.errors import UserError
from rigidimeter.core.files import toml_text
from rigidimeter.core.session import read_session
from rigidimeter.core.settings import dump_settings
from rigidimeter.core.study_files import (
    PlanToml,
    StimulationChange,
    add_change,
    begun_session,
    extend_study,
    named_block,
    read_plan,
    recorded_blocks,
    write_plan,
)
from rigidimeter.planning import StudyDays, draw_days
from rigidimeter.virtual import rehearse, run_virtual_session

K = "stiffness_nm_rad"


def analysed(folder: Path, *, resamples: int = 0, **options: Any) -> StudyResult:
    return conclude_study(analyse(load_study(folder, **options)), resamples=resamples)


def lines_of(folder: Path, **options: Any) -> list[str]:
    """Return everything that is said of a folder, or why it is refused."""
    try:
        found = analysed(folder, **options)
    except UserError as error:
        return [str(error)]
    return said(found.study, found.comparisons)


def add(path: Path, *rows: str) -> None:
    with path.open("a") as file:
        file.writelines(f"{row}\n" for row in rows)


def sessions(study: Path, *rows: str, columns: str = "") -> None:
    head = f"path,subject,day,condition{columns}"
    (study / "sessions.csv").write_text("\n".join([head, *rows]) + "\n")


def coded(study: Path) -> None:
    for path in (study / "sessions.csv", study / "ratings.csv"):
        path.write_text(path.read_text().replace(",OFF", ",Q").replace(",DBS", ",Z"))


def with_key(study: Path) -> None:
    coded(study)
    (study / "key.csv").write_text("code,condition\nQ,OFF\nZ,DBS\nQ,DBS\nX,LOW\n")


def coded_recording(study: Path) -> None:
    """Record by its code, as a blinded operator does; the table has it, too."""
    shutil.rmtree(study / "sessions/1-OFF")
    subject = {"Q": {"damping_nm_s_rad": 0.13}, "OFF": {}, "DBS": {}}
    record(study / "sessions/1-OFF", "Q", 5, task="sinusoid", subject=subject)
    table = study / "sessions.csv"
    table.write_text(table.read_text().replace("M1,1,OFF", "M1,1,Q"))
    (study / "key.csv").write_text("code,condition\nQ,OFF\n")


def excluded(study: Path) -> None:
    rows = ["./sessions/2-OFF,2,coughed,NB", "sessions/2-OFF,2,again,", "sessions/1-OFF,9,none,",
            "sessions/2-OF,1,misspelt,", "sessions/3-DBS,1,moved,"]  # fmt: skip
    add(study / "exclusions.csv", "path,epoch,reason,by", *rows)


def unusable(study: Path) -> None:
    shutil.rmtree(study / "sessions/1-OFF")
    shutil.copytree(study / "sessions/2-OFF", study / "sessions/copy")
    (study / "sessions/3-OFF/events.jsonl").unlink()
    faster = tiny("DBS", 9).sinusoid.model_dump() | {"frequency_hz": 2.5}
    record(study / "sessions/other", "DBS", 9, task="sinusoid", scores={"cycles": 3})
    record(study / "sessions/faster", "DBS", 9, task="sinusoid", sinusoid=faster)
    rows = ["sessions/copy,M1,7,OFF", "sessions/2-DBS,M1,2,DBS", "sessions/4-DBS,M1,9,LOW",
            "../away,M1,7,OFF", "sessions/other,M1,8,DBS", "sessions/faster,M1,9,DBS",
            "sessions/2-OFF,M1,3,DBS"]  # fmt: skip
    add(study / "sessions.csv", *rows)


def odd_ratings(study: Path) -> None:
    rows = ["M1,1,OFF,A,9", "M1,1,OFF,A,", "M1,1,LOW,A,1", "M1,1,OFF,A,x", "M1,9,OFF,B,1.3",
            "M1,8,OFF,B,1", "M1,1,OFF,A,2", "M1,1,OFF,D,2"]  # fmt: skip
    add(study / "ratings.csv", *rows)


def one_rating(study: Path) -> None:
    (study / "ratings.csv").write_text("subject,day,condition,examiner,score\nM1,1,OFF,A,1\n")


def one_condition(study: Path) -> None:
    rows = (study / "sessions.csv").read_text().splitlines()
    sessions(study, *(row for row in rows[1:] if "DBS" not in row))


def subjects(count: int) -> Callable[[Path], None]:
    """Return the edit to subjects with a session in each condition, of two groups."""

    def edit(study: Path) -> None:
        (study / "ratings.csv").unlink()
        rows = [
            f"sessions/{k + (name == 'DBS')}-{name},S{k},{1 + (name == 'DBS')},{name},{group}"
            for k, group in zip(range(1, count + 1), ("old", "young", "old"), strict=False)
            for name in DAYS
        ]
        sessions(study, *rows, columns=",group")

    return edit


def declared(study: Path) -> None:
    add(study / "study.toml", '[primary]\nmeasures = ["work_j", "impulse_nm_s"]',
        'rule = "sequence"\ndeclared = 2026-01-01\n[analysis]\naxis = "vertical"')  # fmt: skip


def parts_of_a_day(study: Path) -> None:
    record(study / "sessions/1b", "OFF", 77, task="sinusoid")
    rows = (study / "sessions.csv").read_text().splitlines()
    sessions(study, *(f"{r}," for r in rows[1:]), "sessions/1b,M1,1,OFF,b", columns=",part")


def both_in_one(*rows: str, amplitude_deg: float = 8.0) -> Callable[[Path], None]:
    """Return the edit that records both conditions in one session, with these rows of it."""

    def edit(study: Path) -> None:
        blocks = [{"task": "sinusoid", "condition": name, "epochs": n}
                  for name, n in (("OFF", 2), ("DBS", 1))]  # fmt: skip
        protocol = {"blocks": blocks, "rests_s": [0.5], "return_s": 0.5}
        sinusoid = tiny("OFF", 1).sinusoid.model_dump() | {"amplitude_deg": amplitude_deg}
        settings = tiny("OFF", 55, task="sinusoid", protocol=protocol, sinusoid=sinusoid)
        run_virtual_session(settings, study / "sessions/both")
        assert_folder_replayed(study / "sessions/both")
        add(study / "sessions.csv", *(f"sessions/both,M1,{row}" for row in rows))

    return edit


def one_vote(study: Path) -> None:
    """Of three sessions two are of one protocol; the third has a row for each condition."""
    (study / "ratings.csv").unlink()
    sessions(study, "sessions/1-OFF,M1,1,OFF", "sessions/2-DBS,M1,2,DBS")
    both_in_one("9,OFF", "9,DBS", amplitude_deg=6.0)(study)


def third_condition(study: Path) -> None:
    (study / "ratings.csv").unlink()
    toml = study / "study.toml"
    toml.write_text(
        toml.read_text().replace("[conditions.DBS]", "[conditions.LOW]\n[conditions.DBS]")
    )
    low = {"LOW": {"damping_nm_s_rad": 0.125, "stiffness_nm_rad": 1.5}}
    days = ("4", "5", "6")
    for day in days:
        record(study / f"sessions/{day}-A-LOW", "LOW", int(day), task="sinusoid", subject=low)
    rows = (study / "sessions.csv").read_text().splitlines()
    sessions(study, *(f"sessions/{day}-A-LOW,M1,{day},LOW" for day in days), *rows[1:])


def one_condition_lost(study: Path) -> None:
    for path in study.glob("sessions/*-DBS"):
        shutil.rmtree(path)


def no_change(_: Path) -> None:
    return None


FOLDERS: dict[str, tuple[Callable[[Path], object], dict[str, Any]]] = {
    "scores": (no_change, {}),
    "turned": (no_change, {"pair": ("DBS", "OFF")}),
    "one condition named twice": (no_change, {"pair": ("DBS", None)}),
    "an unknown condition": (no_change, {"pair": (None, "LOW")}),
    "an unknown group": (no_change, {"group": "patients"}),
    "an unknown method": (no_change, {"method": "magic"}),
    "codes": (coded, {}),
    "codes with a key": (with_key, {}),
    "codes in a recording": (coded_recording, {}),
    "excluded epochs": (excluded, {}),
    "unusable sessions": (unusable, {}),
    "no session": (lambda study: shutil.rmtree(study / "sessions"), {}),
    "all sessions of a condition lost": (one_condition_lost, {}),
    "odd ratings": (odd_ratings, {}),
    "one rating": (one_rating, {}),
    "one condition": (one_condition, {}),
    "two subjects": (subjects(2), {}),
    "three subjects": (subjects(3), {}),
    "a group": (subjects(3), {"group": "old"}),
    "declared measures": (declared, {}),
    "parts of a day": (parts_of_a_day, {}),
    "both conditions in one recording": (both_in_one("9,OFF", "9,DBS"), {}),
    "both in one, a row missing": (both_in_one("9,OFF"), {}),
    "both in one, of two days": (both_in_one("9,OFF", "8,DBS"), {}),
    "one vote on the protocol": (one_vote, {}),
    "a third condition": (third_condition, {}),
    "a pair of three": (third_condition, {"pair": (None, "LOW")}),
}


@pytest.mark.parametrize("name", FOLDERS)
def test_all_that_is_said(study: Path, name: str) -> None:
    edit, options = FOLDERS[name]
    edit(study)
    hold(f"folder: {name}", lines_of(study, **options), str(study))


@pytest.fixture(scope="module")
def whole(fitted_study: Path) -> StudyResult:
    return analysed(fitted_study, resamples=100)


def test_of_epochs_that_are_fitted(fitted_study: Path, whole: StudyResult) -> None:
    hold("folder: fits", said(whole.study, whole.comparisons), str(fitted_study))


def test_the_estimates_and_ratings_are_those_made_by_hand(
    fitted_study: Path, whole: StudyResult
) -> None:
    places = [f"sessions/{day}-{condition}" for condition in DAYS for day in DAYS[condition]]
    epochs = [epoch for place in places for epoch in read_session(fitted_study / place)[0]]
    by_hand = estimate_recorded(prepare(epochs, whole.study.settings), "auto")
    for stage in ("fits", "fixed_inertia"):
        ours, theirs = (getattr(one, stage) for one in (whole.study.analysis, by_hand))
        assert [one.stiffness_nm_rad for one in ours] == [one.stiffness_nm_rad for one in theirs]
    values: dict[str, list[float]] = {name: [] for name in DAYS}
    for fit in by_hand.fits:
        values[fit.condition] += [fit.stiffness_nm_rad] if fit.outcome.included else []
    assert whole.value_test(K).statistic == ranksum(*values.values())
    with (fitted_study / "ratings.csv").open() as file:
        rows = list(csv.DictReader(file))
    conditions = [row["condition"] for row in rows]
    examiners = {"examiner": [row["examiner"] for row in rows]}
    fit = fit_mixed([float(row["score"]) for row in rows], conditions, examiners)
    (contrast,) = result_table(whole, "rating_contrast")[:1]
    assert contrast["estimate"] == difference(fit, "DBS", "OFF").estimate
    tests = whole.values
    assert [one.p_adjusted for one in tests] == [*holm([one.p for one in tests])]
    pairs = whole.effect_pairs
    assert len(pairs) == math.comb(len(tests), 2)
    assert [one.p_holm for one in pairs] == [*holm([one.difference.p for one in pairs])]
    assert whole.study.virtual
    assert not whole.study.blinded


def test_another_measure_moves_no_other_number(study: Path) -> None:
    first = analysed(study, resamples=100)
    (study / "ratings.csv").unlink()
    second = analysed(study, resamples=100)
    assert first.effects["work_j"] == second.effects["work_j"]
    assert second.study.ratings is None


def test_names_behind_codes_change_no_number(study: Path) -> None:
    plain = analysed(study)
    coded(study)
    key = study.parent / "elsewhere.csv"
    key.write_text("code,condition\nQ,OFF\nZ,DBS\n")
    for options in ({"key": key}, {}):
        found = analysed(study, **options)
        assert [one.p for one in found.comparisons] == [one.p for one in plain.comparisons]
        assert {row.code for row in found.study.sessions} == {"Q", "Z"}
        assert found.study.blinded is (not options)


def test_a_folder_is_read_again_from_wherever_the_program_works_then(study: Path, monkeypatch):
    coded(study)
    (study.parent / "elsewhere.csv").write_text("code,condition\nQ,OFF\nZ,DBS\n")
    monkeypatch.chdir(study.parent)
    found = analysed(Path(study.name), key=Path("elsewhere.csv"))
    monkeypatch.chdir("/")
    assert found.study.folder_read().recordings.digests.items() <= found.study.digests.items()


def test_subjects_are_the_units_where_each_has_both_conditions(study: Path) -> None:
    subjects(3)(study)
    found = analysed(study)
    assert found.resampled == "the days of each subject"
    for one in found.comparisons:
        rows = counting(found.study.rows, one.measure.name)
        means = rows.groupby(["condition", "subject"])["value"].mean().groupby("condition").mean()
        assert (one.value_reference, one.value_other) == pytest.approx((means["OFF"], means["DBS"]))


BEGIN = datetime(2026, 1, 5, 9, 0, tzinfo=UTC)


@pytest.fixture(scope="module")
def planned(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three days: the first as planned, the second in another order, the third too early."""
    folder = tmp_path_factory.mktemp("planned") / "study"
    folder.mkdir()
    names = tuple(DAYS)
    spec = StudyDays(("S01",), names, 3, ("DBS",), order=names, task="prbs")
    about = PlanToml(subjects=["S01"], days=3, conditions=list(names), stimulated=["DBS"])
    protocols = {f"protocols/{name}.toml": toml_text(dump_settings(tiny(name, 1, epochs=1)))
                 for name in names}  # fmt: skip
    plan = write_plan(folder, about, draw_days(spec, 1), protocols)
    waits = {("1", 1): 60, ("1", 2): 15, ("2", 2): 15, ("2", 1): 60, ("3", 1): 4}
    for place, ((day, order), wait_min) in enumerate(waits.items()):
        now = BEGIN + timedelta(hours=2 * place)
        before, state = ("off", "on") if order == 2 else ("on", "off")
        add_change(folder, StimulationChange("S01", now - timedelta(hours=1), before))
        add_change(folder, StimulationChange("S01", now, state))
        due = named_block(plan, recorded_blocks(folder), ("S01", day, order))
        now += timedelta(minutes=wait_min)
        begun = begun_session(plan, due, now, reason="late")
        created = now.isoformat()
        run_virtual_session(begun.settings, begun.folder, created_utc=created, about=begun.about)
        assert_folder_replayed(begun.folder)
        extend_study(folder, [begun.folder])
    return folder


def edited_plan(folder: Path) -> None:
    protocol, table = folder / "protocols/OFF.toml", folder / "plan.csv"
    protocol.write_text(protocol.read_text().replace("duration_s = 6.0", "duration_s = 7.0", 1))
    table.write_text(table.read_text().replace("15.0", "10.0"))


def unplanned(folder: Path) -> None:
    about = {"subject": "S01", "operator": "Kim", "day": "extra"}
    created = (BEGIN + timedelta(days=3)).isoformat()
    run_virtual_session(
        tiny("OFF", 9, epochs=1), folder / "S01-20260108", created_utc=created, about=about
    )
    extend_study(folder)


@pytest.mark.parametrize("edit", [no_change, edited_plan, unplanned])
def test_what_was_not_as_planned(planned: Path, tmp_path: Path, edit) -> None:
    folder = Path(shutil.copytree(planned, tmp_path / "study"))
    edit(folder)
    hold(f"folder: planned, {edit.__name__}", lines_of(folder), str(folder))


def test_epochs_have_the_time_since_the_change_and_the_deviations_a_sentence(planned: Path) -> None:
    found = analysed(planned)
    rows = counting(found.study.rows, K)
    since = rows.loc[rows["session"].str.contains("day-1-1")].index
    minutes = found.study.rows.loc[since, "since_change_min"]
    assert list(minutes) == pytest.approx([60.0], abs=0.05)
    kinds = [row["kind"] for row in result_table(found, "deviations")]
    assert sorted(kinds) == ["not done", "out of order", "short wait"]


def test_a_rehearsed_plan_has_no_deviation(planned: Path, tmp_path: Path) -> None:
    plan = read_plan(planned)
    names = [f"protocols/{name}.toml" for name in DAYS]
    protocols = {name: (planned / name).read_text() for name in names}
    rehearsed = write_plan(tmp_path / "again", plan.about, plan.blocks[:4], protocols)
    assert len(rehearse(rehearsed, BEGIN)) == 4
    assert analysed(tmp_path / "again").study.deviations == ()


TIME_S = np.arange(1200) / 100.0
TOML = 'schema = "rigidimeter.study/1"\ntitle = "t"\nreference = "OFF"\nother = "DBS"\n'


class TestRecordingsOfOthers:
    """Recordings that are no session folders: data sets, and files with a mapping."""

    def test_mappings_of_the_study_and_of_single_sessions(self, tmp_path: Path) -> None:
        pytest.importorskip("pynwb")
        schema = 'schema = "rigidimeter.mapping/1"\n'
        (tmp_path / "study.toml").write_text(f'{TOML}mapping = "lab.toml"\n')
        (tmp_path / "lab.toml").write_text(
            f'{schema}reaction = true\n[time]\nunit = "ms"\n[torque]\nunit = "Nm"\n'
            '[angle]\ncolumn = "w"\nunit = "deg"\n'
        )
        (tmp_path / "force.toml").write_text(f'{schema}[torque]\nscale = "0.25 m"\n')
        rows = ["a.csv,S1,1,OFF,", "b.csv,S1,2,DBS,"]
        rows += ["set,S1,3,OFF,force.toml", "r.nwb,S1,4,DBS,force.toml"]
        sessions(tmp_path, *rows, columns=",mapping")
        for seed, name in enumerate(("a.csv", "b.csv")):  # ms, degrees and the joint's reaction
            columns = [1e3 * TIME_S, -torque_nm(TIME_S, seed), np.degrees(angle_rad(TIME_S, seed))]
            np.savetxt(tmp_path / name, np.column_stack(columns), "%.17g", ",", header="t,M,w",
                       comments="")  # fmt: skip
        for seed, write, name in ((2, write_bids_motion, "set"), (3, write_nwb, "r.nwb")):
            force = Signal("Fz", "N", torque_nm(TIME_S, seed) / 0.25, 100.0)
            angle = Signal("Angle", "deg", np.degrees(angle_rad(TIME_S, seed)), 100.0)
            more = {"latency": True} if name == "set" else {}
            write(tmp_path / name, [force, angle], **more)
        found = load_study(tmp_path)
        assert [epoch.condition for epoch in found.epochs] == ["OFF", "DBS", "OFF", "DBS"]
        for seed, epoch in enumerate(found.epochs):
            torque, angle = (epoch.channels[name] for name in ("torque_nm", "angle_rad"))
            np.testing.assert_allclose(torque.time_s, TIME_S, atol=1e-12)
            np.testing.assert_allclose(
                torque.values, torque_nm(TIME_S, seed), rtol=1e-9, atol=1e-11
            )
            np.testing.assert_allclose(angle.values, angle_rad(TIME_S, seed), atol=1e-11)

    @pytest.mark.parametrize("offset", ["0.375", "found", "elsewhere"])
    def test_torque_and_motion_in_two_files_each_with_its_clock(
        self, tmp_path: Path, offset: str
    ) -> None:
        (tmp_path / "study.toml").write_text(TOML)
        rows = []
        for day, condition in enumerate(DAYS):
            for name, head, values, late_s in (
                (f"m{day}.csv", "t [s],M [Nm]", torque_nm(TIME_S, day), 0.0),
                (f"a{day}.csv", "t [s],phi [rad]", angle_rad(TIME_S, day), 0.375),
            ):
                columns = np.column_stack([TIME_S - late_s, values])
                np.savetxt(tmp_path / name, columns, "%.17g", ",", header=head, comments="")
            away = "../" if offset == "elsewhere" else ""
            at = "0.375" if away else offset
            rows.append(f"m{day}.csv,S1,{day + 1},{condition},{away}a{day}.csv,{at}")
        sessions(tmp_path, *rows, columns=",join,clock_offset")
        if offset == "elsewhere":
            with pytest.raises(UserError, match=r"join is \.\./a0\.csv, outside the study folder"):
                load_study(tmp_path)
            return
        found = load_study(tmp_path)
        assert {"m0.csv", "a0.csv"} <= set(found.recordings.digests)
        for day, epoch in enumerate(found.epochs):
            angle = epoch.channels["angle_rad"]
            wanted = angle_rad(angle.time_s, day)
            assert np.abs(angle.values - wanted).max() < (1e-9 if offset != "found" else 1e-4)
            assert (epoch.clock_error_s > 0) == (offset == "found")
