"""What a session of `run` shares: packages asked for first, NWB beside the folder at its end."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import pytest
from tests.small_study import record

from rigidimeter.cli.planned_session import require_packages, write_nwb_beside
from rigidimeter.core.errors import UserError
from rigidimeter.core.settings import parse_settings


@pytest.mark.parametrize(("key", "extra"), [("lsl", "lsl"), ("nwb_at_close", "nwb")])
def test_a_missing_package_is_named_before_anything_starts(
    rigidimeter, tmp_path: Path, monkeypatch, key: str, extra: str
) -> None:
    monkeypatch.setattr(importlib.util, "find_spec", lambda _: None)
    with pytest.raises(UserError, match=rf"pip install 'rigidimeter\[{extra}\]'"):
        require_packages(parse_settings({"sharing": {key: True}}))
    settings = tmp_path / "settings.toml"
    settings.write_text(f"[sharing]\n{key} = true\n")
    ran = rigidimeter("run", settings, "--out", tmp_path / "session")
    assert ran.status == 1
    assert f"sharing.{key} = true needs one more package" in ran.err
    assert not (tmp_path / "session").exists()


def test_what_is_not_asked_for_needs_nothing(monkeypatch) -> None:
    monkeypatch.setattr(importlib.util, "find_spec", lambda _: None)
    require_packages(parse_settings({}))


def test_nwb_beside_the_session(tmp_path: Path) -> None:
    pytest.importorskip("pynwb")
    folder = record(tmp_path / "session", "OFF", 1, epochs=1)
    assert write_nwb_beside(folder) == f"the same as NWB in {tmp_path / 'session.nwb'}"
    assert (tmp_path / "session.nwb").stat().st_size > 10_000
    again = write_nwb_beside(folder)
    assert again.startswith(f"error: {tmp_path / 'session.nwb'} was not written")
    assert "exists already" in again
