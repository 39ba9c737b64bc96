"""The methods paragraphs say what was done in this study, and nothing else."""

import dataclasses

import pytest
from tests.unit.analysis.report.cohorts import Design, bare, made_study, of_result, of_study

from rigidimeter.analysis.estimation import METHODS, Method
from rigidimeter.analysis.report import Shown, methods_prose


@pytest.fixture(scope="module")
def study() -> Shown:
    return made_study(Design(days=(5, 4), epochs=(5, 5), scores=(4, 4)))


def test_methods_hold_the_facts_of_the_study(study: Shown) -> None:
    prose = methods_prose(study)
    text = prose.text
    assert text.startswith(
        "One subject was measured on 9 days (5 days in OFF, 4 days in DBS), in 9"
    )
    assert "45 epochs with a torque perturbation and 36 epochs with an imposed sinusoid" in text
    assert "DBS, stimulation on, 130 Hz, 0.32 mA, pulse width 60 µs" in text
    assert "±40 deg" in text
    assert "torque, angle and velocity at 100 samples/s" in text
    assert (
        "Of 81 epochs 3 were excluded: 2 that did not end with success, 1 excluded by the operator."
        in text
    )
    assert "3 examiners gave 27 ratings" in text
    assert "for each day in addition, and the conclusion on the rating is from that test." in text
    for name in ("Werning", "Young", "Gilson", "Kenward", "Hodges", "Efron", "Holm"):
        assert sum(name in reference for reference in prose.references) >= 1
    assert "Newcombe" not in text
    assert (
        "(Holm 1979): B and K were primary, other measures secondary and adjusted apart, and J was "
        "not adjusted, since it checks the instrument."
    ) in text


def test_methods_state_the_torque_that_was_commanded_to_the_epochs_that_count(
    study: Shown,
) -> None:
    out = {(one.source, one.epoch) for one in study.study.exclusions}

    def shifted(by_nm: float) -> Shown:
        epochs = []
        for k, epoch in enumerate(study.epochs):
            given = epoch.channels["perturbation_nm"]
            more_nm = 2.0 if (epoch.source, epoch.label) in out else by_nm * (k % 2)
            values = given.values - 0.05 + more_nm
            channels = epoch.channels | {given.name: dataclasses.replace(given, values=values)}
            epochs.append(dataclasses.replace(epoch, channels=channels))
        return dataclasses.replace(study, epochs=tuple(epochs))

    assert (
        "binary torque of −1.05 and +0.95 N·m (commanded, as recorded) for 20 s"
        in methods_prose(shifted(0.0)).text
    )
    assert "torque of −1.05 to −0.95 and +0.95 to +1.05 N·m (" in methods_prose(shifted(0.1)).text
    bare = [
        dataclasses.replace(
            epoch, channels={k: c for k, c in epoch.channels.items() if k != "perturbation_nm"}
        )
        for epoch in study.epochs
    ]
    unknown = methods_prose(dataclasses.replace(study, epochs=tuple(bare))).text
    assert "binary torque of ±1 N·m (as set) for 20 s" in unknown


def test_methods_take_the_text_of_an_estimator_from_outside(study: Shown) -> None:
    toy = Method("toy", "a guess", (), "by a guess of ours", METHODS[0].fit, references=("bca",))
    by_toy = of_study(study, analysis=dataclasses.replace(study.analysis, method="toy"))
    METHODS.append(toy)
    try:
        text = methods_prose(by_toy).text
    finally:
        METHODS.remove(toy)
    assert "were estimated epoch by epoch by a guess of ours (Efron 1987) in the band" in text
    assert "by the method “toy”" in methods_prose(by_toy).text


def test_methods_leave_out_what_was_not(study: Shown) -> None:
    foreign = tuple(
        dataclasses.replace(epoch, excitation_hz=None, motion=None) for epoch in study.epochs
    )
    analysis = dataclasses.replace(study.analysis, method="bandlimited")
    compared = {"comparisons": (), "values": (), "effects": {}}
    other = of_result(of_study(bare(study), analysis=analysis), **compared)
    other = dataclasses.replace(other, epochs=foreign)
    text = " ".join(methods_prose(other).paragraphs)
    for absent in ("guard", "admittance", "examiner", "Kenward", "Efron", "Young", "Holm", "rank"):
        assert absent not in text
    assert "least squares in which each frequency counts by its noise" in text
    blind = methods_prose(of_study(study, blinded=True)).text
    assert "130 Hz" not in blind
    assert "The analysis was blinded: conditions are codes" in blind
