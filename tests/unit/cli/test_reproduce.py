"""`rigidimeter reproduce` on rows that need no simulation."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner

from rigidimeter.cli.reproduce import reproduce
from rigidimeter.core.errors import UserError

app = typer.Typer()
app.command()(reproduce)


def run(*arguments: object) -> str:
    result = CliRunner().invoke(app, [str(a) for a in arguments], catch_exceptions=False)
    assert result.exit_code == 0, result.output
    return result.output


def test_some_rows_in_the_order_of_the_page(tmp_path: Path) -> None:
    out = tmp_path / "paper"
    said = run("--out", out, "--only", "p-work,eq-8", "--only", "eq-8-largest").splitlines()
    assert said[0] == "1 agrees; 2 differs; 0 cannot be computed from what was published"
    assert [line.split() for line in said[2:5]] == [
        ["eq-8", "agrees"],
        ["eq-8-largest", "differs"],
        ["p-work", "differs"],
    ]
    assert said[5] == str(out / "paper.html")
    ledger = json.loads((out / "ledger.json").read_text(encoding="utf-8"))
    assert [row["id"] for row in ledger] == ["eq-8", "eq-8-largest", "p-work"]


def test_an_unknown_row_is_refused_before_any_work(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="--only fig-9: there is no such row"):
        run("--out", tmp_path / "paper", "--only", "fig-9")
    assert not (tmp_path / "paper").exists()


def test_a_file_is_no_folder(tmp_path: Path) -> None:
    (tmp_path / "paper").write_text("")
    with pytest.raises(UserError, match="is a file; name a folder"):
        run("--out", tmp_path / "paper", "--only", "eq-8")
