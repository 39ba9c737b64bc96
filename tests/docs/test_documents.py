"""The documents say what the program does: commands, options, settings, columns, keys and links."""

from __future__ import annotations

import importlib.util
import json
import re
import shlex
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.known_joint import angle_rad, torque_nm
from tests.small_study import scored_study, study
from typer.testing import CliRunner

from rigidimeter import __version__
from rigidimeter.cli.main import app
from rigidimeter.errors import UserError
from rigidimeter.recording import (
    ReadOptions,
    SessionWriter,
    estimates_document,
    read_manifest,
    read_recording,
)
from rigidimeter.recording.channels.choice import LABELS
from rigidimeter.recording.event_log import read_events
from rigidimeter.recording.sample_log import SAMPLE_UNITS
from rigidimeter.recording.study_toml import STUDY_SCHEMA, read_study_toml
from rigidimeter.records import CHANNEL_UNITS, Analysis, Delay, Finding, Fit, Outcome, Score
from rigidimeter.settings import Settings, load_settings, parse_settings

__all__ = ["scored_study", "study"]

ROOT = Path(__file__).parents[2]
DOCUMENTS = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")])
EXAMPLES = sorted((ROOT / "examples").rglob("*.toml"))
FILES = ROOT / "docs" / "reference" / "files.md"
RECORDING = ROOT / "docs" / "how-to" / "read-your-recording.md"
RUN = CliRunner()


@dataclass(frozen=True)
class Block:
    """A fenced block: its document, its info string, and its text."""

    path: Path
    info: str
    text: str

    @property
    def where(self) -> str:
        return f"{self.path.relative_to(ROOT)}: {self.text.splitlines()[0] if self.text else ''}"


def blocks(path: Path) -> list[Block]:
    found = re.findall(r"^```([^\n]*)\n(.*?)^```$", path.read_text("utf-8"), re.DOTALL | re.M)
    return [Block(path, info.strip(), text) for info, text in found]


ALL_BLOCKS = [block for path in DOCUMENTS for block in blocks(path)]


def commands(blocks: list[Block]) -> Iterator[tuple[str, list[str]]]:
    """Yield where each shell command stands, and its words."""
    for block in blocks:
        if block.info == "sh":
            for line in block.text.replace("\\\n", " ").splitlines():
                if line.strip():
                    yield block.where, shlex.split(line, comments=True)


def table(path: Path, heading: str) -> dict[str, str]:
    """Return the first two columns of the table under a heading, backticks taken off the first."""
    section = re.split(rf"^#+ {re.escape(heading)}$", path.read_text("utf-8"), flags=re.M)[1]
    section = re.split(r"^#+ ", section, flags=re.M)[0]
    rows = re.findall(r"^\| `([^`]+)` \|([^|]*)\|", section, re.M)
    return {name: text.strip() for name, text in rows}


@cache
def help_of(*command: str) -> str:
    result = RUN.invoke(app, [*command, "--help"])
    assert result.exit_code == 0, result.output
    return result.output


def below(*command: str) -> list[str]:
    """Return the names of the commands below a group; of a command, none."""
    _, _, listed = help_of(*command).partition("\nCommands:\n")
    return re.findall(r"^  ([a-z]+)  ", listed, re.M)


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


@pytest.mark.parametrize(("where", "words"), SHELL, ids=[shlex.join(words) for _, words in SHELL])
def test_a_command_line_is_one_that_exists(where: str, words: list[str]) -> None:
    if words[0] == "make":
        assert re.search(rf"^{words[1]}:", (ROOT / "Makefile").read_text("utf-8"), re.M), where
    elif words[:2] == ["python", "-m"]:
        module = ROOT / words[2].replace(".", "/")
        assert module.with_suffix(".py").is_file() or (module / "__main__.py").is_file(), where
    elif words[0] == "python":
        assert (ROOT / words[1]).is_file(), where
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
        assert words[0] == "head", where


def test_the_readme_begins_with_make_demo_and_make_test() -> None:
    first = next(block for block in blocks(ROOT / "README.md") if block.info == "sh")
    assert first.text.split("\n") == ["make demo", "make test", ""]


def test_the_readme_lists_every_command_and_no_other() -> None:
    listed = {name.removeprefix("rigidimeter ") for name in table(ROOT / "README.md", "Commands")}
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


def test_the_readme_lists_the_columns_that_are_read() -> None:
    columns = table(ROOT / "README.md", "Your own recording")
    assert set(columns) == {"time_s", *CHANNEL_UNITS, *LABELS}
    for name, unit in CHANNEL_UNITS.items():
        assert columns[name] == unit


TOML = [block for block in ALL_BLOCKS if block.info == "toml"]
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


def test_there_are_the_two_example_files() -> None:
    assert {"study.toml", "paper-rates.toml"} <= {path.name for path in EXAMPLES}


def test_the_examples_in_python_compile() -> None:
    for path in sorted((ROOT / "examples").rglob("*.py")):
        compile(path.read_text("utf-8"), str(path), "exec")
    for block in ALL_BLOCKS:
        if block.info == "python":
            compile(block.text, block.where, "exec")


def test_the_sample_columns_are_those_of_the_log() -> None:
    assert table(FILES, "samples.arrows") == dict(SAMPLE_UNITS)
    assert list(table(FILES, "samples.arrows")) == list(SAMPLE_UNITS)


def test_the_manifest_and_event_keys_are_those_of_a_session(tmp_path: Path) -> None:
    writer = SessionWriter(tmp_path / "s", Settings(), [], {"session": 1}, virtual=True)
    writer.event("session_started", time_s=0.0)
    named = {"label": "1", "task": "prbs", "condition": "OFF"}
    writer.event("epoch_started", epoch=1, **named, time_s=0.0, planned_s=20.0, true_joint={})
    ending = {"time_s": 20.0, "outcome": "success", "reason": "", "limited_ticks": 0}
    writer.event("epoch_ended", epoch=1, **ending)
    writer.close(20.0, "success", "")
    assert list(table(FILES, "manifest.json")) == list(read_manifest(tmp_path / "s"))
    events, _ = read_events(tmp_path / "s" / "events.jsonl")
    documented = table(FILES, "events.jsonl")
    assert list(documented) == [event["event"] for event in events]
    for event in events:
        keys = re.findall(r"`([a-z_]+)`", documented[event["event"]])
        assert keys == [key for key in event if key != "event"]


def _analysis() -> Analysis:
    def fits(*conditions: str) -> tuple[Fit, ...]:
        return tuple(
            Fit(
                "s",
                str(k),
                name,
                "bandlimited",
                Outcome(),
                value=(1.0 + k, 2.0 + k, 3.0 + k),
                findings=(Finding("frozen", "doubt", 1.0, 2.0, "a", "b"),),
            )
            for k, name in enumerate(conditions)
        )

    found = fits(*["OFF"] * 3, *["DBS"] * 3)
    score = Score("s", "9", "OFF", Outcome(), 1.0, 2.0, 8, 1.0)
    return Analysis("bandlimited", found, found, 1.0, (score,), found[:2], (Delay("s", 0.0, 0.1),))


def test_the_keys_of_the_estimates_are_documented() -> None:
    document = estimates_document(_analysis())
    assert list(table(FILES, "Top level")) == list(document)
    assert set(table(FILES, "Each fit")) == set(document["epochs"][0])
    assert set(table(FILES, "Each fit")) == set(document["fixed_inertia"]["epochs"][0])
    assert set(table(FILES, "Each score")) == set(document["scores"][0])
    assert set(table(FILES, "Each finding")) == set(document["epochs"][0]["findings"][0])
    assert set(table(FILES, "Each delay")) == set(document["delays"][0])
    assert set(document["pooled"]) == {*table(FILES, "Each fit"), "conditions"}
    assert set(document["fixed_inertia"]) == {"inertia_kg_m2", "epochs"}
    assert f"`{document['schema']}`" in FILES.read_text("utf-8")


def test_the_keys_of_the_comparisons_are_documented(tmp_path: Path) -> None:
    estimates, out = tmp_path / "estimates.json", tmp_path / "comparisons.json"
    estimates.write_text(json.dumps(estimates_document(_analysis())), "utf-8")
    result = RUN.invoke(app, ["compare", str(estimates), "--json", str(out)])
    assert result.exit_code == 0, result.output
    document: dict[str, Any] = json.loads(out.read_text("utf-8"))
    assert list(table(FILES, "Top level of a comparison")) == list(document)
    documented = table(FILES, "Each comparison")
    tested = [row for row in document["comparisons"] if not row["remark"]]
    assert tested
    for row in document["comparisons"]:
        assert list(row) == list(documented)
    groups = set(re.findall(r"`([a-z0-9]+)`", documented["groups"]))
    assert groups == set(tested[0]["groups"]["OFF"])
    assert f"`{document['schema']}`" in FILES.read_text("utf-8")


def test_the_keys_of_a_study_are_documented(study: Path) -> None:
    result = RUN.invoke(app, ["compare", str(study), "--resamples", "100"])
    assert result.exit_code == 0, result.output
    document: dict[str, Any] = json.loads((study / "analysis/comparison.json").read_text("utf-8"))
    assert list(table(FILES, "Top level of a comparison")) == list(document)
    assert list(table(FILES, "Each test by days")) == list(document["comparisons"][0]["days"])
    kept = {path.name for path in (study / "analysis").iterdir()}
    section = FILES.read_text("utf-8").split("## Study folder")[1].split("### Top level")[0]
    assert kept <= set(re.findall(r"`([a-z_]+\.(?:json|csv))`", section))
    inputs = json.loads((study / "analysis/inputs.json").read_text("utf-8"))
    for schema in (document["schema"], inputs["schema"], STUDY_SCHEMA):
        assert f"`{schema}`" in FILES.read_text("utf-8")


def _elbow(tmp_path: Path) -> dict[str, str]:
    """Write the recordings that the page quotes sentences about; return name to sentence."""
    time_s = np.arange(4000) * 0.005
    rows = [[f"{t:.3f}", f"{np.sin(t):.6f}", f"{0.2 * np.cos(3 * t):.6f}"] for t in time_s.tolist()]

    def write(name: str, changed: list[list[str]]) -> None:
        lines = ["time_s,torque_nm,angle_rad", *(",".join(row) for row in changed)]
        (tmp_path / name).write_text("\n".join(lines) + "\n", "utf-8")

    def without_torque(start: int, stop: int, mark: str) -> list[list[str]]:
        return [[t, mark if start <= k < stop else m, a] for k, (t, m, a) in enumerate(rows)]

    write("nan.csv", without_torque(1000, 1003, "NaN"))
    write("hole.csv", without_torque(1000, 1300, ""))
    write("gap.csv", [*rows[:2000], *rows[2400:]])
    write("text.csv", without_torque(700, 701, "overload"))
    write("back.csv", [*rows[:500], [rows[498][0], *rows[500][1:]], *rows[501:]])
    torque = torque_nm(time_s)
    angle = angle_rad(time_s)
    joint = [f"{t:.3f},{m:.6f},{a:.6f}" for t, m, a in zip(time_s, torque, 2 * angle, strict=True)]
    text = "\n".join(["time_s,torque_nm,angle", *joint])
    (tmp_path / "nounits.csv").write_text(text, "utf-8")
    names = ("nan.csv", "hole.csv", "gap.csv", "text.csv", "back.csv", "nounits.csv")
    said = {}
    for name in names:
        try:
            notices = read_recording(tmp_path / name, ReadOptions())[1]
            said[name] = f"{notices[0].level}: {notices[0].text}"
        except UserError as refusal:
            said[name] = f"rigidimeter: {refusal}"
    return {name: text.replace(f"{tmp_path}/", "") for name, text in said.items()}


def test_the_sentences_about_recordings_are_those_that_are_printed(tmp_path: Path) -> None:
    page = RECORDING.read_text("utf-8").splitlines()
    for name, sentence in _elbow(tmp_path).items():
        assert set(sentence.splitlines()) <= set(page), name


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


def test_every_page_is_in_the_index() -> None:
    index = ROOT / "docs" / "index.md"
    linked = re.findall(r"\]\(([^)\s]+\.md)\)", index.read_text("utf-8"))
    reached = {(index.parent / target).resolve() for target in linked}
    assert set((ROOT / "docs").rglob("*.md")) - {index} <= reached


@pytest.mark.parametrize("path", DOCUMENTS, ids=lambda path: str(path.relative_to(ROOT)))
def test_a_document_is_tidy(path: Path) -> None:
    text = path.read_text("utf-8")
    assert text.startswith("# ")
    assert text.endswith("\n")
    assert not re.search(r"[ \t]+$|\t", text, re.M)
    assert not re.search(r"/(home|tmp|work|root|Users)/", text)


def test_the_citation_names_this_version_and_invents_nothing() -> None:
    text = (ROOT / "CITATION.cff").read_text("utf-8")
    for line in (
        "cff-version: 1.2.0",
        "title: rigidimeter",
        '  - name: "The rigidimeter developers"',
        "license: BSD-3-Clause",
        f"version: {__version__}",
    ):
        assert line in text.splitlines()
    assert re.search(r"^message: ", text, re.M)
    assert "doi" not in text.lower()
    if importlib.util.find_spec("yaml") is not None:
        parsed = importlib.import_module("yaml").safe_load(text)
        assert parsed["authors"] == [{"name": "The rigidimeter developers"}]


def test_the_licence_is_the_one_that_the_package_states() -> None:
    text = (ROOT / "LICENSE").read_text("utf-8")
    assert text.startswith("BSD 3-Clause License")
    assert "2026, The rigidimeter developers" in text
