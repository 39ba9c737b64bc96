"""Settings under the names that they had before are read, with one notice, and never written."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest
from tests.docs.markdown import ROOT
from tests.older_names import older

from rigidimeter.core.errors import UserError
from rigidimeter.core.files import toml_text
from rigidimeter.core.settings import (
    RENAMED,
    Settings,
    changed_settings,
    dump_settings,
    load_settings,
    parse_settings,
    settings_from,
    with_new_names,
)

OLD_TOML = """\
[estimation]
longest_delay_s = 0.02

[diagnostics]
r_squared_least = 0.6
gravity_nm = 1.5
"""
NAMES = (
    "estimation.longest_delay_s is now estimation.max_delay_s, "
    "diagnostics.r_squared_least is now diagnostics.min_r_squared; the older names were read"
)


@pytest.fixture
def old_toml(tmp_path: Path) -> Path:
    path = tmp_path / "old.toml"
    path.write_text(OLD_TOML)
    return path


def test_a_file_with_older_names_is_read_with_one_warning_that_names_the_keys(
    old_toml: Path,
) -> None:
    for read in (load_settings, settings_from):
        with pytest.warns(UserWarning, match=re.escape(f"{old_toml}: {NAMES}")) as warned:
            settings = read(old_toml)
        assert len(warned) == 1
        assert settings.estimation.max_delay_s == 0.02
        assert settings.diagnostics.min_r_squared == 0.6
        assert settings.diagnostics.gravity_nm == 1.5


def test_the_command_line_warns_in_one_line(old_toml: Path) -> None:
    old_toml.write_text(OLD_TOML.replace("0.6", "60.0"))
    command = ["simulate", "--out", old_toml.parent / "s", "--settings", old_toml]
    ran = subprocess.run(
        [sys.executable, "-m", "rigidimeter", *command], capture_output=True, text=True, check=False
    )
    assert ran.returncode == 1
    assert ran.stderr.splitlines() == [
        f"warning: {old_toml}: {NAMES}",
        f"rigidimeter: {old_toml}: diagnostics.min_r_squared = 60.0: Input should be less than or "
        "equal to 1",
    ]


def test_every_older_name_is_read_and_none_is_written() -> None:
    settings = Settings()
    with pytest.warns(UserWarning, match=r"^settings: .*, and \d+ more; the older names"):
        assert parse_settings(older(dump_settings(settings))) == settings
    text = toml_text(dump_settings(settings))
    for names in RENAMED.values():
        for name in names:
            assert not re.search(rf"\b{name}\b", text)


def test_the_older_level_is_read_with_one_notice() -> None:
    levels = {"tremor": "doubt", "coherence": "doubt", "frozen": "note"}
    notice = 'mine: "doubt" in diagnostics.levels is now "caution"; the older name was read'
    with pytest.warns(UserWarning, match=re.escape(notice)) as warned:
        settings = parse_settings({"diagnostics": {"levels": levels}}, source="mine")
    assert len(warned) == 1
    read = settings.diagnostics.levels
    assert [read.of(name) for name in levels] == ["caution", "caution", "note"]
    with pytest.raises(UserError, match="tremor"):
        parse_settings({"diagnostics": {"levels": {"tremor": "grave"}}})


def test_a_change_by_its_older_name_takes_the_place_of_the_new_one() -> None:
    base = parse_settings({"diagnostics": {"min_coherence": 0.4}})
    with pytest.warns(UserWarning, match=r"^form: diagnostics.coherence_least is now"):
        settings = changed_settings(base, {"diagnostics": {"coherence_least": 0.3}}, "form")
    assert settings.diagnostics.min_coherence == 0.3


def test_a_key_under_both_names_is_refused() -> None:
    both = {"estimation": {"max_delay_s": 0.02, "longest_delay_s": 0.03}}
    with pytest.raises(UserError) as refused:
        parse_settings(both, source="old.toml")
    assert str(refused.value) == (
        "old.toml: estimation.longest_delay_s is the older name of estimation.max_delay_s, and "
        "both are given; leave out longest_delay_s"
    )


def test_without_an_older_name_nothing_is_changed() -> None:
    values = {"seed": 3, "estimation": {"max_delay_s": 0.02}, "diagnostics": 4}
    assert with_new_names(values, "x") == (values, "")


def test_a_misspelt_older_name_is_answered_with_the_new_one() -> None:
    with pytest.raises(UserError, match=r"the nearest is diagnostics\.min_r_squared "):
        parse_settings({"diagnostics": {"r_squared_lest": 0.2}})


def test_the_documents_list_the_names() -> None:
    page = (ROOT / "docs" / "development" / "removed.md").read_text("utf-8")
    listed = re.findall(r"^\| `(\w+)\.(\w+)` \| `(\w+)` \|$", page, re.M)
    assert listed == [
        (table, old, new) for table, names in RENAMED.items() for old, new in names.items()
    ]
