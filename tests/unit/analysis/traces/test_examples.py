"""Which epochs stand for a condition, and as what."""

import dataclasses

import numpy as np

from rigidimeter.analysis.report import Shown
from rigidimeter.analysis.traces import analysed_epoch, perturbed_epoch, representative_fits
from rigidimeter.core.records import Delay, Outcome


def test_the_representative_is_the_included_fit_with_the_median_stiffness(make_analysis) -> None:
    analysis = make_analysis({"OFF": 5, "DBS": 4})
    values = [2.3, 1.6, 1.8, 2.9, 1.7, 1.5, 1.1, 1.3, 1.2]
    fits = [
        dataclasses.replace(fit, value=(0.004, 0.1, stiffness))
        for fit, stiffness in zip(analysis.fits, values, strict=True)
    ]
    fits[3] = dataclasses.replace(fits[3], outcome=Outcome("excluded", "limit"))
    fits[0] = dataclasses.replace(fits[0], outcome=Outcome("excluded", "limit"))
    found = representative_fits(dataclasses.replace(analysis, fits=tuple(fits)), ["OFF", "DBS"])
    chosen = [(fit.condition, fit.stiffness_nm_rad) for fit in found]
    # Three are left of OFF; of the four of DBS the lower middle one is taken.
    assert chosen == [("OFF", 1.7), ("DBS", 1.2)]


def test_an_epoch_is_on_the_clock_it_was_analysed_on(
    study: Shown, make_study, make_analysis
) -> None:
    epoch = study.epochs[1]
    analysis = make_analysis({"OFF": 1})
    late = Delay(epoch.source, 0.012, 0.001, corrected=True)
    made = make_study([epoch], analysis=dataclasses.replace(analysis, delays=(late,)))
    fit = dataclasses.replace(analysis.fits[0], source=epoch.source, epoch=epoch.label)
    moved = analysed_epoch(made.as_analysed, fit)
    assert moved is not None
    np.testing.assert_allclose(
        moved.channels["torque_nm"].time_s, epoch.channels["torque_nm"].time_s - 0.012
    )
    assert moved.channels["angle_rad"] is epoch.channels["angle_rad"]
    assert analysed_epoch(made.as_analysed, analysis.fits[0]) is None


def test_the_perturbation_of_an_example_is_drawn_if_any_epoch_has_one(study: Shown) -> None:
    names, without = study.condition_names, [e for e in study.epochs if e.task == "sinusoid"]
    first = representative_fits(study.analysis, names)[0]
    shown = perturbed_epoch(study.analysis, names, study.as_analysed, study.epochs)
    assert shown is not None
    assert (shown.source, shown.label) == (first.source, first.epoch)
    assert perturbed_epoch(study.analysis, names, {}, without) is None
