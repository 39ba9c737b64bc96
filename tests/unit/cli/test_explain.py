"""`rigidimeter explain`: every finding is listed, and each is explained."""

import pytest

from rigidimeter.core.findings import KINDS, STUDY_KINDS, explained


def test_every_finding_is_listed_with_its_level(rigidimeter):
    ran = rigidimeter("explain")
    assert ran.status == 0
    listed = [line.split() for line in ran.out.splitlines() if line.split()[:1]]
    for kind in KINDS.values():
        assert [kind.name, kind.level] in listed


@pytest.mark.parametrize("kind", KINDS.values(), ids=KINDS)
def test_a_finding_is_explained_with_its_settings(rigidimeter, kind):
    ran = rigidimeter("explain", kind.name)
    assert ran.status == 0
    told = " ".join(ran.out.split())
    for when, words in explained(kind):
        assert f"{when}:" in told
        for text in words:
            assert text in told
    in_settings = f'diagnostics.levels.{kind.name} = "{kind.level}"' in told
    assert in_settings == (kind not in STUDY_KINDS)
    assert not kind.setting or f"diagnostics.{kind.setting} = " in told


def test_what_is_below_half_an_interval_is_small_in_its_example(rigidimeter):
    told = " ".join(rigidimeter("explain", "loop_bias").out.split())
    negligible = told.split("When the effect is negligible: ")[1].split("When ")[0]
    assert negligible.startswith("Torque not from the robot biases J −0.4 %, B +0.31 %, K 0 %")
    assert "74 % of half their intervals" in negligible
    assert negligible.endswith("half their intervals. Nothing has to be done. ")


def test_a_name_that_is_none_is_answered_with_the_nearest(rigidimeter):
    ran = rigidimeter("explain", "tremer")
    assert ran.status == 1
    assert ran.err.strip() == "rigidimeter: no finding is called 'tremer'; is it tremor?"
