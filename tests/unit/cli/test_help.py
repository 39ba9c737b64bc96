"""Help pages: one screen by `--help`, everything by `--help-all`, for every command there is."""

import re
import subprocess
import sys
from itertools import pairwise

import pytest
from tests.core_install import DEMO, ROOT, examples
from typer.main import get_command
from typer.testing import CliRunner

from rigidimeter.analysis.estimation import METHODS
from rigidimeter.analysis.export import FORMATS
from rigidimeter.cli.help_pages import HelpCommand, HelpGroup, full_text
from rigidimeter.cli.main import app

LONGER = {"estimate", "compare", "report", "batch", "run"}


def _below(command, path=()):
    yield path, command
    for name, each in getattr(command, "commands", {}).items():
        yield from _below(each, (*path, name))


COMMANDS = dict(_below(get_command(app)))


def _page(path, option):
    ran = CliRunner().invoke(app, [*path, option], env={"COLUMNS": "80"})
    assert ran.exit_code == 0, ran.output
    return ran.output


@pytest.mark.parametrize("path", COMMANDS, ids=" ".join)
def test_a_help_page_is_one_screen(path):
    lines = _page(path, "--help").splitlines()
    most = 24
    if not path or path[-1] in LONGER:
        most = 40
    assert len(lines) <= most
    assert max(map(len, lines)) <= 80


def test_examples_can_be_run_after_make_demo():
    """`python -m tests.core_install` runs them, and the test of the demo has its files."""
    lines = [words for command in COMMANDS.values() for words in examples(command)]
    assert len(lines) > 40
    options = "--out", "--rig-out", "--json", "--write-mapping"
    written = {path for words in lines for name, path in pairwise(words) if name in options}
    others = written | {
        "drive.eds",
        "tcp://host:8786",
    }  # what comes with a drive, and a cluster's address
    for words in lines:
        size = 2 if words[0] == "study" else 1
        command = COMMANDS[tuple(words[:size])]
        command.make_context(words[0], words[size:])  # of options and values that there are
        for word in words:
            file = re.search(r"\.[a-z]+$|/", word) and not word.startswith(DEMO)
            assert not file or word in others or (ROOT / word).exists(), " ".join(words)


@pytest.mark.parametrize("path", COMMANDS, ids=" ".join)
def test_no_line_of_it_is_cut(path):
    page = _page(path, "--help") + _page(path, "--help-all")
    assert not re.findall(r"[^A-Z\]},]\.\.\.$", page, re.M)  # as in INPUT... and [SESSION]...


@pytest.mark.parametrize(("path", "command"), COMMANDS.items(), ids=map(" ".join, COMMANDS))
def test_every_option_is_in_help_all(path, command):
    assert isinstance(command, HelpCommand | HelpGroup)
    page = _page(path, "--help-all")
    words = page.replace(",", " ").replace("/", " ").split()
    names = [name for each in command.params for name in (*each.opts, *each.secondary_opts)]
    assert {"-h", "--help", *(name for name in names if name[0] == "-")} <= set(words)
    for each in command.params:
        if each.name != "help_all":
            assert "".join(full_text(each).split()) in "".join(page.split())
    assert max(map(len, page.splitlines())) <= 80


def test_what_is_behind_help_all_is_counted():
    command = COMMANDS[("estimate",)]
    daily, everything = _page(["estimate"], "--help"), _page(["estimate"], "--help-all")
    behind = {each.opts[0] for each in command.params} - set(re.findall(r"^  (\S+)", daily, re.M))
    behind -= {"paths", "--help-all"}
    assert behind
    assert f"--help-all: {len(behind)} more options, all details" in daily
    assert behind <= set(re.findall(r"^  (\S+)", everything, re.M))


def test_options_are_in_groups():
    lines = _page(["estimate"], "--help").splitlines()
    assert [line for line in lines if line.endswith(":") and line[0] != " "] == [
        "What to read:",
        "How to read it:",
        "How to estimate:",
        "What to write:",
    ]


def test_the_first_page_has_each_command_on_a_line_of_its_group():
    page = CliRunner().invoke(app, [], env={"COLUMNS": "80"}).output
    panels = {}
    for line in page.splitlines():
        if line.endswith(":"):
            panel = line[:-1]
        elif line.startswith("  ") and line[2:].split(" ", 1)[0] in COMMANDS[()].commands:
            name, text = line.split(None, 1)
            panels.setdefault(panel, []).append(name)
            assert COMMANDS[(name,)].help.replace("\n", " ").startswith(text)
    assert list(panels) == ["Analyse", "Plan", "Measure", "Paper", "Start"]
    assert sorted(name for names in panels.values() for name in names) == sorted(
        COMMANDS[()].commands
    )


def test_the_names_in_the_short_page_are_those_there_are():
    """They are written by hand there, for the short page imports nothing heavy."""
    for method in METHODS:
        assert method.name in _page(["estimate"], "--help")
    for each in FORMATS:
        assert each.name in _page(["export"], "--help")


def test_the_short_page_imports_nothing_heavy():
    code = (
        "import sys\nfrom rigidimeter.cli.main import app\n"
        "try:\n    app(['estimate', '--help'])\nexcept SystemExit:\n    pass\n"
        "print([m for m in ('numpy', 'scipy', 'pyarrow', 'matplotlib') if m in sys.modules])"
    )
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert out.stdout.splitlines()[-1] == "[]"


@pytest.mark.parametrize(
    ("typed", "offered"),
    [
        ("rigidimeter comp", {"compare"}),
        ("rigidimeter estimate --clock", {"--clock-offset"}),  # behind --help-all
        (
            "rigidimeter study ",
            {"new", "add", "exclude", "include", "simulate", "plan", "rehearse", "stimulation"},
        ),
        ("rigidimeter --inst", {"--install-completion"}),
    ],
)
def test_bash_completes_commands_and_options(monkeypatch, typed, offered):
    words = typed.split(" ")
    environment = {
        "_RIGIDIMETER_COMPLETE": "complete_bash",
        "COMP_WORDS": "\n".join(words),
        "COMP_CWORD": f"{len(words) - 1}",
    }
    ran = CliRunner().invoke(app, [], env=environment, prog_name="rigidimeter")
    assert set(ran.output.split()) == offered


def test_the_script_for_bash_is_printed():
    code = (
        "from rigidimeter.cli.main import app; app(['--show-completion'], prog_name='rigidimeter')"
    )
    ran = subprocess.run(  # the shell is found by the name of the parent process
        ["bash", "-c", f'{sys.executable} -c "{code}"; :'],
        capture_output=True,
        text=True,
        check=True,
    )
    assert "complete -o default -F _rigidimeter_completion rigidimeter" in ran.stdout
