"""Options that take a number: what is none is answered with what to write."""

import pytest
from typer.main import get_command

from rigidimeter.cli.main import app


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (("--epoch-length-s", "20s"), "20s: is not a number of seconds; write 20"),
        (("--epoch-length-s", "2,5"), "2,5: is not a number of seconds; write 2.5"),
        (("--epoch-length-s", "long"), "long: is not a number of seconds, such as 10"),
        (("--epoch-length-s", "nan"), "nan: is not a number of seconds, such as 10"),
        (("--rate-hz", "1kHz"), "1kHz: is not a number of Hz, such as 10"),
        (("--band-hz", "1", "2,5"), "2,5: is not a number of Hz; write 2.5"),
        (("--skip-rows", "1,5"), "1,5: is not a whole number, such as 10"),
        (("--skip-rows", "-1"), "-1: must be at least 0"),
    ],
)
def test_what_is_no_number_is_answered_with_one(rigidimeter, words, sentence):
    ran = rigidimeter("estimate", "joint.csv", *words)
    assert (ran.status, ran.err) == (1, f"rigidimeter: {words[0]} {sentence}\n")


def test_a_share_is_written_as_a_number(rigidimeter):
    ran = rigidimeter("design", "--power", "80%")
    assert ran.err == "rigidimeter: --power 80%: is not a number; write 0.8\n"
    assert rigidimeter("demo", "--days", "200").err.endswith("--days 200: must be at most 100\n")


def _numeric(command, before=()):
    for name, each in getattr(command, "commands", {}).items():
        yield from _numeric(each, (*before, name))
    for option in command.params:
        metavar = str(option.metavar or "").split()
        kind = type(option.default[0] if isinstance(option.default, tuple) else option.default)
        if option.opts[0].startswith("--") and kind in (int, float):
            yield (*before, option.opts[0], *["x"] * max(len(metavar), 1))


def test_every_option_with_a_number_for_a_default_is_read_so(rigidimeter):
    found = list(_numeric(get_command(app)))
    assert len(found) > 20
    for words in found:
        ran = rigidimeter(*words)
        assert ran.status == 1, words
        assert "x: is not a " in ran.err, words
