"""Damage within the files of a session: noticed, named, and no more lost than is damaged."""

import json

import numpy as np
import pyarrow as pa
import pytest
from tests.version_1 import as_version_1

from rigidimeter.core.errors import UserError
from rigidimeter.core.files import (
    FIELD,
    ZEROS,
    checksum_holds,
    json_text,
    text_bytes,
    with_checksum,
)
from rigidimeter.core.session import (
    SAMPLE_SCHEMA,
    TOGETHER,
    SampleLog,
    read_events,
    read_samples,
    read_session,
    sample_dtypes,
    scan_events,
    scan_samples,
    session_settings,
)

BATCH = 100
LZ4 = pa.ipc.IpcWriteOptions(compression="lz4")


def flip(path, bit):
    content = bytearray(path.read_bytes())
    content[bit // 8] ^= 1 << bit % 8
    path.write_bytes(bytes(content))


def stream(path, n_batches=6, session_id="a" * 16, **options):
    log = SampleLog(path, 1000.0, session_id, **options)
    for k in range(n_batches):
        rows = {name: np.arange(BATCH).astype(dtype) for name, dtype in sample_dtypes().items()}
        rows["tick"] = rows["tick"] + k * BATCH
        log.append_columns(rows)
    log.close()
    return scan_samples(path.read_bytes(), path)


def test_a_checksum_covers_every_bit_and_its_context():
    line = with_checksum(b"{" + FIELD + ZEROS.encode() + b'", "event": "a"}', b"context")
    assert checksum_holds(line, b"context")
    assert not checksum_holds(line, b"contexts")
    for bit in range(8 * len(line)):
        damaged = bytearray(line)
        damaged[bit // 8] ^= 1 << bit % 8
        assert not checksum_holds(bytes(damaged), b"context")


def test_any_reader_of_arrow_reads_the_stream(tmp_path):
    stream(tmp_path / "s.arrows")
    table = pa.ipc.open_stream((tmp_path / "s.arrows").read_bytes()).read_all()
    assert table.num_rows == 6 * BATCH
    facts = json.loads(table.schema.metadata[b"rigidimeter"])
    assert facts["session_id"] == "a" * 16


@pytest.mark.parametrize("where", ["marker", "metadata length", "metadata", "body"])
@pytest.mark.parametrize("batch", [0, 2, 5])
def test_a_damaged_batch_is_named_and_the_others_are_read(tmp_path, batch, where):
    path = tmp_path / "s.arrows"
    message = stream(path).stream.batches[batch]
    byte = message.start + {"marker": 1, "metadata length": 6, "metadata": 60, "body": 2000}[where]
    flip(path, 8 * byte + 3)
    found = scan_samples(path.read_bytes(), path)
    ticks = np.arange(6 * BATCH)
    np.testing.assert_array_equal(found.columns["tick"], ticks[ticks // BATCH != batch])
    assert found.columns["angle_rad"].size == 5 * BATCH
    (lost,) = found.lost
    first = batch * BATCH
    words = f"batch {batch} (ticks {first} to {first + BATCH - 1})"
    if batch == 5:
        words = f"batch 5 and what follows it (from tick {first} on)"
    assert str(lost) == words
    assert found.stream.closed


def test_a_damaged_schema_loses_no_sample(tmp_path):
    path = tmp_path / "s.arrows"
    stream(path)
    flip(path, 8 * 100)
    found = scan_samples(path.read_bytes(), path)
    assert found.columns["tick"].size == 6 * BATCH
    assert not found.lost
    assert found.stream.gaps
    assert found.session_ids == ("a" * 16,)


def test_a_batch_that_is_cut_out_is_missed_by_its_number(tmp_path):
    path = tmp_path / "s.arrows"
    message = stream(path).stream.batches[3]
    content = path.read_bytes()
    path.write_bytes(content[: message.start] + content[message.stop :])
    found = scan_samples(path.read_bytes(), path)
    assert [str(lost) for lost in found.lost] == ["batch 3 (ticks 300 to 399)"]


def test_a_zeroed_block_loses_the_batches_it_touches(tmp_path):
    path = tmp_path / "s.arrows"
    message = stream(path).stream.batches[2]
    content = bytearray(path.read_bytes())
    content[message.start - 32 : message.start + 32] = bytes(64)
    path.write_bytes(bytes(content))
    found = scan_samples(path.read_bytes(), path)
    assert [str(lost) for lost in found.lost] == ["batches 1 to 2 (ticks 100 to 299)"]


def damage_at(folder, row):
    """Flip a bit in the batch of a row; return the number of the batch."""
    path = folder / "samples.arrows"
    found = scan_samples(path.read_bytes(), path)
    number = row // BATCH
    batch = next(m for m in found.stream.batches if m.facts["batch"] == number)
    flip(path, 8 * (batch.stop - 500))
    return number


def rows_of(folder, epoch):
    path = folder / "samples.arrows"
    return np.flatnonzero(scan_samples(path.read_bytes(), path).columns["epoch"] == epoch)


def test_an_epoch_that_touches_damage_is_read_without_it(recorded):
    folder = recorded(epochs=3)
    whole, _ = read_session(folder)
    number = damage_at(folder, rows_of(folder, 2)[5000])
    epochs, notices = read_session(folder)
    assert [epoch.closed.kind for epoch in epochs] == ["included"] * 3
    (lost,) = epochs[1].left_out
    first_s = number * BATCH / 1000
    # The sample at the tick before the batch was taken a little earlier than the tick.
    assert (lost.start_s, lost.stop_s) == pytest.approx((first_s - 0.001, first_s + 0.1), abs=2e-3)
    assert lost.lost
    assert f"batch {number} (ticks {number * BATCH} to" in lost.reason
    assert [notice.level for notice in notices] == ["error", "error"]
    assert f"epoch {epochs[1].label}: {lost.start_s:.3f} to {lost.stop_s:.3f} s are left out" in (
        notices[1].text
    )
    for before, after in zip(whole, epochs, strict=True):
        for name, channel in after.channels.items():
            missing = len(before.channels[name]) - len(channel)
            assert missing == (BATCH if after is epochs[1] else 0)
            kept = np.isin(before.channels[name].time_s, channel.time_s)
            np.testing.assert_array_equal(before.channels[name].values[kept], channel.values)
    assert [len(epoch.left_out) for epoch in epochs] == [0, 1, 0]


@pytest.mark.parametrize("at", ["start", "end"])
def test_an_epoch_that_lost_an_end_is_shorter(recorded, at):
    folder = recorded(epochs=2)
    (before, _), _ = read_session(folder)
    rows = rows_of(folder, 1)
    # A batch that belongs to the epoch alone.
    row = rows[0] // BATCH * BATCH if at == "start" else rows[-1]
    damage_at(folder, row)
    (epoch, _), _ = read_session(folder)
    assert epoch.closed.included
    (lost,) = epoch.left_out
    time_s, whole_s = (each.channels["torque_nm"].time_s for each in (epoch, before))
    assert 0 < whole_s.size - time_s.size <= BATCH
    if at == "start":
        assert lost.start_s == pytest.approx(whole_s[0], abs=3e-3)
        assert lost.stop_s == pytest.approx(time_s[0], abs=3e-3)
    else:
        assert lost.start_s == pytest.approx(time_s[-1], abs=3e-3)
        assert lost.stop_s == pytest.approx(whole_s[-1], abs=3e-3)


def test_an_epoch_whose_samples_break_off_says_when(recorded):
    folder = recorded(epochs=1)
    path = folder / "samples.arrows"
    found = scan_samples(path.read_bytes(), path)
    cut = rows_of(folder, 1)[5000] // BATCH
    path.write_bytes(path.read_bytes()[: found.stream.batches[cut].start])
    (epoch,), notices = read_session(folder)
    (lost,) = epoch.left_out
    stop_s = epoch.channels["torque_nm"].time_s[-1]
    assert lost.start_s == pytest.approx(stop_s, abs=2e-3)
    assert lost.reason == f"samples.arrows breaks off at {lost.start_s:.3f} s"
    assert [notice.level for notice in notices] == ["error"]


def test_damage_in_a_rest_excludes_no_epoch(recorded):
    folder = recorded(epochs=2)
    path = folder / "samples.arrows"
    found = scan_samples(path.read_bytes(), path)
    epoch, ends = found.columns["epoch"], np.cumsum([BATCH] * len(found.stream.batches))
    resting = [k for k, end in enumerate(ends) if (epoch[end - BATCH : end] == -1).all()]
    flip(path, 8 * (found.stream.batches[resting[1]].stop - 500))
    epochs, notices = read_session(folder)
    assert [epoch.closed.kind for epoch in epochs] == ["included", "included"]
    assert [notice.level for notice in notices] == ["error"]


def test_a_damaged_line_of_events_is_named_and_the_others_count(recorded):
    folder = recorded(epochs=2)
    events = folder / "events.jsonl"
    text = events.read_text()
    at = text.index("epoch_ended")
    flip(events, 8 * at)
    epochs, notices = read_session(folder)
    assert [epoch.closed.kind for epoch in epochs] == ["excluded", "included"]
    assert "line 3 of events.jsonl is damaged" in epochs[0].closed.reason
    assert "line 3 is damaged" in notices[0].text
    log = scan_events(events.read_bytes(), events)
    assert log.damaged == (3,)
    assert len(log.events) == 7


def test_a_damaged_manifest_is_refused(recorded):
    folder = recorded()
    path = folder / "manifest.json"
    path.write_text(path.read_text().replace('"band_low_hz"', '"band_low_hz" ', 1))
    with pytest.raises(UserError, match=r"manifest\.json: is damaged or was changed"):
        read_session(folder)
    with pytest.raises(UserError, match=r"manifest\.json: is damaged or was changed"):
        session_settings(folder)


@pytest.mark.parametrize("name", ["samples.arrows", "events.jsonl", "manifest.json"])
def test_files_of_two_sessions_are_refused(recorded, name):
    one, two = recorded(name="a"), recorded(name="b", seed=2)
    ids = [json.loads((f / "manifest.json").read_text())["session_id"] for f in (one, two)]
    (one / name).write_bytes((two / name).read_bytes())
    with pytest.raises(UserError, match="put back the files of one session") as refused:
        read_session(one)
    assert all(session_id in str(refused.value) for session_id in ids)


@pytest.mark.parametrize("name", ["samples.arrows", "events.jsonl"])
def test_a_file_without_an_id_is_refused_in_a_session_with_one(recorded, name):
    one, two = recorded(name="a"), as_version_1(recorded(name="b"))
    (one / name).write_bytes((two / name).read_bytes())
    with pytest.raises(UserError, match="a session without an id"):
        read_session(one)


def test_version_1_gives_the_same_numbers(recorded):
    folder = recorded(epochs=2)
    epochs, _ = read_session(folder)
    old, notices = read_session(as_version_1(folder))
    assert not notices
    for before, after in zip(epochs, old, strict=True):
        assert (before.label, before.closed) == (after.label, after.closed)
        for name, channel in before.channels.items():
            np.testing.assert_array_equal(channel.values, after.channels[name].values)


@pytest.mark.parametrize("version", [1, 2])
def test_a_session_with_older_names_of_settings_is_read(recorded, version):
    """A manifest is never rewritten, so what a setting was called then is read for ever."""
    epochs, _ = read_session(recorded(name="now"))
    folder = recorded(name="before")
    path = (as_version_1(folder) if version == 1 else folder) / "manifest.json"
    manifest = json.loads(path.read_text())
    diagnostics = manifest["settings"]["diagnostics"]
    diagnostics["emg_window_s"] = diagnostics.pop("min_burst_s")
    diagnostics["condition_number_most"] = diagnostics.pop("max_condition_number")
    levels = {
        key: level.replace("caution", "doubt") for key, level in diagnostics["levels"].items()
    }
    assert "doubt" in levels.values()
    diagnostics["levels"] = {**levels, "differs_from_estimate": "note"}
    manifest["settings"]["estimation"]["bootstrap_draws"] = 200
    manifest["settings"]["guard"]["least_inertia_kg_m2"] = manifest["settings"]["guard"].pop(
        "min_inertia_kg_m2"
    )
    if version == 1:
        path.write_bytes(text_bytes(json_text(manifest)))
    else:
        path.write_bytes(with_checksum(text_bytes(json_text({**manifest, "checksum": ZEROS}))))
    old, notices = read_session(folder)
    assert not notices
    assert len(old) == len(epochs)
    assert session_settings(folder) == session_settings(folder.with_name("now"))


def test_version_1_passes_over_a_batch_that_cannot_be_decoded(recorded):
    folder = as_version_1(recorded())
    path = folder / "samples.arrows"
    found = scan_samples(path.read_bytes(), path)
    assert not found.stream.checked
    n = found.columns["tick"].size
    content = bytearray(path.read_bytes())
    content[found.stream.batches[7].start : found.stream.batches[7].start + 64] = bytes(64)
    path.write_bytes(bytes(content))
    found = scan_samples(path.read_bytes(), path)
    assert found.columns["tick"].size == n - BATCH
    assert [str(lost) for lost in found.lost] == ["batch 7 (ticks 700 to 799)"]


@pytest.mark.parametrize("checked", [True, False])
@pytest.mark.parametrize("batch", [TOGETHER - 1, TOGETHER, 2 * TOGETHER + 1])
def test_a_damaged_batch_of_a_long_stream_costs_no_other(tmp_path, batch, checked):
    path = tmp_path / "samples.arrows"
    count = 2 * TOGETHER + 3
    whole = stream(path, count)
    if not checked:
        with pa.ipc.new_stream(str(path), SAMPLE_SCHEMA, options=LZ4) as plain:
            plain.write_table(pa.table(whole.columns, SAMPLE_SCHEMA), max_chunksize=BATCH)
        whole = scan_samples(path.read_bytes(), path)
    assert (whole.columns["tick"].size, whole.lost) == (count * BATCH, ())
    message = whole.stream.batches[batch]
    frame = path.read_bytes().index(b"\x04\x22\x4d\x18", message.start)
    assert frame < message.stop
    flip(path, 8 * frame)  # what begins the compressed bytes of a column
    found = scan_samples(path.read_bytes(), path)
    ticks = np.arange(count * BATCH)
    np.testing.assert_array_equal(found.columns["tick"], ticks[ticks // BATCH != batch])
    first = batch * BATCH
    text = f"batch {batch} (ticks {first} to {first + BATCH - 1})"
    assert [str(lost) for lost in found.lost] == [text]


def test_a_stream_that_is_continued_goes_on_counting(tmp_path):
    path = tmp_path / "s.arrows"
    found = stream(path)
    before = path.read_bytes()[: found.stream.stop]
    stream(tmp_path / "t.arrows", 2, before=before, first_batch=found.next_batch)
    again = scan_samples((tmp_path / "t.arrows").read_bytes(), path)
    assert [m.facts["batch"] for m in again.stream.batches] == list(range(8))
    assert not again.lost
    assert read_samples(tmp_path / "t.arrows")["tick"].size == 8 * BATCH


def test_events_are_read_without_what_protects_them(recorded):
    events, torn = read_events(recorded() / "events.jsonl")
    assert not torn
    assert not any({"checksum", "session_id"} & event.keys() for event in events)
