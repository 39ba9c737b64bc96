"""The words of each kind of finding, and findings as data."""

import json
import math
import pickle
import re
from string import Formatter

import pytest

from rigidimeter.core.files import plain_values
from rigidimeter.core.findings import (
    KINDS,
    STUDY_KINDS,
    Effect,
    Finding,
    Kind,
    explained,
    finding_from,
)
from rigidimeter.core.settings import DiagnosticLevels, DiagnosticsSettings

WORDINGS = [
    pytest.param(words, id=f"{kind.name} {variant}".strip())
    for kind in KINDS.values()
    for variant, words in explained(kind)
]
TREMOR = Finding(
    "tremor",
    "caution",
    8.0,
    3.0,
    "%",
    effect=Effect((-4.0, math.nan, 0.0)),
    facts={"frequency_hz": 4.6, "amplitude_nm": 0.3, "stands_out": 12.0, "variant": ""},
)


@pytest.mark.parametrize("words", WORDINGS)
def test_words_are_few_and_complete(words):
    assert 2 <= len(words.headline.split()) <= 15
    assert words.headline[-1] not in ".,;:"
    assert 5 <= len(words.details.split()) <= 60
    assert words.details.endswith(".")
    assert words.remedy.endswith(".") or not words.remedy
    assert not re.search(r"[.!?] [A-Z]", words.remedy)  # one sentence
    for text in words:
        assert not re.search(r"[{}]|<\w|\bnan\b|\binf\b|  ", text), text


@pytest.mark.parametrize("kind", KINDS.values(), ids=KINDS)
def test_a_kind_is_complete(kind):
    if kind not in STUDY_KINDS:
        assert kind.name in DiagnosticLevels.model_fields
        assert kind.level == getattr(DiagnosticLevels(), kind.name)
    assert kind.setting in {"", *DiagnosticsSettings.model_fields}
    for variant, told in explained(kind):
        assert ", limit " not in told.headline, f"{kind.name} {variant}: a fact is missing"
    for parts in kind.variants.values():
        assert parts.keys() <= {"headline", "measured", "meaning", "remedy"}
    templates = [kind.headline, kind.measured, kind.meaning, kind.remedy]
    templates += [text for parts in kind.variants.values() for text in parts.values()]
    for text in templates:  # plain names and how they are rounded
        for _, field, spec, conversion in Formatter().parse(text):
            assert field is None or (field.isidentifier() and conversion is None)
            assert spec is None or re.fullmatch(r"\+?(\.\d)?[fg]?", spec)


def test_the_words_show_the_numbers():
    assert TREMOR.headline == "Torque oscillates at 4.6 Hz with 0.3 N·m"
    assert "8 % of the torque's variance (at most 3 %)" in TREMOR.details


def test_a_value_beside_its_limit_has_the_digits_that_tell_them_apart():
    low = Finding("r_squared", "caution", 0.2996, 0.3)
    assert low.details.startswith("R² is 0.2996 (at least 0.3).")


def test_the_last_variant_that_has_a_part_gives_it():
    kind = KINDS["missing_term"]
    assert kind.template("measured", "coupling answered") == kind.variants["coupling"]["measured"]
    assert kind.template("meaning", "coupling answered") == kind.variants["answered"]["meaning"]
    assert kind.template("remedy", "several") == kind.variants["several"]["remedy"]
    assert kind.template("remedy", "several answered") == ""
    assert kind.template("remedy", "negligible") == ""


TERMS = {
    "one": {"terms": "friction", "sizes": "friction of 0.1 ± 0.0002 N·m"},
    "several": {
        "terms": "directional damping, directional stiffness and a soft coupling",
        "sizes": "directional damping of 0.1 ± 0.02 N·m·s/rad, directional stiffness of 0.2 ± 0.02 "
        "N·m/rad and a soft coupling of 0.01 ± 0.001 rad/(N·m)",
    },
}


@pytest.mark.parametrize("count", TERMS)
@pytest.mark.parametrize(
    ("variant", "headline", "details"),
    [
        (
            "answered",
            "J, B and K are those beside {terms}",
            "J, B and K are those beside that; without it they would be J +16 %, B 0 %, K −1 %.",
        ),
        ("beside", "The torque holds {terms}, and perhaps more", "linear remains cannot be tested"),
        ("withheld", "No estimate: the torque holds more than {terms}", "too (p = 2.0·10⁻⁵), J, B"),
    ],
)
def test_a_term_is_told_with_what_it_leaves(count, variant, headline, details):
    facts = {**TERMS[count], "asked": "coulomb", "remains": 2e-5, "variant": f"{count} {variant}"}
    effect = Effect((16.0, 0.0, -1.0))
    told = Finding("missing_term", "note", 900.0, 100.0, p=1e-12, effect=effect, facts=facts)
    assert told.headline == headline.format_map(facts)
    assert told.details.startswith(f"The torque holds {facts['sizes']} (p < 10⁻⁶). ")
    assert details in told.details
    assert len(told.headline.split()) <= 15
    assert len(told.details.split()) <= 60
    assert told.harmless == (variant == "answered")


def test_each_variant_says_when_it_is_used():
    used = [when for kind in KINDS.values() for when, _ in explained(kind)]
    assert not [when for when in used if "When it is" in when]


def test_nothing_is_to_be_done_about_what_changes_nothing():
    """Nor is a method that used the recorded perturbation asked to record it."""
    for kind in KINDS.values():
        for when, words in explained(kind):
            if "intervals include it" in words.details or when.endswith("as the instrument"):
                assert "record the perturbation" not in words.remedy.lower(), kind.name
    voluntary = Finding(
        "voluntary_torque",
        "note",
        77.0,
        15.0,
        facts={
            "sd_nm": 0.2,
            "low_hz": 0.3,
            "high_hz": 4.0,
            "method": "iv",
            "variant": "instrument",
        },
    )
    assert voluntary.remedy == ""
    assert voluntary.harmless


def test_a_kind_that_is_not_known_is_told_by_its_numbers(monkeypatch):
    finding = Finding("near_range", "caution", 9.7, 9.0, "N·m")
    assert finding.headline == "near range: 9.7 N·m, limit 9 N·m"
    brought = Kind("near_range", "peak", "Peak {value:.2g}", "A.", "B.", "C.", level="note")
    monkeypatch.setitem(KINDS, "near_range", brought)
    assert (finding.headline, finding.details, finding.remedy) == ("Peak 9.7", "A. B.", "C.")
    assert DiagnosticLevels().of("near_range") == "note"


def test_a_finding_is_read_back_equal():
    written = json.loads(json.dumps(plain_values(TREMOR.row()), allow_nan=False))
    assert finding_from(written) == TREMOR
    assert pickle.loads(pickle.dumps(TREMOR)) == TREMOR
    assert finding_from({**written, "value": 8.1}) != TREMOR


@pytest.mark.parametrize(
    ("percent", "half_intervals", "negligible"),
    [
        ((0.9, -0.9, 0.0), (0.9, -0.9, 0.0), True),
        ((1.1, 0.0, 0.0), (0.1, 0.0, 0.0), False),
        ((0.1, 0.0, 0.0), (-1.1, 0.0, 0.0), False),
        ((0.1, 0.0, math.nan), (0.1, 0.0, math.nan), False),
        ((0.1, 0.0, 0.0), (math.nan,) * 3, False),
    ],
)
def test_an_effect_is_negligible_below_one_percent_and_half_the_interval(
    percent, half_intervals, negligible
):
    assert Effect(percent, half_intervals).negligible == negligible


def test_an_effect_is_a_share_of_what_the_estimate_would_be_without_it_and_of_half_its_interval():
    """A B of 0.269 that holds 0.169 of friction is 169 % too high, not 63 %."""
    (percent,) = {Effect.of((0.169,) * 3, (0.269,) * 3, (0.01,) * 3).percent[1]}
    assert percent == pytest.approx(169.0)
    effect = Effect.of((-1e-4, 0.02, 0.0), (1e-3, -0.1, 2.0), (2e-4, 0.01, 0.1))
    assert effect.percent == pytest.approx((-100 / 11, 100 / 6, 0.0))
    assert effect.half_intervals == pytest.approx((-0.5, 2.0, 0.0))


@pytest.mark.parametrize(
    ("percent", "shown"), [(890.0, "K above +100 %"), (-340.0, "K below −100 %"), (99.0, "K +99 %")]
)
def test_an_effect_larger_than_what_is_left_has_no_number(percent, shown):
    """A bias of 2.0 in an estimate of 2.13 leaves 0.13 ± 0.3: of that it is any percentage."""
    found = Finding("loop_bias", "caution", 180.0, 50.0, "%", effect=Effect((1.0, -2.0, percent)))
    assert found.headline.endswith(f"J +1 %, B −2 %, {shown}")
    assert found.effect.percent[2] == percent
