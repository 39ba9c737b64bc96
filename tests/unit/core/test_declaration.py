"""The primary measures are declared in `study.toml`, with the date, before the data."""

from datetime import date

import pytest
from tests.unit.core.test_extended_folder import record

from rigidimeter.core.errors import UserError
from rigidimeter.core.study_files import (
    declare_primary,
    declared_primary,
    extend_study,
    is_own,
    primary_named,
    primary_words,
    read_study_toml,
    write_new_study,
)

SEQUENCE = primary_named("stiffness,damping", "sequence", difference_percent=18.0)
TODAY = date.today()


@pytest.mark.parametrize(
    ("names", "rule", "words"),
    [
        ("stifness", "holm", '--primary stifness: unknown measure "stifness"; did you mean stiff'),
        ("mass", "holm", "known: stiffness, damping, impulse, work, rating"),
        ("inertia", "holm", "inertia checks the instrument, and is no outcome"),
        ("J", "holm", "--primary J: inertia checks the instrument"),
        ("", "holm", '--primary : unknown measure ""; known: stiffness'),
        ("stiffness,stiffness", "holm", "--primary: .*names stiffness_nm_rad twice"),
        ("stiffness", "bonferroni", "--rule bonferroni: unknown rule; write holm or sequence"),
    ],
)
def test_what_is_no_primary_measure_is_a_sentence(names, rule, words):
    with pytest.raises(UserError, match=words):
        primary_named(names, rule)


def test_measures_may_be_named_by_their_symbols():
    assert primary_named("K, B") == primary_named("stiffness,damping")


def test_a_new_study_declares_what_was_asked_for(tmp_path):
    said = declare_primary(tmp_path / "study", SEQUENCE)
    assert said.endswith(f"study.toml: declares stiffness, then damping, since {TODAY}")
    found = declared_primary(tmp_path / "study")
    assert found == SEQUENCE.model_copy(update={"declared": TODAY})
    text = (tmp_path / "study" / "study.toml").read_text()
    assert text.count("[primary]") == 1
    assert "[rating]" in text
    assert declare_primary(tmp_path / "study", SEQUENCE) == said


def test_a_study_to_which_sessions_are_added_keeps_the_declaration(tmp_path):
    """It is changed until the first session is recorded, and not afterwards."""
    declare_primary(tmp_path, primary_named("damping"), known=["OFF", "DBS"])
    declare_primary(tmp_path, SEQUENCE, known=["OFF", "DBS"])
    record(tmp_path / "a", "OFF", "DBS")
    extend_study(tmp_path)
    path = tmp_path / "study.toml"
    assert is_own(path.read_bytes())
    assert declared_primary(tmp_path).measures == SEQUENCE.measures
    assert read_study_toml(path).primary.difference_percent == 18.0
    with pytest.raises(UserError, match="a declaration is not changed after the data"):
        declare_primary(tmp_path, primary_named("damping"))


def test_a_late_declaration_is_named_late_and_leaves_the_rest_of_the_file(tmp_path):
    write_new_study(tmp_path)
    path = tmp_path / "study.toml"
    lines = path.read_text().splitlines()
    text = "\n".join(line for line in lines if not line.startswith("declared"))
    path.write_text(text.replace('rule = "holm"', 'rule = "sequence"'))
    assert declared_primary(tmp_path) is None
    record(tmp_path / "a", "OFF", "DBS")
    extend_study(tmp_path)
    said = declare_primary(tmp_path, primary_named("stiffness"))
    assert said.endswith("; sessions were recorded before")
    after = path.read_text()
    rest = [line for line in text[: text.index("[primary]")].splitlines() if line]
    assert [line for line in after.splitlines() if line][: len(rest)] == rest
    assert after.index("[rating]") < after.index("[primary]")
    assert primary_words(declared_primary(tmp_path)) == "stiffness"


def test_primary_measures_outside_a_table_are_named(tmp_path):
    write_new_study(tmp_path)
    path = tmp_path / "study.toml"
    text = path.read_text()
    begin, end = text.index("[primary]"), text.index("[rating]")
    path.write_text(f'primary.rule = "sequence"\n{text[:begin]}{text[end:]}')
    with pytest.raises(UserError, match=r"outside a table \[primary\]; put them into one"):
        declare_primary(tmp_path, SEQUENCE)
