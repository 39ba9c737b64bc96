"""Commands of the page in processes: what they ask, what they say, and how they are ended."""

import asyncio
import sys

import pytest

from rigidimeter.rig.console import BEAT
from rigidimeter.rig.console.page import QUESTION, CommandResult, Jobs, jobs

ASKS = f"""
import sys
print("first", flush=True)
print({QUESTION!r} + "go on?", flush=True)
print("answer", next(line for line in sys.stdin if line != {BEAT!r} + "\\n").strip(), flush=True)
for line in sys.stdin: pass
"""

COUNTS = f"""
import sys
for _ in range(3): assert sys.stdin.readline() == {BEAT!r} + "\\n"
print("three beats", flush=True)
for line in sys.stdin: pass
"""


def converse(monkeypatch, script, asked, going_on):
    monkeypatch.setattr(jobs, "_python", lambda: (sys.executable, "-S", "-c", script))
    said = []

    async def run():
        one = Jobs()
        return await one.conversation(
            on_output=said.append, on_question=asked, going_on=lambda: going_on(said)
        )

    return asyncio.run(run()), said


@pytest.mark.parametrize("consent", [True, False])
def test_a_question_gets_its_answer_and_the_page_all_lines(monkeypatch, consent):
    async def asked(question):
        assert question == "go on?"
        return consent

    answer, said = converse(
        monkeypatch, ASKS, asked, lambda said: not said or "answer" not in said[-1]
    )
    assert said == ["first", f"first\nanswer {'yes' if consent else 'no'}"]
    assert not answer.good  # it was ended


def test_a_command_that_may_not_go_on_is_ended_though_nobody_answers(monkeypatch):
    asked_for = []

    async def asked(question):
        asked_for.append(question)
        await asyncio.sleep(60.0)
        return True

    answer, said = converse(monkeypatch, ASKS, asked, lambda _: not asked_for)
    assert said == ["first"]
    assert not answer.good


def test_a_command_that_moves_the_rig_is_told_again_and_again_that_somebody_is_there(monkeypatch):
    async def asked(_):
        raise AssertionError

    _, said = converse(monkeypatch, COUNTS, asked, lambda said: not said)
    assert said == ["three beats"]


def test_an_answer_names_no_folder_that_is_gone_and_no_markup():
    answer = CommandResult(False, "/tmp/x/protocol.toml: <b>wrong</b>")
    assert answer.html("/tmp/x", ["do <this>"]) == (
        "<p><b>✗ not good:</b></p><ul><li>do &lt;this&gt;</li></ul><details open>"
        '<summary>All numbers</summary><pre tabindex="0">…/protocol.toml: '
        "&lt;b&gt;wrong&lt;/b&gt;</pre></details>"
    )


def test_a_command_that_computes_gives_way_to_a_session(monkeypatch):
    script = """
import os, time
while os.getpriority(os.PRIO_PROCESS, 0) < 10: time.sleep(0.01)
print("gives way")
"""
    monkeypatch.setattr(jobs, "_python", lambda: (sys.executable, "-S", "-c", script))
    assert asyncio.run(Jobs().command(timeout_s=30.0)) == CommandResult(True, "gives way")
