"""Numbers and names as people enter them."""

import pytest

from rigidimeter.core.errors import UserError
from rigidimeter.rig.console.page import line, name, number, whole_number


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1.5", 1.5),
        ("1,5", 1.5),
        (",5", 0.5),
        ("0,125", 0.125),
        ("-0,125", -0.125),
        (" 20 ", 20.0),
        ("−3", -3.0),
        ("1e-3", 0.001),
        ("+2.", 2.0),
        ("1.500", 1.5),
    ],
)
def test_a_decimal_comma_is_understood(text, value):
    assert number(text, "x") == value


@pytest.mark.parametrize("text", ["1,500", "12,000", "-3,250"])
def test_a_comma_that_may_separate_thousands_is_refused(text):
    with pytest.raises(UserError, match=r"may be .* or .*; write it without a comma"):
        number(text, "amplitude")


@pytest.mark.parametrize(
    "text", ["", "x", "1.2.3", "1,2,3", "1 000", "nan", "inf", "0x10", "1_0", "٣", "1,5e3"]
)
def test_what_is_no_number_is_refused(text):
    with pytest.raises(UserError, match="is no number"):
        number(text, "amplitude")


@pytest.mark.parametrize("read", [number, whole_number])
@pytest.mark.parametrize("text", ["1e999", "-1e400", "9" * 400])
def test_what_no_number_of_the_computer_holds_is_refused(read, text):
    with pytest.raises(UserError, match="too large"):
        read(text, "amplitude")


def test_epochs_are_whole():
    assert whole_number("4", "epochs") == 4
    with pytest.raises(UserError, match="no whole number"):
        whole_number("4,5", "epochs")


@pytest.mark.parametrize(
    "text", ["../x", "a/b", "a\\b", ".", "-x", "a b", "ä", "", "x" * 41, "a\0", "<b>", "a\n"]
)
def test_a_name_cannot_be_a_path_nor_markup(text):
    with pytest.raises(UserError, match="subject"):
        name(text + ("" if text.strip() == text else "x/"), "subject")


def test_a_line_is_one_line():
    assert line(" said ", "note") == "said"
    with pytest.raises(UserError, match="cannot be shown"):
        line("a\nb", "note")
