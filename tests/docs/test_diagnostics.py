"""The page of the checks lists what the code checks, with the keys and levels of the settings."""

from __future__ import annotations

import re
from pathlib import Path

from tests.docs.generated import REFERENCE

from rigidimeter.analysis import estimation
from rigidimeter.core import records
from rigidimeter.core.findings import KINDS, STUDY_KINDS
from rigidimeter.core.settings import DiagnosticLevels, DiagnosticsSettings

PAGE = REFERENCE / "diagnostics.md"


def _rows() -> list[list[str]]:
    lines = re.findall(r"^\| `\w+` \|.*\|$", PAGE.read_text("utf-8"), re.M)
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]


def test_every_check_has_its_row_and_no_other_has() -> None:
    names = [row[0].strip("`") for row in _rows()]
    assert len(names) == len(set(names))
    names = [name for name in names if KINDS[name] not in STUDY_KINDS]
    assert sorted(names) == sorted(DiagnosticLevels.model_fields)
    folders = [Path(one.__file__).parent for one in (estimation, records)]
    code = "".join(path.read_text("utf-8") for one in folders for path in one.rglob("*.py"))
    assert [name for name in names if f'"{name}"' not in code] == []  # each may be found


def test_every_key_exists_and_every_setting_is_mentioned() -> None:
    known = set(DiagnosticsSettings.model_fields) - {"levels"}
    mentioned: set[str] = set()
    for kind in KINDS.values():
        assert kind.setting in {"", *known}, kind.name
        mentioned |= {kind.setting, *re.findall(r"`(\w+)`", kind.checks)} - {""}
    assert mentioned == known
