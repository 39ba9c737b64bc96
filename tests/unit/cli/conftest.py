from __future__ import annotations

import sys
from collections.abc import Callable
from typing import NamedTuple

import pytest

from rigidimeter.cli.main import main


class Ran(NamedTuple):
    status: int
    out: str
    err: str


@pytest.fixture
def rigidimeter(monkeypatch, capsys) -> Callable[..., Ran]:
    """Run a command line in this process and return its status and what it printed."""

    def run(*arguments: object) -> Ran:
        monkeypatch.setattr(sys, "argv", ["rigidimeter", *map(str, arguments)])
        capsys.readouterr()
        try:
            main()
            status = 0
        except SystemExit as stop:
            status = stop.code if isinstance(stop.code, int) else 0
        return Ran(status, *capsys.readouterr())

    return run
