"""What a page may say."""

import json

import pytest

from rigidimeter.rig.acquisition import Command
from rigidimeter.rig.acquisition.processes import NOTE_BYTES
from rigidimeter.rig.console.page import LONGEST_TEXT, RefusedMessage, parse_message

RATING = {"kind": "note", "what": "rating", "by": "E1", "epoch": 3, "score": 1.5}


def test_orders_are_those_of_the_buttons():
    said = parse_message('{"kind": "order", "command": "pause_now"}')
    assert said.command is Command.PAUSE_NOW
    for command in ("halt", "start", "reset", "change", "note", "", 1, None):
        with pytest.raises(RefusedMessage):
            parse_message(json.dumps({"kind": "order", "command": command}))


def test_a_rating_has_examiner_epoch_and_score():
    note = parse_message(json.dumps(RATING)).note
    assert note == {"what": "rating", "text": "", "by": "E1", "epoch": 3, "score": 1.5}


@pytest.mark.parametrize(
    "change",
    [
        {"by": ""},
        {"epoch": -1},
        {"epoch": True},
        {"epoch": "3"},
        {"score": "1.5"},
        {"score": None},
        {"score": 1e9},
        {"what": "event"},
        {"by": "x" * 41},
        {"text": "two\nlines"},
        {"text": "\x1b[2J"},
        {"text": "x" * (LONGEST_TEXT + 1)},
        {"text": "\N{PILE OF POO}" * LONGEST_TEXT},
    ],
)
def test_a_note_of_another_form_is_refused(change):
    with pytest.raises(RefusedMessage):
        parse_message(json.dumps(RATING | change))


def test_scores_that_are_no_number_are_refused():
    for score in ("NaN", "Infinity", "-Infinity", "9" * 400, "1e999"):
        with pytest.raises(RefusedMessage):
            parse_message(json.dumps(RATING).replace("1.5", score))


def test_the_longest_note_fits_into_the_memory_for_it():
    text = "ä" * LONGEST_TEXT
    note = parse_message(json.dumps({"kind": "note", "what": "note", "text": text})).note
    assert len(json.dumps(note, ensure_ascii=False).encode()) <= NOTE_BYTES


@pytest.mark.parametrize(
    "text",
    [
        "",
        "[]",
        "1",
        "null",
        '{"kind": "start"}',
        '{"kind": ["beat"]}',
        '{"kind": "hello", "page": 1}',
        "[" * 4000,
        '{"kind": "beat", "x": "' + "y" * 4096 + '"}',
        "\udc80",
    ],
)
def test_anything_else_is_refused(text):
    with pytest.raises(RefusedMessage):
        parse_message(text)


def test_another_folder_is_named_by_its_whole_path():
    said = parse_message('{"kind": "save", "folder": " /media/disk/s "}')
    assert (said.kind, said.folder) == ("save", "/media/disk/s")
    for folder in ("s", "../s", "", "/a\nb", "/" + "x" * 300, 1):
        with pytest.raises(RefusedMessage):
            parse_message(json.dumps({"kind": "save", "folder": folder}))
