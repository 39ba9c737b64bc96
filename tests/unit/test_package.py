"""Version, authors and addresses stand in one place; the other files agree with it."""

import re
import sys
import tomllib
from pathlib import Path

import pytest
import yaml
from tests import core_install, matrix
from tests.docs.licences import needed_by, plain
from tests.packages import extras

from rigidimeter import __version__

ROOT = Path(__file__).resolve().parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
CITATION = yaml.safe_load((ROOT / "CITATION.cff").read_text("utf-8"))
AUTHORS = [author["name"] for author in CITATION["authors"]]


def test_the_version_stands_once_in_the_source() -> None:
    assert "version" in PROJECT["dynamic"]
    sources = (ROOT / "src").rglob("*.py")
    holding = [path.name for path in sources if f'"{__version__}"' in path.read_text("utf-8")]
    assert holding == ["version.py"]


def test_citation_and_changelog_have_the_version() -> None:
    assert CITATION["version"] == __version__
    changelog = (ROOT / "CHANGELOG.md").read_text("utf-8")
    first = re.search(r"^## \[(.+?)\](?:: (\S+))?", changelog, re.M)
    assert first is not None
    assert __version__ in first.groups()


def test_the_citation_invents_nothing() -> None:
    assert CITATION["title"] == PROJECT["name"]
    assert CITATION["message"]
    assert "doi" not in CITATION
    assert "identifiers" not in CITATION


def test_the_licence_is_that_of_the_package() -> None:
    assert (ROOT / "LICENSE").read_text("utf-8").startswith("BSD 3-Clause License")
    assert CITATION["license"] == PROJECT["license"].split()[0]


def test_every_dependency_has_its_licence_listed_and_copyleft_is_in_extras_alone() -> None:
    page = ROOT / "docs" / "reference" / "licences.md"
    direct = page.read_text("utf-8").partition("These need, in turn")[0]
    rows = re.findall(r"^\| ([\w.-]+) \| [\d.]+ \| (.+) \| ([\w, ]+) \|$", direct, re.M)
    assert {plain(name): groups.split(", ") for name, _, groups in rows} == needed_by()
    copyleft = {groups for _, licence, groups in rows if "copyleft" in licence}
    assert copyleft == {"canopen", "tdms"}
    assert not [name for name, licence, _ in rows if "not stated" in licence]


def test_the_page_of_the_installation_has_every_extra() -> None:
    text = (ROOT / "docs" / "how-to" / "install.md").read_text("utf-8")
    table = text.partition("| extra |")[2].partition("\n\n")[0]
    first = "".join(re.findall(r"^\| (`[^|]*) \|", table, re.M))
    assert sorted(re.findall(r"`(\w+)`", first)) == sorted(extras().keys() - {"core"})


def test_the_authors_are_those_of_the_citation() -> None:
    assert [author["name"] for author in PROJECT["authors"]] == AUTHORS
    assert AUTHORS[0] in (ROOT / "LICENSE").read_text("utf-8")
    assert f'"{AUTHORS[0]}"' in (ROOT / "docs" / "conf.py").read_text("utf-8")


def test_the_hosting_address_is_that_of_the_citation() -> None:
    """While it has none, no other file names one."""
    address = CITATION.get("repository-code")
    assert set(PROJECT.get("urls", {}).values()) <= {address}
    for name in ("README.md", "docs/conf.py"):
        named = re.findall(
            r"https?://(?:github|gitlab)[^\s)\"]*rigidimeter\S*", (ROOT / name).read_text("utf-8")
        )
        assert set(named) <= {address}


def test_a_command_that_hangs_has_failed_and_one_that_lasts_has_not(monkeypatch) -> None:
    monkeypatch.setattr(core_install, "LIMIT_S", 0.5)
    lasts = "import time; time.sleep(60)"
    deaf = f"import signal; signal.signal(signal.SIGINT, signal.SIG_IGN); {lasts}"
    asked = core_install.run(Path(sys.executable), ["-c", lasts], ROOT, 0.5)
    killed = core_install.run(Path(sys.executable), ["-c", deaf], ROOT, 2.0)
    assert asked.interrupted
    assert asked.failed
    assert killed.failed
    assert not core_install.Ran(["run"], 130, "", "", interrupted=True).failed
    assert core_install.Ran(["run"], -9, "", "", interrupted=True).failed


@pytest.mark.parametrize("options", [[], ["--oldest"]])
def test_a_matrix_without_the_oldest_python_has_failed(monkeypatch, capsys, options) -> None:
    monkeypatch.setattr(matrix, "interpreter", lambda _: None)
    monkeypatch.setattr(sys, "argv", ["matrix", *options])
    assert matrix.main() == 1
    assert "is not on this computer: skipped" in capsys.readouterr().out
