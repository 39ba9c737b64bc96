import json

import numpy as np
import pyarrow as pa
import pytest
from tests.version_1 import as_version_1

from rigidimeter.core.errors import UserError
from rigidimeter.core.session import (
    SAMPLE_UNITS,
    SessionWriter,
    read_manifest,
    read_samples,
    read_session,
    recover,
    session_settings,
)
from rigidimeter.core.settings import Settings


def events(folder):
    return [json.loads(line) for line in (folder / "events.jsonl").read_text().splitlines()]


def test_the_manifest_holds_what_the_operator_said_of_the_session(tmp_path):
    about = {"subject": "S01", "stimulation": {"frequency_hz": 130.0}}
    for name, said in (("one", about), ("two", {})):
        SessionWriter(
            tmp_path / name, Settings(), [], {"session": 1}, virtual=True, about=said
        ).close(0.0, "success", "")
    assert read_manifest(tmp_path / "one")["about"] == about
    assert "about" not in read_manifest(tmp_path / "two")


def test_the_manifest_says_what_was_run(simulate):
    folder = simulate(seed=9)
    manifest = read_manifest(folder)
    assert manifest["virtual"] is True
    assert manifest["seeds"] == {"session": 9}
    assert manifest["channel_units"] == dict(SAMPLE_UNITS)
    assert manifest["versions"].keys() >= {"rigidimeter", "numpy", "scipy", "pyarrow"}
    assert manifest["protocol"][0]["task"] == "prbs"
    assert session_settings(folder).controller.inertia_kg_m2 == pytest.approx(0.0458, abs=5e-5)


def test_every_epoch_and_the_session_close_with_an_outcome(simulate):
    kinds = [(e["event"], e.get("outcome")) for e in events(simulate(epochs=2))]
    assert kinds == [
        ("session_started", None),
        ("epoch_started", None),
        ("epoch_ended", "success"),
        ("return_started", None),
        ("epoch_started", None),
        ("epoch_ended", "success"),
        ("return_started", None),
        ("session_ended", "success"),
    ]


def test_epochs_carry_their_channels_with_their_own_stamps(simulate):
    rates = {"torque": {"rate_hz": 100.0}, "motion": {"rate_hz": 50.0, "jitter_s": 0.005}}
    (epoch,), notices = read_session(simulate(rig=rates))
    assert not notices
    assert epoch.virtual
    assert epoch.task == "prbs"
    assert epoch.condition == "OFF"
    assert epoch.excitation_hz == (0.15, 10.0)
    assert epoch.channels["torque_nm"].rate_hz == pytest.approx(100.0)
    intervals = np.diff(epoch.channels["angle_rad"].time_s)
    assert intervals.min() >= 0.015 - 1e-9
    assert intervals.max() <= 0.025 + 1e-9
    assert np.ptp(intervals) > 0.008
    assert epoch.channels["velocity_command_rad_s"].rate_hz == pytest.approx(1000.0)


def test_a_sinusoid_says_when_it_moved(simulate):
    (epoch,), _ = read_session(simulate(task="sinusoid"))
    assert epoch.motion is not None
    assert epoch.motion.frequency_hz == 1.0
    assert epoch.motion.duration_s == 10.0
    assert "perturbation_nm" not in epoch.channels


def test_what_is_recorded_is_what_was_sent(simulate):
    # A guard far tighter than the perturbation needs: requests are cut, and the record shows both.
    folder = simulate(guard={"speed_limit_deg_s": 5.0})
    samples = read_samples(folder / "samples.arrows")
    sent, asked = samples["velocity_command_rad_s"], samples["velocity_request_rad_s"]
    assert np.abs(sent).max() <= np.deg2rad(5.0) + 1e-12
    assert np.abs(asked).max() > np.abs(sent).max()
    cut = samples["limited"] > 0
    np.testing.assert_array_equal(sent[~cut], asked[~cut])


def test_an_epoch_that_comes_to_the_position_limit_says_so(simulate):
    folder = simulate(guard={"position_limit_deg": 9.0}, sinusoid={"amplitude_deg": 5.0})
    ended = next(e for e in events(folder) if e["event"] == "epoch_ended")
    assert ended["outcome"] == "fail"
    assert "position limit of ±9 deg" in ended["reason"]
    (epoch,), _ = read_session(folder)
    assert epoch.closed.kind == "excluded"
    assert np.rad2deg(np.abs(epoch.channels["angle_rad"].values)).max() <= 9.01


def test_the_same_seed_gives_the_same_bytes(simulate):
    one, two, other = simulate(name="a"), simulate(name="b"), simulate(name="c", seed=2)
    content = [(f / "samples.arrows").read_bytes() for f in (one, two, other)]
    assert content[0] == content[1]
    assert content[0] != content[2]


def test_recovering_a_closed_session_changes_nothing(simulate):
    folder = simulate()
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    assert recover(folder).already_closed
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == before


def tear(folder, share):
    """Leave a session as a kill would: no end of the stream, no closing events."""
    path = folder / "samples.arrows"
    content = path.read_bytes()
    path.write_bytes(content[: int(share * len(content))])
    lines = (folder / "events.jsonl").read_bytes().splitlines(keepends=True)
    (folder / "events.jsonl").write_bytes(b"".join(lines[:2]) + b'{"event": "epo')


def test_a_torn_session_is_closed_with_the_reason_and_nothing_is_lost(simulate):
    folder = simulate()
    whole = (folder / "samples.arrows").read_bytes()
    tear(folder, 0.7)
    found = recover(folder, "power cut")
    assert not found.already_closed
    assert found.epochs_closed == ("1",)
    assert found.last_time_s > 0.65 * 21
    torn = folder / "samples.torn"
    kept = (folder / "samples.arrows").read_bytes()[:-8]
    assert kept + (torn.read_bytes() if torn.exists() else b"") == whole[: int(0.7 * len(whole))]
    closing = [e for e in events(folder) if e["event"].endswith("_ended")]
    assert [e["outcome"] for e in closing] == ["fail", "fail"]
    assert {e["reason"] for e in closing} == {"power cut"}
    assert recover(folder).already_closed
    (epoch,), notices = read_session(folder)
    assert not notices
    assert "power cut" in epoch.closed.reason


def test_an_interrupted_session_can_be_read_as_it_lies(simulate):
    folder = simulate()
    tear(folder, 0.7)
    (epoch,), (notice,) = read_session(folder)
    assert "recover" in notice.text
    assert "interrupted" in epoch.closed.reason


def test_a_session_killed_before_its_first_batch_is_closed_too(simulate):
    folder = simulate()
    tear(folder, 0.0)
    assert recover(folder).n_samples == 0
    assert recover(folder).already_closed
    assert read_session(folder)[0] == []


def test_a_folder_that_is_no_session_is_refused(tmp_path, simulate):
    with pytest.raises(UserError, match=r"no manifest\.json"):
        read_session(tmp_path)
    folder = simulate()
    (folder / "manifest.json").write_text("{")
    with pytest.raises(UserError, match="not valid JSON"):
        read_session(folder)
    (folder / "manifest.json").write_text('{"schema": "other/9"}')
    with pytest.raises(UserError, match="other/9"):
        read_session(folder)


def test_a_session_without_its_samples_is_refused(simulate):
    folder = simulate()
    (folder / "samples.arrows").unlink()
    with pytest.raises(UserError, match=r"has no samples\.arrows"):
        read_session(folder)


@pytest.mark.parametrize("key", ["settings", "virtual", "seeds", "created_utc"])
def test_a_manifest_that_lost_a_key_is_named(simulate, key):
    folder = simulate()
    manifest = json.loads((folder / "manifest.json").read_text())
    del manifest[key]
    (folder / "manifest.json").write_text(json.dumps(manifest))
    with pytest.raises(UserError, match=f"{key} is missing or damaged"):
        read_session(folder)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('"label": "1"', '"lable": "1"', "line 2, epoch_started: label is missing"),
        ('"epoch": 1, "label"', '"epoch": "x", "label"', "line 2, epoch_started: epoch is missing"),
        ('"outcome": "success"', '"outcome": 3', "line 3, epoch_ended: outcome is missing"),
        ('"task": "prbs"', '"task": "dance"', "task is 'dance'"),
    ],
)
def test_a_damaged_event_of_version_1_is_named(simulate, old, new, words):
    folder = as_version_1(simulate())
    text = (folder / "events.jsonl").read_text()
    assert old in text
    (folder / "events.jsonl").write_text(text.replace(old, new, 1))
    with pytest.raises(UserError, match=words):
        read_session(folder)


def test_an_event_of_another_kind_is_passed_over(simulate):
    folder = simulate()
    text = (folder / "events.jsonl").read_text()
    (folder / "events.jsonl").write_text('{"note": "the subject yawned"}\n' + text)
    assert len(read_session(folder)[0]) == 1
    assert recover(folder).already_closed


def test_a_stream_of_other_columns_is_refused(simulate):
    folder = simulate()
    table = pa.table({"a": [1.0]})
    with (
        pa.OSFile(str(folder / "samples.arrows"), "wb") as file,
        pa.ipc.new_stream(file, table.schema) as writer,
    ):
        writer.write_table(table)
    with pytest.raises(UserError, match=r"samples\.arrows: holds other columns"):
        read_session(folder)


def test_a_session_that_is_being_recorded_is_left_alone(tmp_path):
    writer = SessionWriter(tmp_path / "s", Settings(), [], {"session": 1}, virtual=True)
    writer.event("session_started", time_s=0.0)
    with pytest.raises(UserError, match="still being recorded"):
        recover(tmp_path / "s")
    writer.close(0.0, "success", "")
    assert recover(tmp_path / "s").already_closed


def test_a_closed_session_that_lost_samples_does_not_pass_for_whole(simulate):
    folder = simulate(epochs=2)
    path = folder / "samples.arrows"
    path.write_bytes(path.read_bytes()[: int(0.3 * path.stat().st_size)])
    (first,), notices = read_session(folder)
    (lost,) = first.left_out
    assert lost.start_s == pytest.approx(first.channels["torque_nm"].time_s[-1], abs=2e-3)
    assert "breaks off at" in lost.reason or "and what follows it" in lost.reason
    assert {notice.level for notice in notices} == {"error"}
    assert f"epoch {first.label}: {lost.start_s:.3f} to " in notices[-2].text + notices[-1].text


def test_an_epoch_that_starts_twice_or_never_is_said(simulate):
    folder = simulate(epochs=2)
    lines = (folder / "events.jsonl").read_text().splitlines(keepends=True)
    (folder / "events.jsonl").write_text("".join([*lines[:2], *lines[1:]]))
    epochs, (notice,) = read_session(folder)
    assert len(epochs) == 2
    assert "epoch 1 starts twice" in notice.text
    (folder / "events.jsonl").write_text("".join([lines[0], *lines[2:]]))
    epochs, (notice,) = read_session(folder)
    assert len(epochs) == 1
    assert "does not say what epoch 1" in notice.text
    assert notice.level == "error"
