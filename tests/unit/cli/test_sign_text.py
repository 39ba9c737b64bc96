"""What an operator reads of a torque sensor of the wrong sign."""

from __future__ import annotations

from rigidimeter.cli.sign_text import found_blocks, sign_blocks
from rigidimeter.cli.terminal_tables import text_lines
from rigidimeter.commissioning import Search, TurnedEpochs
from rigidimeter.commissioning.checks import below
from rigidimeter.commissioning.static_tests import NOISE, measured_noise_nm
from rigidimeter.guard import Cause
from rigidimeter.settings import parse_settings

FOUND = TurnedEpochs("OFF", 0.0, 1.0, 14.6, {Cause.TORQUE_SIGN: [0.4, 0.38, 0.5]})
HIDDEN = TurnedEpochs(
    *("OFF", 0.1, 1.0, 40.0),
    {Cause.TORQUE_SIGN: [0.9], Cause.NONE: [4.0], Cause.HELD_AT_LIMIT: [2.0, 1.5]},
)
LARGER = TurnedEpochs("OFF", 0.1, 3.0, 35.2, {Cause.TORQUE_SIGN: [2.0, 3.3]})


def test_each_own_torque_has_a_row_with_what_else_ended_its_epochs():
    table, sentence = found_blocks(Search((FOUND, HIDDEN), LARGER))
    first, second = table.rows
    assert first == ("OFF", "0 N·m", "3 of 3", "0.40 s (0.38–0.50)", "15 deg", "")
    assert second[2] == "1 of 4"
    assert second[-1] == "1 not within 4 s, 2 held at limit (1.50–2.00 s)"
    said = " ".join(sentence.split())
    assert said.startswith("With 0.1 N·m of own torque the guard does not always find it; with ")
    assert "prbs.amplitude_nm = 3 it does, after 2.0 to 3.3 s, the arm at up to 35 deg" in said
    assert "deg. Otherwise repeat `rigidimeter check`, which" in said
    assert said.endswith("before every session.")


def test_nothing_more_is_said_where_it_is_always_found():
    assert len(list(found_blocks(Search((FOUND,), None)))) == 1


def test_no_perturbation_is_named_that_does_not_help():
    hidden = HIDDEN._replace(own_torque_nm=0.0)
    said = " ".join(" ".join(text_lines(found_blocks(Search((hidden,), None)))).split())
    assert "Even of a subject without any own torque the guard does not always find it; no " in said
    assert "prbs.amplitude_nm" not in said
    assert "that was tried helps. So repeat `rigidimeter check`" in said


def test_a_protocol_without_perturbation_is_said_to_show_no_sign():
    settings = parse_settings({"protocol": {"blocks": [{"task": "sinusoid"}]}})
    said = " ".join(sign_blocks(settings, ()))
    assert said.startswith("This protocol has no torque perturbation: the guard cannot find a ")
    assert "rigidimeter check" in said


def test_the_noise_is_the_one_that_was_measured(monkeypatch):
    asked = []
    monkeypatch.setattr(
        "rigidimeter.commissioning.search_for_turned_sign",
        lambda _, noise_nm, __: asked.append(noise_nm) or Search((FOUND,), None),
    )
    measured = below(NOISE, 0.0123, "N·m", 0.1, "")
    lines = [
        text_lines(sign_blocks(parse_settings({}), checks), 100) for checks in ((measured,), ())
    ]
    assert asked == [0.0123, None]
    assert "0.012 N·m (SD)" in " ".join(lines[0])
    assert "0.005 N·m (SD)" in " ".join(lines[1])
    assert lines[0][-1] == "In an imposed sinusoid the guard does not see the sign."
    assert measured_noise_nm([below(NOISE, float("inf"), "N·m", 0.1, "")]) is None
