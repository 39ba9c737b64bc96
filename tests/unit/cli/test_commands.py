import json
import math
import re
import subprocess
import sys

import numpy as np
import pytest
from tests.known_joint import angle_rad, torque_nm

import rigidimeter as rm
from rigidimeter.analysis.reading import Recording
from rigidimeter.cli.estimate_text import estimate_blocks
from rigidimeter.cli.terminal_tables import text_lines
from rigidimeter.core.errors import UserError
from rigidimeter.core.records import Analysis, Fit, Outcome, Score
from rigidimeter.core.settings import Settings


def test_help_names_every_command_and_gives_examples(rigidimeter):
    ran = rigidimeter("--help")
    assert ran.status == 0
    for command in ("design", "simulate", "estimate", "compare", "report", "recover", "demo"):
        assert command in ran.out
        assert "For example:\n" in rigidimeter(command, "--help").out


def test_the_version_is_printed(rigidimeter):
    assert rigidimeter("--version").out == "rigidimeter 0.1.0\n"


def test_help_imports_nothing_heavy():
    """Start-up time is a promise; what it depends on can be tested without a clock."""
    code = (
        "import sys, rigidimeter.cli.main; "
        "print([m for m in ('numpy','scipy','pyarrow','matplotlib','pydantic','rich') "
        "if m in sys.modules])"
    )
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert out.stdout.strip() == "[]"


def test_a_session_goes_from_simulation_to_estimate_to_comparison(rigidimeter, tmp_path):
    settings = tmp_path / "study.toml"
    settings.write_text(
        """
        seed = 4
        prbs.duration_s = 12.0
        [rig]
        tick_rate_hz = 250.0
        torque.rate_hz = 250.0
        motion.rate_hz = 250.0
        [protocol]
        rests_s = [1.0]
        return_s = 1.0
        blocks = [{task = "prbs", condition = "OFF", epochs = 3},
                  {task = "prbs", condition = "DBS", epochs = 3},
                  {task = "sinusoid", condition = "OFF", epochs = 1}]
        """
    )
    session, out, table = tmp_path / "session", tmp_path / "e.json", tmp_path / "e.csv"
    ran = rigidimeter("simulate", "--settings", settings, "--out", session)
    assert ran.status == 0
    assert "7 of 7 epochs completed" in ran.out

    ran = rigidimeter("estimate", session, "--json", out, "--csv", table)
    assert ran.status == 0, ran.err
    document = json.loads(out.read_text())
    stiffness = [epoch["stiffness_nm_rad"] for epoch in document["epochs"]]
    np.testing.assert_allclose(stiffness, [1.751] * 3 + [1.44] * 3, rtol=0.01)
    assert [score["condition"] for score in document["scores"]] == ["OFF"]
    assert len(table.read_text().splitlines()) == 7

    one, two = tmp_path / "c1.json", tmp_path / "c2.json"
    assert rigidimeter("compare", session, "--json", one).status == 0
    ran = rigidimeter("compare", out, "--json", two, "--csv", tmp_path / "c.csv")
    assert ran.status == 0
    found, again = (json.loads(path.read_text()) for path in (one, two))
    assert found.pop("lead") == f"Virtual data. {again.pop('lead')}"  # estimates do not say it
    assert found == again
    measures = {c["measure"]: c for c in json.loads(two.read_text())["comparisons"]}
    assert measures["stiffness_nm_rad"]["shift"] == pytest.approx(0.311, abs=0.01)
    assert "asymptotic" in measures["stiffness_nm_rad"]["test"]
    assert "work_j" in (tmp_path / "c.csv").read_text()


def test_a_motion_too_short_for_the_cycles_is_named_by_each_command(rigidimeter, tmp_path):
    """3 s of 2 Hz less 1 s at each end hold 2 cycles."""
    settings, session = tmp_path / "short.toml", tmp_path / "session"
    settings.write_text(
        """
        rig = {tick_rate_hz = 250.0, torque.rate_hz = 250.0, motion.rate_hz = 250.0}
        sinusoid = {motion_s = 3.0, duration_s = 5.0, frequency_hz = 2.0, amplitude_deg = 5.0}
        [protocol]
        rests_s = [1.0]
        return_s = 1.0
        blocks = [{task = "sinusoid", condition = "OFF", epochs = 1}]
        """
    )
    said = "holds 2 of the scores.cycles = 8 cycles to be scored; 6 s hold all of them"
    assert said in " ".join(rigidimeter("design", "--settings", settings).out.split())
    assert said in rigidimeter("simulate", "--settings", settings, "--out", session).err
    words = " ".join(rigidimeter("estimate", session).out.split())
    assert (
        "1 of 1 sinusoids were scored over fewer than scores.cycles = 8 cycles, the fewest 2"
    ) in words


def test_options_shape_a_simulation(rigidimeter, tmp_path):
    ran = rigidimeter(
        "simulate", "--out", tmp_path / "s", "--task", "prbs", "--condition", "DBS",
        "--epochs", 1, "--seed", 8, "--paper-rates",
    )  # fmt: skip
    assert ran.status == 0, ran.err
    manifest = json.loads((tmp_path / "s" / "manifest.json").read_text())
    assert manifest["seeds"] == {"session": 8}
    assert manifest["settings"]["rig"]["torque"]["rate_hz"] == 100.0
    assert manifest["settings"]["rig"]["motion"]["rate_hz"] == 50.0
    assert [epoch["condition"] for epoch in manifest["protocol"]] == ["DBS"]


def test_a_report_of_a_foreign_recording(rigidimeter, tmp_path):
    rng = np.random.default_rng(0)
    t = np.arange(4000) / 100.0
    angle = np.cumsum(rng.standard_normal(4000)) * 0.001
    torque = 2.0 * angle + 0.1 * rng.standard_normal(4000)
    rows = "".join(f"{a},{b},{c}\n" for a, b, c in zip(t, angle, torque, strict=True))
    (tmp_path / "joint.csv").write_text("time_s,angle_rad,torque_nm\n" + rows)
    ran = rigidimeter(
        "report", tmp_path / "joint.csv", "--epoch-length-s", 20, "--out", tmp_path / "report"
    )
    assert ran.status == 0, ran.err
    assert ran.out.strip().endswith("report.html")
    assert (tmp_path / "report" / "estimates.json").exists()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["estimate", "none.csv"], "none.csv: there is no such file"),
        (["estimate", "{session}", "--method", "magic"], "known: auto, published, bandlimited, iv"),
        (
            ["estimate", "{session}", "--rate-hz", "-5"],
            "--rate-hz -5: the sampling rate must be greater",
        ),
        (["estimate", "{session}", "--column", "torque_nm"], "write NAME=COLUMN"),
        (["estimate", "{session}", "--column", "a=b", "--column", "a=c"], "already given"),
        (["estimate", "{session}", "--task", "dance"], "must be prbs or sinusoid"),
        (["estimate", "{session}", "--band-hz", "5", "2"], "band_low_hz must be below"),
        (["estimate", "{session}", "--json", "no/such/folder.json"], "cannot be written"),
        (["estimate", "{session}", "--settings", "none.toml"], "none.toml: cannot be read"),
        (["compare", "{session}"], "needs two conditions"),
        (["compare", "{session}", "--reference", "X"], "no such condition; recorded are: OFF"),
        (["recover", "."], "is not a session folder"),
        (["simulate", "--out", "{session}"], "is not empty"),
        (["simulate", "--out", "x", "--epochs", "3"], "need --task"),
        (["simulate", "--out", "x", "--task", "dance"], "--task dance: must be prbs or sinusoid"),
        (
            ["simulate", "--out", "x", "--task", "prbs", "--condition", "Z"],
            "--condition Z: there is no [subject.Z] in the settings; known conditions: DBS, OFF",
        ),
        (["simulate", "--out", "x", "--task", "prbs", "--epochs", "0"], "epochs = 0: Input should"),
        (["report", "{session}", "--out", "{session}/manifest.json"], "lies in a session folder"),
        (
            ["report", "{session}", "--out", "/dev/null/report"],
            "cannot be written (/dev/null is no",
        ),
    ],
)
def test_what_a_user_did_wrong_is_one_sentence_and_a_status(
    rigidimeter, simulate, arguments, words, tmp_path, monkeypatch
):
    folder = simulate() if any("{session}" in argument for argument in arguments) else None
    monkeypatch.chdir(tmp_path)
    ran = rigidimeter(*(argument.format(session=folder) for argument in arguments))
    assert ran.status == 1
    assert words in ran.err
    assert ran.err.count("rigidimeter: ") == 1


def test_a_recording_of_which_no_epoch_counts_has_no_estimate_to_use(rigidimeter, tmp_path):
    """One epoch that is excluded is no error; every epoch is."""
    time_s = np.arange(4000) / 200
    torque = torque_nm(time_s)
    for name, clipped in (("one", time_s < 10), ("all", time_s >= 0)):
        values = np.where(clipped, np.clip(torque, -0.02, 0.02), torque)
        np.savez(
            tmp_path / f"{name}.npz", time_s=time_s, torque_nm=values, angle_rad=angle_rad(time_s)
        )
    ran = rigidimeter("estimate", tmp_path / "one.npz", "--epoch-length-s", 10)
    assert ran.status == 0
    assert "2 epochs, 1 used" in ran.out
    assert "excluded  epoch 1: torque_nm repeats its extreme value" in ran.out
    ran = rigidimeter("estimate", tmp_path / "all.npz", "--epoch-length-s", 10)
    assert ran.status == 1
    assert "0 used" in ran.out
    assert "error: no epoch counts, so there is no estimate to use. The first: torque_nm" in ran.err


def test_a_good_epoch_beside_bad_inputs_is_analysed(rigidimeter, simulate, tmp_path):
    good = simulate()
    (tmp_path / "bad.csv").write_text("time_s,torque_nm,angle_rad\n0,1,2\n0.1,x,2\n")
    out = tmp_path / "out.json"
    ran = rigidimeter("estimate", tmp_path / "bad.csv", good, "--json", out)
    assert ran.status == 1
    assert "bad.csv" in ran.err
    (epoch,) = json.loads(out.read_text())["epochs"]
    assert epoch["outcome"] == "included"


def test_two_files_of_one_condition_each_are_compared(rigidimeter, tmp_path):
    t = np.arange(3000) / 100.0
    f = np.arange(0.2, 8.0, 0.35)
    w = 2 * np.pi * f
    A = 0.03 / (1 + f)
    noise = 1e-3 * np.random.default_rng(1).standard_normal(t.size)  # else it was not measured
    for name, stiffness in (("before", 2.0), ("after", 1.0)):
        x = A @ np.sin(np.outer(w, t) + (f * 7)[:, None])
        v = (A * w) @ np.cos(np.outer(w, t) + (f * 7)[:, None])
        a = -(A * w**2) @ np.sin(np.outer(w, t) + (f * 7)[:, None])
        rows = zip(t, x, v, stiffness * x + 0.1 * v + 0.005 * a + noise, strict=True)
        text = "".join(",".join(map(repr, map(float, row))) + "\n" for row in rows)
        (tmp_path / f"{name}.csv").write_text("time_s,angle_rad,velocity_rad_s,torque_nm\n" + text)
    files = (tmp_path / "before.csv", tmp_path / "after.csv")
    ran = rigidimeter("compare", *files, "--condition", "OFF", "--condition", "DBS",
                      "--epoch-length-s", 7, "--json", tmp_path / "c.json")  # fmt: skip
    assert ran.status == 0, ran.err
    rows = json.loads((tmp_path / "c.json").read_text())["comparisons"]
    (stiffness,) = [row for row in rows if row["measure"] == "stiffness_nm_rad"]
    assert stiffness["shift"] == pytest.approx(1.0, rel=0.01)
    ran = rigidimeter(
        "estimate", *files, "--condition", "A", "--condition", "B", "--condition", "C"
    )
    assert "given 3 times for 2 inputs" in ran.err
    # The torque with its sign turned is doubted.
    ran = rigidimeter("estimate", files[0], "--reaction", "--epoch-length-s", 7)
    assert "leave out --reaction" in ran.err


def test_a_guard_that_changes_many_commands_is_said(rigidimeter, simulate):
    folder = simulate(guard={"speed_limit_deg_s": 5.0})
    ran = rigidimeter("estimate", folder, "--full")
    assert re.search(r"guard_limited The guard changed \d+ %", " ".join(ran.out.split()))


def test_a_report_is_not_written_into_a_session(rigidimeter, simulate):
    folder = simulate()
    before = sorted(folder.rglob("*"))
    for out in (folder, folder / "report"):
        ran = rigidimeter("report", folder, "--out", out)
        assert ran.status == 1
        assert "is or lies in a session folder" in ran.err
    assert sorted(folder.rglob("*")) == before


@pytest.mark.usefixtures("no_figures")
def test_a_report_renews_its_own_and_is_not_written_over_anothers(
    rigidimeter, simulate, tmp_path, monkeypatch
):
    monkeypatch.setattr("rigidimeter.cli.progress.QUIET_S", math.inf)  # busy as a machine may be
    one, two = simulate(name="one"), simulate(name="two", seed=2)
    out = tmp_path / "page"

    def said(*words: object) -> str:
        ran = rigidimeter("report", *words)
        assert ran.status == bool(ran.err)
        return ran.err

    assert said(one, "--out", out) == ""
    before = (out / "report.html").read_bytes()
    refusal = said(two, "--out", out)
    assert f"--out {out}: holds the report of something else (../one); " in refusal
    assert "name another folder, or write into it with --overwrite" in refusal
    assert (out / "report.html").read_bytes() == before
    (out / "note.txt").write_text("mine")  # beside its own report nothing is in the way
    assert said(one, "--out", out, "--title", "Again") == ""
    assert b"Again" in (out / "report.html").read_bytes()

    thesis = tmp_path / "thesis"
    (thesis / "figures").mkdir(parents=True)
    (thesis / ".hidden").write_text("")
    refusal = said(one, "--out", thesis)
    assert f"--out {thesis}: holds files that are not of a report (figures); name" in refusal
    assert sorted(path.name for path in thesis.iterdir()) == [".hidden", "figures"]
    with pytest.raises(UserError, match=r"not of a report .* overwrite=True"):
        rm.report(one, thesis)
    assert said(two, "--out", out, "--overwrite") == ""


def test_a_session_in_which_an_epoch_failed_is_recorded_and_ends_with_1(rigidimeter, tmp_path):
    """The perturbation moves the arm to the position limit, the imposed sinusoid does not."""
    (tmp_path / "tight.toml").write_text(
        "[rig]\ntick_rate_hz = 250.0\ntorque.rate_hz = 250.0\nmotion.rate_hz = 250.0\n"
        "[guard]\nposition_limit_deg = 10.0\n[sinusoid]\namplitude_deg = 5.0\n"
        "[protocol]\nrests_s = [1.0]\nreturn_s = 1.0\n"
        'blocks = [{task = "prbs", epochs = 1}, {task = "sinusoid", epochs = 1}]\n'
    )
    ran = rigidimeter("simulate", "--settings", tmp_path / "tight.toml", "--out", tmp_path / "s")
    assert ran.status == 1
    assert "1 of 2 epochs completed" in ran.out
    assert "1 of 2 epochs did not end with success; events.jsonl holds the reason" in ran.err


def test_a_demo_moves_an_earlier_one_aside_and_nothing_else(rigidimeter, tmp_path, monkeypatch):
    """What a demo shows is in the tutorial, which is run."""
    monkeypatch.setattr("rigidimeter.cli.study._simulated", lambda *_: [])
    other = tmp_path / "thesis"
    other.mkdir()
    (other / "chapter.txt").write_text("years of work")
    ran = rigidimeter("demo", "--out", other)
    assert ran.status == 1
    assert "is no earlier demo" in ran.err
    assert rigidimeter("demo", "--out", other / "chapter.txt").status == 1
    assert (other / "chapter.txt").read_text() == "years of work"
    earlier = tmp_path / "demo"
    (earlier / "sessions").mkdir(parents=True)
    ran = rigidimeter("demo", "--out", earlier)
    assert f"{earlier} was there already and is now {tmp_path / 'demo-1'}" in ran.out
    assert (tmp_path / "demo-1" / "sessions").is_dir()
    assert not earlier.exists()


def test_what_is_read_is_never_written_over(rigidimeter, simulate, tmp_path):
    folder = simulate()
    samples = (folder / "samples.arrows").read_bytes()
    for output in (folder / "samples.arrows", folder / "new.csv"):
        ran = rigidimeter("estimate", folder, "--csv", output)
        assert ran.status == 1
        assert "session folder" in ran.err
    assert (folder / "samples.arrows").read_bytes() == samples
    (tmp_path / "rig.toml").write_text("seed = 3\n")
    ran = rigidimeter(
        "design", "--settings", tmp_path / "rig.toml", "--json", tmp_path / "rig.toml"
    )
    assert ran.status == 1
    assert (tmp_path / "rig.toml").read_text() == "seed = 3\n"
    ran = rigidimeter("estimate", folder, "--csv", tmp_path / "o", "--json", tmp_path / "o")
    assert ran.status == 1
    assert not (tmp_path / "o").exists()


def test_files_are_written_even_when_nobody_reads_the_words(simulate, tmp_path):
    folder, out = simulate(), tmp_path / "out.json"
    command = f"'{sys.executable}' -m rigidimeter estimate {folder} --json {out} | true"
    ran = subprocess.run(["bash", "-c", command], capture_output=True, text=True, check=False)
    assert "Traceback" not in ran.stderr
    assert json.loads(out.read_text())["epochs"]


def test_a_terminal_without_our_signs_or_space_is_no_traceback():
    """A sign would fail when it is printed, the space when all is written at the end."""
    command = f"PYTHONIOENCODING=cp1252 '{sys.executable}' -m rigidimeter design > /dev/full"
    ran = subprocess.run(["bash", "-c", command], capture_output=True, text=True, check=False)
    assert "Traceback" not in ran.stderr
    assert "No space left on device" in ran.stderr


def test_microseconds_given_as_seconds_are_refused_in_words(rigidimeter, tmp_path):
    rows = "".join(f"{a * 1e4},{a // 70 % 7 / 50},{a // 70 % 5}\n" for a in range(8000))
    (tmp_path / "us.csv").write_text("time_s,angle_rad,torque_nm\n" + rows)
    ran = rigidimeter("estimate", tmp_path / "us.csv")
    assert ran.status == 1
    assert "are too slow; say --unit time=s or --unit time=ms" in ran.err
    assert "time as us: 100 samples/s for 79.99 s" in ran.err


def test_what_was_not_estimated_is_a_dash_and_has_no_error():
    value, nan = np.array([0.0045, 0.137, 1.75]), np.full(3, np.nan)
    fits = tuple(
        Fit("a.csv", label, "OFF", "iv", outcome, numbers, nan, nan, nan, nan, r_squared=0.97)
        for label, numbers, outcome in (
            ("1", value, Outcome()),
            ("2", nan, Outcome("failed", "too short")),
        )
    )
    scores = (Score("a.csv", "3", "OFF", Outcome("failed", "no motion")),)
    analysis = Analysis("iv", fits, fits, 0.0045, scores, fits[:1])
    _, *lines = text_lines(estimate_blocks(Recording((), (), Settings(), ()), analysis), 100)
    text = "\n".join(lines)
    assert "nan" not in text
    assert not re.search(r"\d ?±", text)
    one, two, together = (
        next(line for line in lines if line.startswith(f" {name} "))
        for name in ("1", "2", "together")
    )
    assert one.split()[2:] == ["4.5", "0.137", "1.75", "–"]
    assert two.split()[2:] == ["–", "–", "–", "–", "failed"]
    assert together.split()[2:] == ["4.5", "0.14", "1.8"]
    assert text.count("\n 95 %    ") == 1
    assert "sinusoids" not in text  # there is no score


@pytest.mark.parametrize(
    ("command", "words"),
    [
        (("design", "off.toml"), "say --settings off.toml"),
        (("simulate", "off.toml"), "say --settings off.toml"),
        (("simulate", "--out", "session", "off.toml"), "say --settings off.toml"),
        (("estimate", "study"), "`rigidimeter compare study`"),
        (("ratings", "study"), "give their table, study/ratings.csv"),
    ],
)
def test_an_input_in_the_wrong_place_is_answered_with_the_right_one(
    rigidimeter, tmp_path, monkeypatch, command, words
):
    monkeypatch.chdir(tmp_path)
    assert rigidimeter("study", "new", "study").status == 0
    ran = rigidimeter(*command)
    assert ran.status != 0
    assert words in " ".join(ran.err.split())
