"""A few of the flips of `python -m tests.faults.flipped_bits`."""

import numpy as np
import pytest
from tests.faults.flipped_bits import BATCH, FILES, flip_bits, make_session


@pytest.fixture(scope="module")
def session(tmp_path_factory):
    return make_session(tmp_path_factory.mktemp("flipped") / "session")


@pytest.mark.parametrize(("name", "bits"), [*zip(FILES, (30, 10, 10), strict=True)])
def test_a_flipped_bit_is_noticed_and_costs_no_more_than_its_batch(session, name, bits):
    outcome = flip_bits(session, name, bits, np.random.default_rng(7))
    assert outcome.wrong == []
    assert outcome.most_lost <= BATCH
    assert outcome.counts["noticed"] + outcome.counts["refused"] == bits
