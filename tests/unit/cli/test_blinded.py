"""No output of a blinded session names a condition."""

from __future__ import annotations

import json
import random
import shutil
import tomllib

import pytest
from tests.replayed import assert_folder_replayed

from rigidimeter.analysis.reading import read
from rigidimeter.cli.planned_session import PlannedSession, write_nwb_beside
from rigidimeter.core.files import ZEROS, json_text, text_bytes, with_checksum
from rigidimeter.core.session import codes_of, drawn_codes
from rigidimeter.core.settings import parse_settings
from rigidimeter.planning import plan
from rigidimeter.virtual import run_virtual_session

PROTOCOL = """
prbs.duration_s = 12.0
rig.tick_rate_hz = 250.0
rig.torque.rate_hz = 250.0
rig.motion.rate_hz = 250.0
protocol.rests_s = [1.0]
protocol.return_s = 1.0
protocol.blocks = [{condition = "Zebra", epochs = 2}, {condition = "Quagga", epochs = 2}]
[subject.Zebra]
[subject.Quagga]
stiffness_nm_rad = 1.4
"""
NAMES = ("Zebra", "Quagga")


@pytest.fixture(scope="module")
def session(tmp_path_factory):
    """A session of two conditions, recorded blinded: Zebra is code-B."""
    folder = tmp_path_factory.mktemp("blinded")
    run_virtual_session(parse_settings(tomllib.loads(PROTOCOL)), folder / "session")
    assert_folder_replayed(folder / "session")
    path = folder / "session" / "manifest.json"
    manifest = json.loads(path.read_text())
    manifest["about"] = {"blinded": True, "codes": {"Zebra": "code-B", "Quagga": "code-A"}}
    path.write_bytes(with_checksum(text_bytes(json_text({**manifest, "checksum": ZEROS}))))
    return path.parent


def test_an_estimate_shows_codes_alone(session, rigidimeter):
    ran = rigidimeter("estimate", session, "--blinded")
    assert ran.status == 0
    assert "code-A" in ran.out
    assert not any(name in ran.out + ran.err for name in NAMES)
    assert "Zebra" in rigidimeter("estimate", session).out


def test_no_file_of_a_report_names_a_condition(session, rigidimeter, tmp_path):
    ran = rigidimeter("report", session, "--blinded", "--out", tmp_path / "report")
    assert not any(name in ran.out + ran.err for name in NAMES)
    files = [path for path in (tmp_path / "report").rglob("*") if path.is_file()]
    assert files
    for path in files:
        content = path.read_bytes()
        assert not any(name.encode() in content for name in NAMES), path
    assert b"code-B" in (tmp_path / "report" / "report.html").read_bytes()


@pytest.mark.parametrize("to", ["csv", "bids"])
def test_no_file_of_an_export_names_a_condition(session, rigidimeter, tmp_path, to):
    """The path may tell the condition too."""
    session = shutil.copytree(session, tmp_path / "Zebra first")
    out = tmp_path / "out"
    ran = rigidimeter("export", session, "--blinded", "--to", to, "--out", out)
    assert ran.status == 0
    files = [path for path in out.rglob("*") if path.is_file()]
    assert files
    for path in files:
        content = path.read_bytes()
        assert not any(name.encode() in content for name in NAMES), path
        assert not any(name in str(path.relative_to(out)) for name in NAMES)
    tables = [out / f"{name}.csv" for name in ("torque", "motion", "control")]
    found = read(tables, join=True) if to == "csv" else read(out)
    again = [epoch.condition for epoch in found.epochs]
    assert again == ["code-B", "code-B", "code-A", "code-A"]


def test_nwb_at_the_close_of_a_blinded_session_has_codes(session, tmp_path):
    pytest.importorskip("pynwb")
    session = shutil.copytree(session, tmp_path / "session")
    assert write_nwb_beside(session).startswith("the same as NWB")
    assert read(tmp_path / "session.nwb").epochs[0].condition == "code-B"
    content = (tmp_path / "session.nwb").read_bytes()
    assert not any(name.encode() in content for name in NAMES)


def test_a_session_that_was_not_blinded_has_no_codes(rigidimeter, session, tmp_path):
    path = tmp_path / "open"
    path.symlink_to(session)
    assert rigidimeter("estimate", path, "--blinded").status == 0
    table = tmp_path / "table.csv"
    table.write_text("time_s,torque_nm,angle_rad\n0,0,0\n0.001,0,0\n")
    ran = rigidimeter("estimate", session, table, "--blinded")
    assert ran.status == 1
    assert "--blinded is for sessions that were recorded blinded" in ran.err


def test_codes_are_drawn_once_and_kept_by_the_session_that_continues():
    drawn = {drawn_codes(["DBS", "OFF"], random.Random(seed))["DBS"] for seed in range(20)}
    assert drawn == {"code-A", "code-B"}
    settings = parse_settings({"protocol": {"blocks": [{"condition": "OFF"}]}})
    protocol = plan(settings.protocol, settings.prbs, settings.sinusoid, settings.seed)
    planned = PlannedSession(settings, protocol, about={"subject": "S01"}).blinded()
    assert codes_of(planned.about) == {"OFF": "code-A"}
    assert planned.about["subject"] == "S01"
    assert planned.blinded() is planned
    assert planned.shown(virtual=True).shown("OFF") == "code-A"
    assert PlannedSession(settings, protocol).shown(virtual=True).shown("OFF") == "OFF"
