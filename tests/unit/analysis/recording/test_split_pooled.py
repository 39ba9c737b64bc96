"""Which of the fits to several epochs is that of a condition."""

import dataclasses

import pytest
from tests.unit.analysis.report.conftest import fit

from rigidimeter.analysis.recording import split_pooled
from rigidimeter.core.records import Analysis


@pytest.mark.parametrize(
    ("recorded", "pooled", "named", "overall"),
    [
        (["OFF", "DBS"], ["OFF", "DBS", ""], ["OFF", "DBS"], True),
        (["OFF"], ["OFF"], ["OFF"], False),
        ([""], [""], [""], False),
        (["", "OFF"], ["", "OFF", ""], ["", "OFF"], True),
        (["OFF", "DBS"], ["OFF", "DBS"], ["OFF", "DBS"], False),
        (["OFF"], [], [], False),
    ],
)
def test_the_fit_to_all_conditions_is_distinguished_from_that_without_a_name(
    recorded, pooled, named, overall
) -> None:
    epochs = tuple(fit(f"{k}", name, 0.1) for name in recorded for k in range(2))
    analysis = Analysis("iv", epochs, epochs, 0.0045, ())
    fits = tuple(
        dataclasses.replace(analysis.fits[0], condition=name, epoch="pooled", n_samples=place)
        for place, name in enumerate(pooled)
    )
    by_condition, everything = split_pooled(dataclasses.replace(analysis, pooled=fits))
    assert list(by_condition) == named
    assert everything is (fits[-1] if overall else None)
