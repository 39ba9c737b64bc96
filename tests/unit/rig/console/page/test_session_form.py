"""From what was entered to a session, and what is wrong under which field."""

import pytest

from rigidimeter.core.files import toml_text
from rigidimeter.core.settings import Settings, dump_settings, load_settings, parse_settings
from rigidimeter.rig.console.page import empty_form, read_form, restored_form

BASE = Settings()


@pytest.fixture
def form():
    return empty_form(BASE) | {"subject": "S01", "operator": "Op"}


def test_an_untouched_form_is_the_protocol_to_the_last_digit(form):
    """A commissioning record holds for these numbers and no others."""
    entered = read_form(form, BASE)
    assert entered.errors == {}
    assert entered.settings == BASE
    third = parse_settings({"protocol": {"rests_s": [10.0 + 1 / 3]}})
    said = empty_form(third) | {"subject": "S01", "operator": "Op", "prbs_amplitude": "1,5"}
    entered = read_form(said, third)
    assert entered.settings.prbs.amplitude_nm == 1.5
    assert entered.settings.protocol == third.protocol
    assert entered.settings.controller == third.controller


def test_subject_and_operator_must_be_given():
    assert read_form(empty_form(BASE), BASE).errors.keys() == {"subject", "operator"}


def test_numbers_are_read_with_a_comma_and_refused_by_the_settings(form):
    entered = read_form(form | {"prbs_amplitude": "1,5", "rests": "10; 12,5"}, BASE)
    assert entered.settings is not None
    assert entered.settings.prbs.amplitude_nm == 1.5
    assert entered.settings.protocol.rests_s == [10.0, 12.5]
    errors = read_form(form | {"rests": "10,20"}, BASE).errors
    assert "one time, 10.20, or two, 10; 20" in errors["rests"]
    errors = read_form(form | {"prbs_amplitude": "99"}, BASE).errors
    assert errors.keys() == {"prbs_amplitude"}
    assert "less than or equal to 50, in N·m" in errors["prbs_amplitude"]
    assert read_form(form | {"rests": "-1"}, BASE).errors.keys() == {"rests"}
    assert read_form(form | {"prbs_clock": "fast"}, BASE).errors.keys() == {"prbs_clock"}


def test_primary_measures_are_declared_where_they_are_chosen(form):
    assert read_form(form, BASE).primary is None
    chosen = read_form(form | {"primary": "stiffness, then damping"}, BASE).primary
    assert (chosen.measures, chosen.rule) == (["stiffness_nm_rad", "damping_nm_s_rad"], "sequence")
    assert restored_form(form | {"primary": "damping"}, BASE)["primary"] == "damping"


def test_conditions_may_be_codes_that_the_settings_do_not_know(form):
    entered = read_form(form | {"condition0": "K7"}, BASE)
    assert entered.settings is not None
    assert entered.settings.protocol.blocks[0].condition == "K7"
    assert entered.settings.subject["K7"] == BASE.subject["OFF"]
    assert entered.about["conditions"] == ["K7", "OFF"]
    assert "condition0" in read_form(form | {"condition0": "a/b"}, BASE).errors


def test_stimulation_is_numbers_with_units(form):
    given = {"stim_frequency": "130", "stim_ma": "2,5", "stim_width": "60"}
    assert read_form(form | given, BASE).about["stimulation"] == {
        "frequency_hz": 130.0,
        "amplitude_ma": 2.5,
        "pulse_width_us": 60.0,
    }
    assert read_form(form | {"stim_width": "-1"}, BASE).errors.keys() == {"stim_width"}
    both = read_form(form | {"stim_ma": "2", "stim_volts": "3"}, BASE)
    assert both.settings is None
    assert both.errors
    assert "stimulation" not in read_form(form, BASE).about


def test_a_kept_form_comes_back_and_a_damaged_one_does_not(form):
    kept = form | {"prbs_amplitude": "wrong"}
    for key in ("task1", "condition1", "epochs1"):
        del kept[key]
    assert restored_form(kept, BASE) == kept
    for damaged in (None, [], {"subject": 1}, {"task0": "prbs"}, {"more": "x"}):
        assert restored_form(damaged, BASE) == empty_form(BASE)


def test_a_session_stays_blinded_when_the_page_is_loaded_again(form):
    assert read_form(form, BASE).about["blinded"] is False
    again = restored_form(form | {"blinded": "yes"}, parse_settings({"seed": 7}))
    assert read_form(again, BASE).about["blinded"] is True


def test_every_block_of_a_protocol_is_in_the_form_and_one_that_was_removed_stays_so():
    blocks = [{"condition": "OFF", "epochs": k + 1} for k in range(14)]
    long = parse_settings({"protocol": {"blocks": blocks}})
    form = empty_form(long) | {"subject": "S01", "operator": "Op"}
    assert read_form(form, long).settings == long
    for part in ("task", "condition", "epochs"):
        del form[f"{part}13"]
    again = read_form(restored_form(form, long), long)
    assert again.settings.protocol.blocks == long.protocol.blocks[:13]


def test_a_form_of_another_protocol_keeps_who_was_there_alone(form):
    """The values of a protocol file that was edited since are those of the file."""
    kept = form | {"stim_ma": "2", "prbs_amplitude": "1.7"}
    edited = parse_settings({"prbs": {"duration_s": 33.0}})
    assert restored_form(kept, BASE) == kept
    again = restored_form(kept, edited)
    assert again == empty_form(edited) | {"subject": "S01", "operator": "Op", "stim_ma": "2"}
    assert again["prbs_duration"] == "33"


def test_settings_are_the_same_as_a_file(tmp_path):
    settings = parse_settings({"protocol": {"blocks": [{"condition": "OFF"}]}, "seed": 7})
    path = tmp_path / "protocol.toml"
    path.write_text(toml_text(dump_settings(settings)))
    assert load_settings(path) == settings


RANGE = {"range_low": "-30", "range_high": "60,5", "range_of": "S01"}


def test_a_range_of_motion_is_of_the_subject_that_is_named(form):
    assert "range" not in read_form(form, BASE).about
    entered = read_form(form | RANGE, BASE)
    assert entered.errors == {}
    assert entered.about["range"] == {
        "low_deg": -30.0,
        "high_deg": 60.5,
        "how": "typed",
        "subject": "S01",
    }
    of_another = read_form(form | RANGE | {"subject": "S02"}, BASE).errors
    assert of_another.keys() == {"range_of"}
    assert "entered for S01, and the subject is S02" in of_another["range_of"]


@pytest.mark.parametrize(
    ("entered", "keys"),
    [
        ({"range_low": ""}, {"range_low"}),
        ({"range_high": "x"}, {"range_high"}),
        ({"range_of": ""}, {"range_of"}),
        ({"range_low": "70"}, {"range_low"}),
    ],
)
def test_a_range_of_motion_is_whole_or_not_at_all(form, entered, keys):
    assert read_form(form | RANGE | entered, BASE).errors.keys() == keys


def test_a_range_of_motion_is_never_kept(form):
    """A page that is loaded for the next person shows no range of the one before."""
    kept = restored_form(form | RANGE, BASE)
    assert [kept[key] for key in RANGE] == ["", "", ""]
    assert kept["subject"] == "S01"


def test_what_is_wrong_stands_at_the_field_that_is_wrong_whatever_the_sentence_names_beside_it(
    form,
):
    """The amplitude is compared with a limit that has a field, too."""
    errors = read_form(form | {"sin_amplitude": "20", "position_limit": "15"}, BASE).errors
    assert errors.keys() == {"sin_amplitude"}
    errors = read_form(form | {"epochs1": "9999"}, BASE).errors
    assert errors.keys() == {"epochs1"}
