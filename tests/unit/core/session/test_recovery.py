"""What `recover` refuses, and what it keeps; that it closes a session is in test_session_folder."""

import os

import pytest
from tests.version_1 import as_version_1

from rigidimeter.core.errors import UserError
from rigidimeter.core.session import (
    SessionWriter,
    read_events,
    read_samples,
    read_session,
    recover,
    scan_samples,
)
from rigidimeter.core.settings import Settings


def contents(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def interrupt(folder, cut_bytes=200):
    """Leave a session as a kill would: without ends, the last batch incomplete."""
    samples, events = folder / "samples.arrows", folder / "events.jsonl"
    samples.write_bytes(samples.read_bytes()[: -8 - cut_bytes])
    lines = events.read_bytes().splitlines(keepends=True)
    events.write_bytes(b"".join(lines[:2]) + lines[2][:20])


def zero(path, byte, count=64):
    content = bytearray(path.read_bytes())
    content[byte : byte + count] = bytes(count)
    path.write_bytes(bytes(content))


@pytest.mark.parametrize("force", [False, True])
def test_a_closed_session_with_damage_within_keeps_every_byte(recorded, force):
    folder = recorded()
    path = folder / "samples.arrows"
    found = scan_samples(path.read_bytes(), path)
    zero(path, found.stream.batches[70].start)
    before = contents(folder)
    recovered = recover(folder, force=force)
    assert recovered.already_closed
    assert recovered.damaged == ("samples.arrows: batch 70 (ticks 7000 to 7099)",)
    assert recovered.n_samples == found.columns["tick"].size - 100
    assert contents(folder) == before


@pytest.mark.parametrize("version", [1, 2])
def test_no_whole_sample_of_an_interrupted_session_is_moved(recorded, version):
    folder = recorded()
    if version == 1:
        as_version_1(folder)
    interrupt(folder)
    path = folder / "samples.arrows"
    found = scan_samples(path.read_bytes(), path)
    torn = path.read_bytes()[found.stream.stop :]
    zero(path, found.stream.batches[70].start)
    ticks = read_samples(path)["tick"].tolist()
    recovered = recover(folder)
    assert read_samples(path)["tick"].tolist() == ticks
    assert (folder / "samples.torn").read_bytes() == torn
    assert recovered.torn_bytes == len(torn) > 0
    assert recovered.torn_files == ("samples.torn", "events.torn")
    events, _ = read_events(folder / "events.jsonl")
    assert [event["event"] for event in events][-3:] == [
        "bytes_moved",
        "epoch_ended",
        "session_ended",
    ]
    assert recover(folder).already_closed
    assert read_session(folder)[0][0].closed.kind == "excluded"


def test_a_closed_session_that_is_cut_is_only_touched_with_force(recorded):
    folder = recorded()
    path = folder / "samples.arrows"
    path.write_bytes(path.read_bytes()[:-1000])
    before = contents(folder)
    with pytest.raises(
        UserError, match=r"is closed \(success\), but samples\.arrows is damaged or"
    ):
        recover(folder)
    assert contents(folder) == before
    recover(folder, "a cut", force=True)
    events, _ = read_events(folder / "events.jsonl")
    assert [event["event"] for event in events[-2:]] == ["session_ended", "bytes_moved"]
    assert sum(event["event"] == "session_ended" for event in events) == 1
    assert recover(folder).already_closed


def test_a_damaged_end_of_the_session_is_not_taken_for_none(recorded):
    folder = recorded()
    events = folder / "events.jsonl"
    content = bytearray(events.read_bytes())
    content[-20] ^= 1
    events.write_bytes(bytes(content))
    before = contents(folder)
    with pytest.raises(UserError, match=r"line 5 of events\.jsonl is damaged and may say how"):
        recover(folder)
    assert contents(folder) == before
    assert not recover(folder, force=True).already_closed
    assert recover(folder).already_closed


def test_nothing_is_overwritten(recorded):
    folder = recorded()
    interrupt(folder)
    (folder / "samples.torn").write_bytes(b"kept from before")
    (folder / "samples-2.torn").symlink_to(folder.parent / "elsewhere")
    assert recover(folder).torn_files == ("samples-3.torn", "events.torn")
    assert (folder / "samples.torn").read_bytes() == b"kept from before"
    assert not (folder.parent / "elsewhere").exists()


@pytest.mark.parametrize("name", ["manifest.json", "samples.arrows", "events.jsonl"])
@pytest.mark.parametrize("inside", [True, False])
def test_a_link_within_the_folder_is_refused(recorded, name, inside):
    folder = recorded()
    interrupt(folder)
    target = (folder if inside else folder.parent) / "target"
    (folder / name).rename(target)
    (folder / name).symlink_to(target)
    before = contents(folder), target.read_bytes()
    with pytest.raises(UserError, match=f"{name}: is a link"):
        recover(folder)
    assert (contents(folder), target.read_bytes()) == before


def test_a_link_to_the_folder_is_refused_with_where_it_leads(recorded):
    folder = recorded()
    interrupt(folder)
    link = folder.parent / "link"
    link.symlink_to(folder)
    before = contents(folder)
    with pytest.raises(UserError, match=f"is a link to {os.path.realpath(folder)}"):
        recover(link)
    assert contents(folder) == before


def test_a_pipe_in_place_of_a_file_is_refused(recorded):
    folder = recorded()
    (folder / "events.jsonl").unlink()
    os.mkfifo(folder / "events.jsonl")
    with pytest.raises(UserError, match="is not a regular file"):
        recover(folder)


def test_files_of_two_sessions_are_not_closed(recorded):
    one, two = recorded(name="a"), recorded(name="b", seed=2)
    interrupt(one)
    (one / "samples.arrows").write_bytes((two / "samples.arrows").read_bytes())
    before = contents(one)
    with pytest.raises(UserError, match="put back the files of one session"):
        recover(one, force=True)
    assert contents(one) == before


def test_a_session_that_is_recorded_is_left_alone_even_with_force(tmp_path):
    writer = SessionWriter(tmp_path / "s", Settings(), [], {"session": 1}, virtual=True)
    before = contents(tmp_path / "s")
    with pytest.raises(UserError, match="still being recorded"):
        recover(tmp_path / "s", force=True)
    assert contents(tmp_path / "s") == before
    writer.close(0.0, "success", "")
