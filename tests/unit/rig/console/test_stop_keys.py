"""SPACE and e at the terminal from which the page was started, on a pseudo-terminal."""

import os
import pty
import select
import subprocess
import sys
import termios

import pytest

from rigidimeter.rig.console import BELL, KEYS_HERE, NO_KEYS, StopKeys, stop_keys


class Person:
    """Who sits at the other end of the terminal."""

    def __init__(self) -> None:
        self.far, self.near = pty.openpty()
        self.keyboard = open(self.near, closefd=False)  # noqa: SIM115

    def press(self, keys: bytes) -> None:
        os.write(self.far, keys)
        assert select.select([self.near], [], [], 10.0)[0]

    def sees(self) -> bytes:
        seen = b""
        while select.select([self.far], [], [], 0.05)[0]:
            seen += os.read(self.far, 1 << 20)
        return seen


@pytest.fixture
def person():
    person = Person()
    yield person
    person.keyboard.close()
    os.close(person.near)
    if person.far >= 0:
        os.close(person.far)


@pytest.mark.parametrize("keys", [b" ", b"e", b"E", b"xxe", b"\x1b[A ", b"stop please"])
def test_space_or_e_stops(person, keys):
    with stop_keys(person.keyboard) as stop:
        assert stop.help == KEYS_HERE
        assert not stop.pressed()
        person.press(keys)
        assert stop.pressed()
        assert not stop.pressed()  # once


@pytest.mark.parametrize(("keys", "said"), [(b"p", True), (b"\n", True), (b"\x1b[A\x1bOP", False)])
def test_other_keys_do_nothing_and_are_told_so(person, keys, said):
    with stop_keys(person.keyboard) as stop:
        person.press(keys)
        assert not stop.pressed()
        assert (KEYS_HERE.encode() in person.sees()) == said


def fails(person):
    with stop_keys(person.keyboard) as stop:
        during = termios.tcgetattr(person.near)
        assert not during[3] & (termios.ICANON | termios.ECHO)
        assert during[3] & termios.ISIG  # Ctrl-C stays a signal
        stop.ring()
        assert BELL.encode() in person.sees()
        raise RuntimeError


def test_the_terminal_is_given_back_whatever_happens(person):
    before = termios.tcgetattr(person.near)
    with pytest.raises(RuntimeError):
        fails(person)
    assert termios.tcgetattr(person.near) == before


def test_a_keyboard_that_is_gone_is_told_once_and_stops_nothing(person):
    with stop_keys(person.keyboard) as stop:
        os.close(person.far)
        person.far = -1
        assert not stop.pressed()
        assert stop.help == NO_KEYS
        assert not stop.pressed()


def test_without_a_terminal_it_is_said_that_no_key_works(tmp_path):
    with (tmp_path / "input").open("w+") as file, stop_keys(file) as stop:
        assert (stop.help, stop.pressed()) == (NO_KEYS, False)
    with stop_keys(None) as stop:
        assert (stop.help, stop.pressed()) == (NO_KEYS, False)
    StopKeys(None).ring()


def test_keys_of_another_program_are_left_to_it(person, monkeypatch):
    with stop_keys(person.keyboard) as stop:
        person.press(b"e")
        monkeypatch.setattr(os, "tcgetpgrp", lambda _: os.getpgrp() + 1)  # Ctrl-Z, then bg
        assert not stop.pressed()
        monkeypatch.setattr(os, "tcgetpgrp", lambda _: os.getpgrp())  # fg
        assert stop.pressed()
    monkeypatch.setattr(os, "tcgetpgrp", lambda _: os.getpgrp() + 1)
    with stop_keys(person.keyboard) as stop:
        assert stop.help == NO_KEYS


BEHIND = """
import os, pty, sys, time
from rigidimeter.rig.console import NO_KEYS, stop_keys
with stop_keys(sys.stdin) as stop:
    print(stop.help == NO_KEYS, stop.pressed(), flush=True)
"""


def test_a_program_in_the_background_takes_no_keys_from_the_shell():
    """It would be halted by the system, with the page and all, as it reads or sets the terminal."""
    pid, far = pty.fork()
    if pid == 0:  # the leader of a session of its own, as a shell with job control
        ran = subprocess.run(
            [sys.executable, "-c", BEHIND],
            stdout=subprocess.PIPE,
            process_group=0,
            timeout=60,
            check=False,
        )
        os._exit(0 if ran.stdout.split() == [b"True", b"False"] else 1)
    try:
        assert os.waitpid(pid, 0)[1] == 0
    finally:
        os.close(far)
