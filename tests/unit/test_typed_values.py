"""Records come back from JSON as they were, and nothing that a file says makes anything else."""

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from rigidimeter.documents.typed_values import Records, WrongValue, plain_of


class Pair(NamedTuple):
    """A named tuple, which is a record, too."""

    first: int
    second: str | None = None


@dataclass(frozen=True)
class Measured:
    """A record with everything that a record may hold."""

    level: Literal["note", "doubt"]
    number: float
    band_hz: tuple[float, float] | None
    pairs: tuple[Pair, ...]
    by_name: Mapping[str, float]
    values: NDArray[np.float64]
    response: NDArray[np.complex128]


def measured(**changed: Any) -> Measured:
    values = np.array([[0.1, -0.0], [np.nan, np.inf]])
    fields = {
        "level": "note",
        "number": np.float64(0.1),
        "band_hz": None,
        "pairs": (Pair(1), Pair(2, "b")),
        "by_name": {"a": -math.inf},
        "values": values,
        "response": np.array([1 + 2j]),
    }
    return Measured(**fields | changed)  # type: ignore[arg-type]


def again(value: Any, hint: Any) -> Any:
    return Records().read(hint, json.loads(json.dumps(plain_of(value), allow_nan=False)))


def test_a_record_comes_back_to_the_bit() -> None:
    one = measured()
    two = again(one, Measured)
    assert (two.level, two.number, two.band_hz, two.pairs, two.by_name) == (
        one.level,
        one.number,
        one.band_hz,
        one.pairs,
        one.by_name,
    )
    assert (two.values.tobytes(), two.values.shape) == (one.values.tobytes(), (2, 2))
    assert two.response.tobytes() == one.response.tobytes()


@given(st.floats())
def test_every_number_comes_back(number: float) -> None:
    found = again(number, float)
    assert np.float64(found).tobytes() == np.float64(number).tobytes() or math.isnan(number)


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("level", "grave"),
        ("number", "0.1"),
        ("number", True),
        ("band_hz", [1.0]),
        ("band_hz", {"__class__": "os.system"}),
        ("pairs", [{"first": 1}]),
        ("pairs", [{"first": 1.5, "second": None}]),
        ("by_name", [1.0]),
        ("values", [1.0]),
        ("values", {"kind": "|O", "shape": [1], "data": ""}),
        ("values", {"kind": "<f8", "shape": [-1], "data": ""}),
        ("values", {"kind": "<f8", "shape": [1], "data": "no base64"}),
        ("values", {"kind": "<f8", "shape": [1], "data": "AAAA"}),
        ("added", 1),
    ],
)
def test_what_is_not_of_its_type_is_refused(field: str, value: object) -> None:
    with pytest.raises(WrongValue):
        Records().read(Measured, plain_of(measured()) | {field: value})


def test_arrays_are_bounded_together() -> None:
    zeros = plain_of((np.zeros(1000), np.zeros(1000)))
    hint = tuple[NDArray[np.float64], ...]
    assert len(Records(16_000).read(hint, zeros)) == 2
    with pytest.raises(WrongValue):
        Records(15_999).read(hint, zeros)


def test_an_array_that_expands_beyond_its_shape_is_refused() -> None:
    large = plain_of(np.zeros(100_000)) | {"shape": [10]}
    with pytest.raises(WrongValue):
        Records().read(NDArray[np.float64], large)


def test_what_is_no_record_is_not_written() -> None:
    with pytest.raises(TypeError, match="object is not written"):
        plain_of(object())
