"""The end says what to do next, with the names of the folders as they are."""

from pathlib import Path

import pytest

from rigidimeter.rig.console import next_steps, resume_command


def steps(folder="s", **more):
    values = {"closed": True, "good": 8, "left": 0, "rig": None, "about": {}, **more}
    return [step.split("  # ")[0] for step in next_steps(Path(folder), **values)]


def test_a_whole_session_is_analysed():
    assert steps() == ["rigidimeter estimate s", "rigidimeter report s --out s-report"]


def test_one_that_was_interrupted_is_continued_first():
    assert steps(good=3, left=5)[0] == "rigidimeter run --resume s --out s-2"
    assert steps(good=3, left=5, rig=Path("rig.toml"))[0] == (
        "rigidimeter run --resume s --rig rig.toml --out s-2"
    )
    assert (
        "run the 5 epochs that are left"
        in next_steps(Path("s"), closed=True, good=3, left=5, rig=None, about={})[0]
    )
    assert len(steps(good=0, left=8)) == 1  # nothing to analyse


def test_one_that_was_not_closed_is_closed_first():
    assert steps(closed=False, good=3, left=5)[:2] == [
        "rigidimeter recover s",
        "rigidimeter run --resume s --out s-2",
    ]


def test_names_are_quoted_as_a_shell_needs_them():
    assert steps("My Study/day 1")[0] == "rigidimeter estimate 'My Study/day 1'"


@pytest.mark.parametrize(("name", "new"), [("s", "s-2"), ("s-2", "s-3"), ("a-b", "a-b-2")])
def test_a_new_folder_is_one_that_is_not_there(tmp_path, name, new):
    assert resume_command(tmp_path / name, None, {}).endswith(f"--out {tmp_path / new}")
    (tmp_path / new).mkdir()
    again = resume_command(tmp_path / name, None, {})
    assert not Path(again.partition("--out ")[2]).exists()
