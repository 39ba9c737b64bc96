from dataclasses import replace

import numpy as np
import pytest

from rigidimeter.records import PARAMETER_VECTORS, PARAMETERS, Fit, Outcome

FIT = Fit(
    "a.csv", "1", "OFF", "iv", Outcome(),
    value=np.array([1.0, 2.0, 3.0]), se=np.array([0.1, 0.2, 0.3]), low=np.array([0.8, 1.6, 2.4]),
    high=np.array([1.2, 2.4, 3.6]), bound=np.array([0.05, 0.15, 0.25]),
)  # fmt: skip


def test_every_entry_of_a_vector_has_its_name():
    for index, parameter in enumerate(PARAMETERS):
        for vector, ending in PARAMETER_VECTORS.items():
            assert getattr(FIT, parameter.name + ending) == getattr(FIT, vector)[index]
    assert FIT.names == ("inertia_kg_m2", "damping_nm_s_rad", "stiffness_nm_rad")


def test_a_fit_cannot_be_changed():
    with pytest.raises(ValueError, match="read-only"):
        FIT.value[0] = 7.0
    with pytest.raises(AttributeError):
        FIT.inertia_kg_m2 = 7.0


def test_a_vector_of_another_length_is_refused():
    with pytest.raises(ValueError, match=r"se of a fit must have shape \(3,\), not \(2,\)"):
        replace(FIT, se=np.zeros(2))


def test_fits_are_equal_when_every_number_is():
    assert replace(FIT) == FIT  # the covariance is NaN in both
    assert hash(replace(FIT)) == hash(FIT)
    assert replace(FIT, high=np.array([1.2, 2.4, 3.7])) != FIT
    assert replace(FIT, epoch="2") != FIT
