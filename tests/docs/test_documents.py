"""The documents say what the program does: commands, options, settings and links."""

from __future__ import annotations

import re
import shlex
import tomllib
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest
from tests.docs.markdown import ALL_BLOCKS, DOCUMENTS, ROOT, Block, blocks, table
from typer.testing import CliRunner

from rigidimeter import __version__
from rigidimeter.analysis.reading.channels.choice import LABELS
from rigidimeter.analysis.reading.channels.mapping_file import MAPPING_SCHEMA, read_mapping
from rigidimeter.cli.main import app
from rigidimeter.core.errors import UserError
from rigidimeter.core.records import CHANNEL_UNITS, EMG_CHANNELS
from rigidimeter.core.settings import load_settings, parse_settings
from rigidimeter.core.study_files import read_plan, read_study_toml

RUN = CliRunner()
STUDIES = sorted((ROOT / "examples" / "studies").iterdir())
EXAMPLES = [
    *sorted((ROOT / "examples" / "settings").glob("*.toml")),
    *(path for study in STUDIES for path in sorted((study / "protocols").glob("*.toml"))),
]


def commands(blocks: list[Block]) -> Iterator[tuple[str, list[str]]]:
    """Yield where each shell command stands, and its words."""
    for block in blocks:
        if block.info == "sh":
            for line in block.text.replace("\\\n", " ").splitlines():
                if line.strip():
                    yield block.where, shlex.split(line, comments=True)


@cache
def help_of(*command: str) -> str:
    result = RUN.invoke(app, [*command, "--help-all"])
    assert result.exit_code == 0, result.output
    return result.output


def below(*command: str) -> list[str]:
    """Return the names of the commands below a group; of a command, none."""
    return re.findall(r"^  ([a-z]+)  ", help_of(*command), re.M)


def command_of(words: list[str]) -> tuple[str, ...]:
    """Return those of the words that name a command: `study new` of `study new FOLDER`."""
    command: tuple[str, ...] = ()
    for word in words:
        if word not in below(*command):
            break
        command = (*command, word)
    return command


SHELL = list(commands(ALL_BLOCKS))


def test_the_documents_are_there() -> None:
    for name in ("README.md", "VISION.md", "CHANGELOG.md", "docs/index.md"):
        assert ROOT / name in DOCUMENTS
    assert len([words for _, words in SHELL if words[0] == "rigidimeter"]) > 10


def test_the_entry_of_the_first_release_is_short() -> None:
    """What was unlike before nobody has; a merge that brings its lines back fails here too."""
    entry = re.split(r"^## \[", (ROOT / "CHANGELOG.md").read_text("utf-8"), flags=re.M)[-1]
    assert entry.startswith(("Unreleased]: 0.1.0", "0.1.0]"))
    assert 200 < len(entry.split()) < 500


@pytest.mark.parametrize(("where", "words"), SHELL, ids=[shlex.join(words) for _, words in SHELL])
def test_a_command_line_is_one_that_exists(where: str, words: list[str]) -> None:
    if words[0] == "make":
        assert re.search(rf"^{words[1]}:", (ROOT / "Makefile").read_text("utf-8"), re.M), where
    elif words[:3] == ["python3", "-m", "pip"]:
        wheel = f"rigidimeter-{__version__}-py3"
        assert words[3] in ("wheel", "uninstall") or wheel in words[-1], where
    elif words[:3] == ["python3", "-m", "venv"] or words[0] == ".":
        pass
    elif words[:2] == ["python", "-m"]:
        module = ROOT / words[2].replace(".", "/")
        assert module.with_suffix(".py").is_file() or (module / "__main__.py").is_file(), where
    elif words[0] == "python":
        assert (ROOT / words[1]).is_file(), where
    elif words == ["rigidimeter", "--version"]:
        assert "--version" in help_of()
    elif words[0] == "rigidimeter":
        if words[1] == "--load":  # an option of every command
            assert "--load" in help_of()
            words = [words[0], *words[3:]]
        command = command_of(words[1:])
        shown = help_of(*command)
        assert not below(*command), where
        for word in words[1 + len(command) :]:
            if word.startswith("-"):
                assert re.search(rf"(?<![\w-]){re.escape(word)}(?![\w-])", shown), (where, word)
    else:
        assert words[0] in ("grep", "head"), where


def test_a_session_on_hardware_is_shown_with_the_range_that_it_needs() -> None:
    """Or with that of the session that it continues; the emulated rig needs none."""
    emulated = "docs/how-to/try-without-hardware.md"
    shown = [
        (where, words)
        for where, words in SHELL
        if words[:2] == ["rigidimeter", "run"] and "--rig" in words
        if not where.startswith(emulated) and "--resume" not in words and "--console" not in words
    ]
    assert shown
    needed = {"--lead-range", "--range-deg"}
    assert [where for where, words in shown if not needed & set(words)] == []


def test_the_readme_begins_with_make_demo_and_make_test() -> None:
    first = next(block for block in blocks(ROOT / "README.md") if block.info == "sh")
    assert first.text.split("\n") == ["make demo", "make test", ""]


def test_every_command_is_listed_and_no_other() -> None:
    page = ROOT / "docs" / "reference" / "commands.md"
    listed = {name.removeprefix("rigidimeter ") for name in table(page, "Commands")}
    assert listed == set(below())


def test_options_named_in_running_text_exist() -> None:
    known = set(re.findall(r"--[a-z][a-z-]*", "".join(_every_help())))
    for path in DOCUMENTS:
        text = re.sub(r"^```.*?^```$", "", path.read_text("utf-8"), flags=re.DOTALL | re.M)
        for code in re.findall(r"`([^`\n]+)`", text):
            for option in re.findall(r"(?<![\w-])--[a-z][a-z-]*", code):
                assert option in known | {"--help", "--version"}, (path, code)


def _every_help(*command: str) -> list[str]:
    pages = [_every_help(*command, name) for name in below(*command)]
    return [help_of(*command), *(text for page in pages for text in page)]


def test_the_columns_that_are_read_are_listed() -> None:
    columns = table(ROOT / "docs" / "how-to" / "name-the-columns.md", "Name the columns")
    listed = {name: unit for name, unit in CHANNEL_UNITS.items() if name not in EMG_CHANNELS[1:]}
    assert set(columns) == {"time_s", *listed, *LABELS}
    for name, unit in listed.items():
        assert columns[name] == unit


TOML = [
    block
    for block in ALL_BLOCKS
    if block.info.split()[:1] == ["toml"] and block.info != "toml refused"
]
REFUSED = [
    (block, after)
    for path in DOCUMENTS
    for block, after in zip(blocks(path), [*blocks(path)[1:], None], strict=False)
    if block.info == "toml refused"
]


@pytest.mark.parametrize("block", TOML, ids=lambda block: block.where)
def test_a_toml_example_is_accepted(block: Block, tmp_path: Path) -> None:
    if block.text.startswith('schema = "rigidimeter.study/1"'):
        (tmp_path / "study.toml").write_text(block.text, "utf-8")
        read_study_toml(tmp_path / "study.toml")
    elif block.text.startswith(f'schema = "{MAPPING_SCHEMA}"'):
        (tmp_path / "lab.toml").write_text(block.text, "utf-8")
        assert read_mapping(tmp_path / "lab.toml").said.units["torque_nm"] == "mV"
    else:
        parse_settings(tomllib.loads(block.text))


@pytest.mark.parametrize(("block", "after"), REFUSED, ids=[block.where for block, _ in REFUSED])
def test_a_refusal_is_the_sentence_that_is_printed(block: Block, after: Block | None) -> None:
    assert after is not None
    assert after.info == "text"
    with pytest.raises(UserError) as refusal:
        parse_settings(tomllib.loads(block.text), source="study.toml")
    assert f"rigidimeter: {refusal.value}\n" == after.text


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.name)
def test_an_example_file_is_accepted(path: Path) -> None:
    load_settings(path)


@pytest.mark.parametrize("study", STUDIES, ids=lambda path: path.name)
def test_an_example_of_a_planned_study_is_accepted(study: Path) -> None:
    read_study_toml(study / "study.toml")
    assert read_plan(study) is not None


def test_there_are_the_two_example_files() -> None:
    assert {"study.toml", "paper-rates.toml"} <= {path.name for path in EXAMPLES}


def test_the_examples_in_python_compile() -> None:
    for path in sorted((ROOT / "examples").rglob("*.py")):
        compile(path.read_text("utf-8"), str(path), "exec")
    for block in ALL_BLOCKS:
        if block.info == "python":
            compile(block.text, block.where, "exec")


def _anchors(path: Path) -> set[str]:
    headings = re.findall(r"^#+ (.+)$", path.read_text("utf-8"), re.M)
    return {re.sub(r"[^\w\- ]", "", text.lower()).replace(" ", "-") for text in headings}


@pytest.mark.parametrize("path", DOCUMENTS, ids=lambda path: str(path.relative_to(ROOT)))
def test_relative_links_resolve(path: Path) -> None:
    text = re.sub(r"^```.*?^```$", "", path.read_text("utf-8"), flags=re.DOTALL | re.M)
    for target in re.findall(r"\]\(([^)\s]+)\)", text):
        if re.match(r"[a-z]+:", target):
            continue
        file, _, anchor = target.partition("#")
        linked = (path.parent / file).resolve() if file else path
        assert linked.exists(), target
        if anchor:
            assert anchor in _anchors(linked), target


@pytest.mark.parametrize("path", DOCUMENTS, ids=lambda path: str(path.relative_to(ROOT)))
def test_a_document_is_tidy(path: Path) -> None:
    text = path.read_text("utf-8")
    assert text.startswith("# ")
    assert text.endswith("\n")
    assert not re.search(r"[ \t]+$|\t", text, re.M)
    assert not re.search(r"/(home|tmp|work|root|Users)/", text)
