"""The file that keeps the token of the page: who can read it, and what is refused."""

import os
import stat

import pytest

from rigidimeter.core.errors import UserError
from rigidimeter.rig.console.page import new_token, require_token, token_in


def test_a_file_that_is_not_there_is_made_for_its_owner_alone(tmp_path):
    path, before = tmp_path / "token", os.umask(0)
    try:
        token = token_in(path)
    finally:
        os.umask(before)
    assert stat.S_IMODE(path.stat().st_mode) == 0o600
    assert path.read_text() == f"{token}\n"
    assert token_in(path) == token  # the next start has the same link
    require_token(token, "0.0.0.0")


def test_each_token_is_another():
    assert len({new_token() for _ in range(100)}) == 100


@pytest.mark.parametrize("mode", [0o640, 0o604, 0o620, 0o602, 0o644])
def test_a_file_that_others_can_read_or_change_is_refused(tmp_path, mode):
    path = tmp_path / "token"
    token_in(path)
    path.chmod(mode)
    with pytest.raises(UserError, match=rf"token: others can .* \(mode {mode:04o}\); delete"):
        token_in(path)


@pytest.mark.parametrize("text", ["", "short", "two words of a token", "x" * 999, "ä" * 20])
def test_a_file_without_a_token_is_refused_by_name(tmp_path, text):
    path = tmp_path / "token"
    path.write_text(text)
    path.chmod(0o600)
    with pytest.raises(UserError, match=r"token: the token has .* 16 or more"):
        token_in(path)


def test_what_is_no_file_is_refused_by_name(tmp_path):
    os.mkfifo(tmp_path / "pipe", 0o600)
    (tmp_path / "folder").mkdir()
    for name, why in (
        ("pipe", "16 or more"),
        ("folder", "cannot be read"),
        ("nowhere/token", "cannot be written there"),
    ):
        with pytest.raises(UserError, match=f"{name}: .*({why})"):
            token_in(tmp_path / name)


@pytest.mark.parametrize("host", ["0.0.0.0", "::", "192.168.0.7", "lab"])
def test_no_token_is_for_the_loopback_alone(host):
    for own in ("127.0.0.1", "::1", "localhost"):
        require_token("", own)
    with pytest.raises(UserError, match=f"--no-token: whoever reaches {host} "):
        require_token("", host)
