"""A study whose recordings are no session folders: exports, data sets, files with a mapping."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest
from tests.archive_files import write_bids_motion, write_nwb
from tests.instrument_files import Signal
from tests.known_joint import angle_rad, torque_nm

from rigidimeter.analysis.export import export_sessions, sessions_of_recording
from rigidimeter.analysis.reading import read
from rigidimeter.analysis.study import read_study
from rigidimeter.core.errors import UserError

FORMATS = {"bids": "", "mat": ".mat", "nwb": ".nwb"}
TIME_S = np.arange(1200) / 100.0
TOML = (
    'schema = "rigidimeter.study/1"\ntitle = "t"\nreference = "OFF"\nother = "DBS"\n'
    '[conditions.OFF]\n[conditions.DBS]\nmapping = "lab.toml"\n'
)


def test_exports_are_the_sessions_that_they_were_made_of(study: Path) -> None:
    pytest.importorskip("pynwb")
    before = read_study(study)
    table = (study / "sessions.csv").read_text()
    for (to, suffix), session in zip(FORMATS.items(), before.gathered.sessions, strict=False):
        path = study / session.row["path"]
        exported = path.with_name(f"{path.name}-{to}{suffix}")
        export_sessions(sessions_of_recording(read(path), None), to, exported)
        shutil.rmtree(path)
        table = table.replace(session.row["path"], str(exported.relative_to(study)))
    (study / "sessions.csv").write_text(table)
    after = read_study(study)
    assert [n.text for n in after.notices] == [n.text for n in before.notices]
    kept = ("subject", "day", "condition")
    for one, other in zip(after.gathered.sessions, before.gathered.sessions, strict=True):
        assert [getattr(one.entry, k) for k in kept] == [getattr(other.entry, k) for k in kept]
    for one, other in zip(after.epochs, before.epochs, strict=True):
        assert (one.condition, one.task, one.label) == (other.condition, other.task, other.label)
        for name, channel in other.channels.items():
            assert len(one.channels[name]) == pytest.approx(len(channel), abs=3)


def test_a_copy_of_a_folder_under_another_name_is_found(study: Path, edit) -> None:
    rows = (study / "sessions.csv").read_text().splitlines()[1:]
    path, again = (study / row.split(",")[0] for row in rows[:2])
    for place, subject in ((path.with_name("one"), "S1"), (again.with_name("two"), "S2")):
        sessions = sessions_of_recording(read(path), None, subject=subject)
        export_sessions(sessions, "bids", place)
    for old, new in ((path, "one"), (again, "two")):
        edit(study / "sessions.csv", str(old.relative_to(study)), f"sessions/{new}")
    (left_out,) = read_study(study).gathered.left_out
    assert "sessions/two holds the same samples as sessions/one" in left_out.reason


def _csv(path: Path, seed: int) -> None:
    """Write ms, degrees and the joint's reaction, none of which the file says."""
    columns = [1e3 * TIME_S, -torque_nm(TIME_S, seed), np.degrees(angle_rad(TIME_S, seed))]
    np.savetxt(path, np.column_stack(columns), "%.17g", ",", header="t,M,w", comments="")


def test_mappings_of_the_study_and_of_single_sessions(tmp_path: Path) -> None:
    pytest.importorskip("pynwb")
    (tmp_path / "study.toml").write_text(TOML.replace("[conditions.OFF]\n[conditions.DBS]\n", ""))
    schema = 'schema = "rigidimeter.mapping/1"\n'
    (tmp_path / "lab.toml").write_text(
        f'{schema}reaction = true\n[time]\nunit = "ms"\n[torque]\nunit = "Nm"\n'
        '[angle]\ncolumn = "w"\nunit = "deg"\n'
    )
    (tmp_path / "force.toml").write_text(f'{schema}[torque]\nscale = "0.25 m"\n')
    rows = ["a.csv,S1,1,OFF,", "b.csv,S1,2,DBS,"]
    rows += ["set,S1,3,OFF,force.toml", "r.nwb,S1,4,DBS,force.toml"]
    header = "path,subject,day,condition,mapping"
    (tmp_path / "sessions.csv").write_text("\n".join([header, *rows]) + "\n")
    _csv(tmp_path / "a.csv", 0)
    _csv(tmp_path / "b.csv", 1)
    for seed, write, name in ((2, write_bids_motion, "set"), (3, write_nwb, "r.nwb")):
        force = Signal("Fz", "N", torque_nm(TIME_S, seed) / 0.25, 100.0)
        angle = Signal("Angle", "deg", np.degrees(angle_rad(TIME_S, seed)), 100.0)
        write(tmp_path / name, [force, angle], **({"latency": True} if name == "set" else {}))
    found = read_study(tmp_path)
    assert [epoch.condition for epoch in found.epochs] == ["OFF", "DBS", "OFF", "DBS"]
    for seed, epoch in enumerate(found.epochs):
        channels = epoch.channels
        np.testing.assert_allclose(channels["torque_nm"].time_s, TIME_S, atol=1e-12)
        np.testing.assert_allclose(
            channels["torque_nm"].values, torque_nm(TIME_S, seed), rtol=1e-9, atol=1e-11
        )
        np.testing.assert_allclose(
            channels["angle_rad"].values, angle_rad(TIME_S, seed), atol=1e-11
        )


@pytest.mark.parametrize("offset", ["0.375", "found"])
def test_torque_and_motion_in_two_files_each_with_its_clock(tmp_path: Path, offset: str) -> None:
    (tmp_path / "study.toml").write_text(TOML.replace('mapping = "lab.toml"\n', ""))
    rows = ["path,subject,day,condition,join,clock_offset"]
    for day, condition in enumerate(("OFF", "DBS")):
        torque, motion = f"m{day}.csv", f"a{day}.csv"
        for name, head, values, late_s in (
            (torque, "t [s],M [Nm]", torque_nm(TIME_S, day), 0.0),
            (motion, "t [s],phi [rad]", angle_rad(TIME_S, day), 0.375),
        ):
            columns = np.column_stack([TIME_S - late_s, values])
            np.savetxt(tmp_path / name, columns, "%.17g", ",", header=head, comments="")
        rows.append(f"{torque},S1,{day + 1},{condition},{motion},{offset}")
    (tmp_path / "sessions.csv").write_text("\n".join(rows) + "\n")
    found = read_study(tmp_path)
    assert [epoch.condition for epoch in found.epochs] == ["OFF", "DBS"]
    assert {"m0.csv", "a0.csv"} <= set(found.gathered.digests)
    for day, epoch in enumerate(found.epochs):
        angle = epoch.channels["angle_rad"]
        wanted = angle_rad(angle.time_s, day)
        assert np.abs(angle.values - wanted).max() < (1e-9 if offset != "found" else 1e-4)
        assert (epoch.clock_error_s > 0) == (offset == "found")


def test_a_file_to_join_that_lies_elsewhere_is_refused(tmp_path: Path) -> None:
    (tmp_path / "study.toml").write_text(TOML.replace('mapping = "lab.toml"\n', ""))
    (tmp_path / "sessions.csv").write_text(
        "path,subject,day,condition,join\nm.csv,S1,1,OFF,../a.csv\n"
    )
    np.savetxt(tmp_path / "m.csv", [[0, 0], [1, 1]], header="t_s,M_Nm", delimiter=",", comments="")
    with pytest.raises(UserError, match=r"join is \.\./a\.csv, outside the study folder"):
        read_study(tmp_path)
