"""`inspect` on the command line; mapping files wherever recordings are read."""

import json
import shlex

import numpy as np
import pytest
from tests.known_joint import STIFFNESS_NM_RAD, angle_rad, torque_nm

TIME_S = np.arange(2400) / 100.0


@pytest.fixture
def path(tmp_path):
    columns = (TIME_S, torque_nm(TIME_S) / 2.5, np.degrees(angle_rad(TIME_S)))
    lists = (column.tolist() for column in columns)
    rows = "".join(f"{a};{b};{c}\n" for a, b, c in zip(*lists, strict=True))
    path = tmp_path / "elbow.csv"
    path.write_text("Zeit [s];Sensor [V];Winkel [°]\n" + rows, "utf-8")
    return path


SAID = ("--column", "torque=Sensor [V]", "--scale", "torque=2.5 Nm/V")


def stiffness(out):
    return json.loads(out.read_text())["epochs"][0]["stiffness_nm_rad"]


def test_inspect_then_the_command_and_the_mapping_that_it_gives(path, tmp_path, rigidimeter):
    asked = rigidimeter("inspect", path)
    assert asked.status == 0
    assert "has no column torque_nm" in " ".join(asked.out.split())
    lab, image = tmp_path / "lab.toml", tmp_path / "elbow.png"
    ran = rigidimeter("inspect", path, *SAID, "--write-mapping", lab, "--plot", image)
    assert ran.status == 0, ran.err
    assert image.read_bytes()[:4] == b"\x89PNG"
    (line,) = [line for line in ran.out.splitlines() if line.startswith("reads it: ")]
    words = shlex.split(line.removeprefix("reads it: "))
    for command in (words[1:], ["estimate", path, "--mapping", lab]):
        out = tmp_path / "out.json"
        assert rigidimeter(*command, "--json", out).status == 0
        assert stiffness(out) == pytest.approx(STIFFNESS_NM_RAD, rel=0.02)


def test_a_study_reads_its_recordings_by_a_mapping(path, tmp_path, rigidimeter):
    study = tmp_path / "study"
    assert rigidimeter("study", "new", study, "--title", "a").status == 0
    for name in ("off", "dbs"):
        (study / f"{name}.csv").write_bytes(path.read_bytes() + b"\n" * (name == "dbs"))
    lab = study / "lab.toml"
    assert rigidimeter("inspect", path, *SAID, "--write-mapping", lab).status == 0
    (study / "sessions.csv").write_text(
        "path,subject,day,condition,mapping\noff.csv,S,1,OFF,\ndbs.csv,S,1,DBS,lab.toml\n"
    )
    refused = rigidimeter("compare", study)
    assert "off.csv has no column torque_nm" in refused.err
    assert "dbs.csv" not in refused.err
    toml = study / "study.toml"
    text = toml.read_text("utf-8").replace("\n\n", '\nmapping = "lab.toml"\n\n', 1)
    toml.write_text(text, "utf-8")
    ran = rigidimeter("compare", study)
    assert ".csv" not in ran.err  # the only error is that of one epoch a condition
    assert "lab.toml" in json.loads((study / "analysis" / "inputs.json").read_text())["files"]


def test_a_session_folder_is_inspected_too(rigidimeter, simulate):
    folder = simulate()
    ran = rigidimeter("inspect", folder)
    assert ran.status == 0
    assert "session folder with 1 epochs" in ran.out


def test_torque_and_motion_in_two_files_with_a_clock_each(tmp_path, rigidimeter):
    torque_s, motion_s = np.arange(12_000) / 500.0, np.arange(4_800) / 200.0
    torque, motion, out = tmp_path / "m.csv", tmp_path / "a.csv", tmp_path / "out.json"
    np.savetxt(torque, np.c_[torque_s, torque_nm(torque_s)], header="t_s,M_Nm", delimiter=",")
    late = np.c_[1e3 * (motion_s - 0.75), np.degrees(angle_rad(motion_s))]
    np.savetxt(motion, late, header="t_ms,phi_deg", delimiter=",")
    asked = ("estimate", torque, motion, "--json", out)
    assert "no column torque_nm" in rigidimeter(*asked).err
    ran = rigidimeter(*asked, "--join", "--clock-offset", "found")
    assert ran.status == 0, ran.err
    assert "a.csv: 0.75" in ran.err
    assert "The intervals of J, B and K contain the error" in ran.err
    assert stiffness(out) == pytest.approx(STIFFNESS_NM_RAD, rel=0.01)
    assert "say --join" in rigidimeter(*asked, "--clock-offset", "0.75").err


def test_files_that_belong_together_are_inspected_together(tmp_path, rigidimeter):
    """The command that is proposed has what joins them, and the sign that the numbers decide."""
    torque, motion, out = tmp_path / "m.csv", tmp_path / "a.csv", tmp_path / "out.json"
    torque_s, motion_s = np.arange(6_000) / 250.0, np.arange(2_400) / 100.0
    np.savetxt(torque, np.c_[torque_s, -torque_nm(torque_s)], header="t_s,M_Nm", delimiter=",")
    late = np.c_[1e3 * (motion_s - 0.75), np.degrees(angle_rad(motion_s))]
    np.savetxt(motion, late, header="t,phi_deg", delimiter=",")
    asked = ("inspect", torque, motion, "--join", "--clock-offset", "found")
    assert "the unit of 't' is stated nowhere" in rigidimeter(*asked).err
    ran = rigidimeter("inspect", torque, "--join")
    assert "name two recordings" in ran.err
    motion.write_text(motion.read_text().replace("t,phi", "t_ms,phi"))
    ran = rigidimeter(*asked)
    assert ran.status == 0, ran.err
    value, error = ran.out.splitlines()[0].removeprefix("clock offset: ")[:-2].split(" ± ")
    assert abs(float(value) - 0.75) < 4 * float(error) < 2e-4
    (line,) = [line for line in ran.out.splitlines() if line.startswith("reads it: ")]
    words = shlex.split(line.removeprefix("reads it: "))
    assert words[-4:] == ["--reaction", "--join", "--clock-offset", "found"]
    assert rigidimeter(*words[1:], "--json", out).status == 0
    assert stiffness(out) == pytest.approx(STIFFNESS_NM_RAD, rel=0.01)


def test_a_calibration_in_a_comment_is_shown(rigidimeter, tmp_path):
    """And proposed, not used: only a person knows whether it still holds."""
    path = tmp_path / "r.csv"
    rows = "".join(f"{k / 100},{k % 7},{k % 11 / 10}\n" for k in range(700))
    head = "# recorded by A\n# gain 0.0024 Nm/count\n# elbow\ntime_s,torque_counts,angle_deg\n"
    path.write_text(head + rows)
    ran = rigidimeter("inspect", path)
    assert ran.status == 0
    said = " ".join(ran.out.split())
    assert "the file says 'gain 0.0024 Nm/count'" in said
    assert "is in counts, and torque is needed in Nm: say --scale 'torque=0.0024 Nm/count'" in said


def _written(path, head, *columns):
    np.savetxt(path, np.c_[columns], delimiter=",", header=head, comments="")
    return path


def test_a_rate_of_which_rows_were_left_out_is_asked_for(tmp_path, rigidimeter):
    """Read at 1000 Hz, J would be 25 and B 5 times too small."""
    every_10_ms = torque_nm(TIME_S), angle_rad(TIME_S)
    head = "# Sampling rate: 1000 Hz, decimated by 10 for export\ntorque [Nm],angle [rad]"
    path = _written(tmp_path / "r.csv", head, *every_10_ms)
    refused = rigidimeter("estimate", path)
    assert refused.status == 1
    assert "'Sampling rate: 1000 Hz, decimated by 10 for export'" in refused.err
    assert "say --rate-hz" in refused.err
    out = tmp_path / "out.json"
    assert rigidimeter("estimate", path, "--rate-hz", "100", "--json", out).status == 0
    assert stiffness(out) == pytest.approx(STIFFNESS_NM_RAD, rel=0.02)


def test_a_velocity_that_is_not_the_derivative_of_the_angle_is_refused(tmp_path, rigidimeter):
    columns = (TIME_S, torque_nm(TIME_S), angle_rad(TIME_S))
    velocity = np.degrees(angle_rad(TIME_S, derivative=1))
    head = "time [s],torque [Nm],angle [rad],velocity [rad/s]"
    path = _written(tmp_path / "r.csv", head, *columns, velocity)
    refused = rigidimeter("estimate", path)
    assert refused.status == 1
    assert "'velocity [rad/s]' is in rad/s, but the velocity is 56.7 times" in refused.err
    assert "say --unit velocity=deg/s" in refused.err
    out = tmp_path / "out.json"
    ran = rigidimeter("estimate", path, "--unit", "velocity=deg/s", "--json", out)
    assert ran.status == 0
    assert stiffness(out) == pytest.approx(STIFFNESS_NM_RAD, rel=0.02)
    insists = ("--unit", "velocity=rad/s", "--unit", "angle=rad")
    believed = rigidimeter("estimate", path, *insists)
    assert "it is read as the unit that was given says" in believed.err


@pytest.mark.parametrize(
    ("block_s", "epochs"),
    [(16, ["0", "1", "2", "3", "4", "5"]), (12, ["1"])],
    ids=["trials within blocks", "a block ends within a trial"],
)
def test_the_command_that_is_printed_takes_trials_for_epochs_and_finds_the_perturbation(
    block_s, epochs, tmp_path, rigidimeter
):
    """Without them it would cut at 20 and 40 s, across trials of 8 s."""
    time_s = np.arange(4800) / 100.0
    torque = torque_nm(time_s)
    moves_nm = 0.01 * angle_rad(time_s, derivative=2) + 0.5 * angle_rad(time_s, derivative=1)
    path = _written(
        tmp_path / "r.csv",
        "time [s],torque [Nm],angle [rad],PRBS command [Nm],block,Trial No.",
        *(time_s, torque, angle_rad(time_s), moves_nm - torque, time_s // block_s, time_s // 8),
    )
    ran = rigidimeter("inspect", path)
    (line,) = [line for line in ran.out.splitlines() if line.startswith("reads it: ")]
    out = tmp_path / "out.json"
    command = shlex.split(line.removeprefix("reads it: "))
    assert rigidimeter(*command[1:], "--json", out).status == 0
    document = json.loads(out.read_text())
    found = document["epochs"]
    assert [one["epoch"] for one in found] == epochs
    assert document["method"] == "iv"
    for one in found:
        assert one["stiffness_nm_rad"] == pytest.approx(STIFFNESS_NM_RAD, rel=0.02)


def test_columns_of_trials_that_change_together_have_one_warning(tmp_path, rigidimeter):
    columns = (TIME_S, torque_nm(TIME_S), angle_rad(TIME_S))
    trial, half = 1 + TIME_S // 8, 1 + TIME_S // 12
    head = "time [s],torque [Nm],angle [rad],trial,run,block,half trial"
    path = _written(tmp_path / "r.csv", head, *columns, trial, 10 * trial, trial, half)
    said = rigidimeter("estimate", path).err
    assert said.count("reads each of its labels as an epoch") == 2
    together = (
        "column 'trial' (1, 2, 3) is not used, nor are 'run' and 'block', which change with it;"
    )
    assert f"{together} --column epoch=trial reads" in said
    assert "column 'half trial' (1, 2) is not used; --column" in said


def test_a_column_of_trials_that_is_not_used_is_named(tmp_path, rigidimeter):
    columns = (TIME_S, torque_nm(TIME_S), angle_rad(TIME_S))
    head = "time [s],torque [Nm],angle [rad],Trial No."
    path = _written(tmp_path / "r.csv", head, *columns, 1 + TIME_S // 8)
    ran = rigidimeter("estimate", path)
    assert ran.status == 0
    assert "column 'Trial No.' (1, 2, 3) is not used" in ran.err
    assert "--column 'epoch=Trial No.' reads each of its labels as an epoch" in ran.err
    out = tmp_path / "out.json"
    cut = rigidimeter("estimate", path, "--column", "epoch=Trial No.", "--json", out)
    assert "is not used" not in cut.err
    assert [one["epoch"] for one in json.loads(out.read_text())["epochs"]] == ["1", "2", "3"]
    once = _written(tmp_path / "once.csv", head, *columns, np.ones(TIME_S.size))
    assert "is not used" not in rigidimeter("estimate", once).err


def test_a_step_back_that_is_too_large_to_be_squared_is_no_jitter(rigidimeter, tmp_path):
    times = [f"{k / 100:.2f}" for k in range(400)]
    times[200] = "-1e200"
    path = tmp_path / "r.csv"
    rows = "".join(f"{t},{k % 7},{k % 5}\n" for k, t in enumerate(times))
    path.write_text("time_s,torque_nm,angle_rad\n" + rows)
    ran = rigidimeter("inspect", path)
    assert "Warning" not in ran.err
    assert "0.0 %" in ran.out
