from dataclasses import replace

import numpy as np
import pytest

from rigidimeter.analysis.estimation import choose_method, fit_epochs
from rigidimeter.analysis.estimation.methods import method_named
from rigidimeter.analysis.estimation.prepared import prepare
from rigidimeter.core.records import Channel, Outcome
from rigidimeter.core.settings import ControllerSettings
from rigidimeter.virtual import PAPER_RATES

NAMES = ("inertia_kg_m2", "damping_nm_s_rad", "stiffness_nm_rad")


def values(fit, ending=""):
    return np.array([getattr(fit, name + ending) for name in NAMES])


def without(epoch, *names):
    return replace(epoch, channels={k: c for k, c in epoch.channels.items() if k not in names})


@pytest.mark.parametrize("method", ["iv", "spectral"])
def test_a_quiet_subject_is_found_to_the_noise(simulated, truth, method):
    settings, epochs = simulated(4)
    fits, (pooled,) = fit_epochs(epochs, method, settings)
    for fit in fits:
        assert np.all(np.abs(values(fit) - truth) < 5 * values(fit, "_se"))
        assert np.all(values(fit, "_se") < [0.001 * p for p in truth])
        assert np.all(values(fit, "_low") < values(fit)), "the interval holds its estimate"
        assert fit.outcome.included
    for fit in (*fits, pooled):
        np.testing.assert_allclose(np.sqrt(np.diag(fit.covariance)), fit.se, rtol=1e-12)
        np.testing.assert_allclose(fit.covariance, fit.covariance.T, rtol=1e-9)
    assert pooled.epoch == "pooled"
    # Four times the information: half the error.
    ratio = values(pooled, "_se") / np.mean([values(fit, "_se") for fit in fits], axis=0)
    np.testing.assert_allclose(ratio, 0.5, atol=0.1)


@pytest.fixture(scope="module")
def pushed(simulated):
    """Return epochs of a subject who pushes, and what is found in them whatever the method."""
    settings, epochs = simulated(24, voluntary_sd_nm=0.2, seed=5)
    return settings, epochs, prepare(epochs, settings)


def fitted(prepared, method):
    return method_named(method).fit(prepared, None, lambda _: None, True)


@pytest.mark.parametrize("method", ["iv", "spectral", "bandlimited"])
def test_a_subject_who_pushes_does_not_bias_the_pooled_estimate(pushed, truth, method):
    *_, prepared = pushed
    fits, (pooled,) = fitted(prepared, method)
    error = values(pooled) / truth - 1
    assert np.all(np.abs(values(pooled) - truth) < 4 * values(pooled, "_se"))
    assert np.all(np.abs(error) < [0.01, 0.05, 0.05])
    unweighted = np.mean([values(f) for f in fitted(prepared, "published")[0]], axis=0)
    assert unweighted[1] / truth[1] < 0.7
    assert all(fit.outcome.included for fit in fits)


def test_a_wrong_controller_costs_precision_and_not_truth(pushed, truth):
    settings, epochs, prepared = pushed
    right = fitted(prepared, "iv")[1][0]
    wrong_controller = ControllerSettings(inertia_kg_m2=0.01, damping_nm_s_rad=0.5)
    wrong = fit_epochs(epochs, "iv", settings.model_copy(update={"controller": wrong_controller}))[
        1
    ][0]
    assert np.all(np.abs(values(wrong) - truth) < 4 * values(wrong, "_se"))
    assert np.all(values(wrong, "_se") >= 0.95 * values(right, "_se"))


def test_the_papers_rates_with_jitter(simulated, truth):
    settings, epochs = simulated(6, seed=3, **PAPER_RATES)
    (pooled,) = fit_epochs(epochs, "iv", settings)[1]
    assert np.all(np.abs(values(pooled) / truth - 1) < [0.004, 0.004, 0.002])


def test_without_command_the_motion_is_interpolated(simulated, truth):
    settings, epochs = simulated(4, voluntary_sd_nm=0.1)
    bare = [without(epoch, "velocity_command_rad_s") for epoch in epochs]
    (pooled,) = fit_epochs(bare, "iv", settings)[1]
    # What the stairs of the command hide is then missing: 0.8 % of J.
    assert values(pooled)[0] / truth[0] == pytest.approx(0.992, abs=0.012)
    assert np.all(np.abs(values(pooled) / truth - 1) < [0.02, 0.12, 0.12])


def test_the_inertia_may_be_held(simulated, truth):
    settings, epochs = simulated(2)
    fits, pooled = fit_epochs(epochs, "iv", settings, inertia_kg_m2=0.0045)
    for fit in [*fits, *pooled]:
        assert (fit.inertia_kg_m2, fit.inertia_kg_m2_se) == (0.0045, 0.0)
        assert not fit.covariance[0].any()
        np.testing.assert_allclose(np.sqrt(np.diag(fit.covariance)), fit.se, rtol=1e-12)
        assert np.all(np.abs(values(fit) / truth - 1)[1:] < 0.004)


def test_conditions_are_pooled_apart_and_together(simulated):
    settings, epochs = simulated(4)
    mixed = [replace(e, condition=c) for e, c in zip(epochs, ["OFF", "DBS"] * 2, strict=True)]
    _, pooled = fit_epochs(mixed, "iv", settings)
    assert [fit.condition for fit in pooled] == ["OFF", "DBS", ""]
    assert [fit.n_samples for fit in pooled][2] == 2 * pooled[0].n_samples


def test_an_epoch_that_did_not_end_well_does_not_count_in_the_pool(simulated):
    settings, epochs = simulated(3)
    bad = replace(epochs[0], closed=Outcome("excluded", "it touched the limit"))
    fits, (pooled,) = fit_epochs([bad, *epochs[1:]], "iv", settings)
    assert [fit.outcome.kind for fit in fits] == ["excluded", "included", "included"]
    assert pooled.n_samples == fits[1].n_samples + fits[2].n_samples


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda e: without(e, "perturbation_nm"), "perturbation_nm was not recorded"),
        (lambda e: without(e, "torque_nm"), "torque_nm was not recorded"),
        (
            lambda e: replace(
                e,
                channels={
                    **e.channels,
                    "perturbation_nm": Channel(
                        "perturbation_nm", e.channels["perturbation_nm"].time_s, np.zeros(20000)
                    ),
                },
            ),
            "perturbation_nm is constant",
        ),
    ],
)
def test_an_epoch_that_cannot_be_fitted_says_why(simulated, change, words):
    settings, (epoch,) = simulated()
    (fit,), pooled = fit_epochs([change(epoch)], "iv", settings)
    assert fit.outcome.kind == "failed"
    assert words in fit.outcome.reason
    assert pooled == []


def test_spectral_needs_two_periods(simulated):
    settings, (epoch,) = simulated()
    short = replace(epoch, channels={
        k: Channel(k, c.time_s[:11000], c.values[:11000]) for k, c in epoch.channels.items()
    })  # fmt: skip
    (fit,), _ = fit_epochs([short], "spectral", settings)
    assert "twice in the 11 s in a row" in fit.outcome.reason
    assert "two whole periods" in fit.outcome.reason
    assert "--method iv" in fit.outcome.reason


def test_auto_chooses_by_what_was_recorded(simulated):
    settings, (epoch,) = simulated()

    def chosen(*epochs):
        return choose_method(prepare(epochs, settings))

    assert chosen(epoch)[0] == "iv"
    bare = without(epoch, "perturbation_nm")
    method, why = chosen(epoch, epoch, bare)
    assert method == "iv"
    assert "in 2 of 3 epochs" in why
    method, why = chosen(epoch, bare, bare)
    assert method == "bandlimited"
    assert "perturbation_nm was not recorded (in 2 of 3 epochs)" in why


@pytest.mark.parametrize("voluntary_sd_nm", [0.0, 0.5])
def test_auto_needs_a_motion_that_follows_the_perturbation(simulated, voluntary_sd_nm):
    settings, (epoch,) = simulated(voluntary_sd_nm=voluntary_sd_nm)
    assert choose_method(prepare([epoch], settings))[0] == "iv"
    cause = epoch.channels["perturbation_nm"]
    others = {
        "of another epoch": np.random.default_rng(3).permutation(cause.values),
        "of another clock": np.roll(cause.values, 2345),
    }
    for values in others.values():
        channels = {**epoch.channels, cause.name: Channel(cause.name, cause.time_s, values)}
        method, why = choose_method(prepare([replace(epoch, channels=channels)], settings))
        assert method == "bandlimited"
        assert "the motion does not follow perturbation_nm" in why
        assert "--method iv uses it all the same" in why
