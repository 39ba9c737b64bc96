"""The page of the checks lists what the code checks, with the keys and levels of the settings."""

from __future__ import annotations

import re
from pathlib import Path

from rigidimeter.analysis.estimation.diagnostics import CHECKS
from rigidimeter.core.settings import DiagnosticLevels, DiagnosticsSettings

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "reference" / "diagnostics.md"


def _rows() -> list[list[str]]:
    lines = re.findall(r"^\| `\w+` \|.*\|$", PAGE.read_text("utf-8"), re.M)
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]


def test_every_check_has_its_row_and_no_other_has() -> None:
    names = [row[0].strip("`") for row in _rows()]
    assert sorted(names) == sorted(DiagnosticLevels.model_fields)
    assert len(names) == len(set(names))
    # Some are found where epochs are fitted; `between_samples` there and by a check.
    of_fits = ["lack_of_fit", "band_sensitivity", "varying_between_epochs", "torque_delay"]
    assert sorted(names) == sorted([*(check.name for check in CHECKS), *of_fits])


def test_the_levels_are_the_defaults() -> None:
    levels = DiagnosticLevels()
    for name, _, _, level, remedy in _rows():
        assert level == getattr(levels, name.strip("`")), name
        assert remedy, name


def test_every_key_exists_and_every_setting_is_mentioned() -> None:
    known = set(DiagnosticsSettings.model_fields) - {"levels"}
    mentioned: set[str] = set()
    for name, looked_at, key, _, _ in _rows():
        assert key == "–" or key.strip("`") in known, name
        mentioned |= set(re.findall(r"`(\w+)`", looked_at + key))
    assert mentioned == known
