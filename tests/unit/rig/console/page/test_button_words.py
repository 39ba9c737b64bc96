"""What the page says names its buttons."""

from rigidimeter.rig.acquisition import REMEDIES
from rigidimeter.rig.console.page import FoundSession, in_buttons, next_buttons, unfinished_words


def test_no_remedy_on_the_page_resumes_by_a_command():
    assert any("--resume" in remedy for remedy in REMEDIES.values())
    assert not any("--resume" in in_buttons(remedy) for remedy in REMEDIES.values())
    assert in_buttons("s: interrupted; `rigidimeter recover a b` closes it") == (
        "s: interrupted; “Recover” under After closes it"
    )


def test_the_next_step_is_the_most_pressing_first():
    assert next_buttons(closed=False, good=0, left=3).startswith("Next, under After: “Recover”")
    said = next_buttons(closed=True, good=2, left=1)
    assert said.index("Run what is left") < said.index("Report of the study")
    assert next_buttons(closed=True, good=0, left=0) == ""


def test_unfinished_sessions_are_named_the_newest_first():
    made = FoundSession("a", "", "S", True, "success", "", 2, False, ())
    assert unfinished_words([made]) == ""
    broken = FoundSession("b", "", "S", True, "", "it was interrupted", 2, False, ())
    left = FoundSession("c", "", "S", True, "fail", "", 2, False, (), left=(2,))
    recording = FoundSession("d", "", "S", True, "", "", 2, True, ())
    said = unfinished_words([recording, broken, left, made])
    assert said == (
        "b: 0 of 2 epochs are good, it was interrupted; “Recover” under After. "
        "c: 0 of 2 epochs are good, “Run what is left” under After."
    )
    assert unfinished_words([left] * 5).endswith("2 more are unfinished.")


def test_the_range_is_entered_in_the_form():
    said = (
        "rig.toml: is hardware, so the range of motion of this person is needed: lead the arm "
        "through it with --lead-range, or give it on the drive's scale with --range-deg LOW HIGH; "
        "on the page enter it in the form"
    )
    assert in_buttons(said).endswith("is needed: enter it in the form")
