"""A known joint in many dialects: read as the room in use reads it, and right or refused.

No file may give a wrong number silently.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.corpus import CORPUS
from tests.known_joint import TRUTH

import rigidimeter as rm
from rigidimeter.analysis.estimation import fit_epoch
from rigidimeter.analysis.reading_anew import READERS, Mapping, mapping_of, read_file
from rigidimeter.core.errors import UserError
from rigidimeter.core.records import Epoch, Fit
from rigidimeter.core.settings import load_settings

TOLERANCE = np.array([2e-3, 2e-3, 1e-3])
"""Beside the interval: rounding of 12 and 16 bits, interpolation of a channel of 100 Hz."""
SUFFIXES = {suffix for reader in READERS for suffix in reader.suffixes} | {""}
"""And folders, of BIDS."""
ENTRIES = {
    name: entry
    for name, entry in CORPUS.items()
    if not entry.said.get("join") and {Path(one).suffix for one in entry.files} <= SUFFIXES
}
WITH_UNITS_IN_FEET = 1e-12
"""Of a factor that is computed in another order."""


def by_numbers(path: Path, said: Mapping) -> Fit | str:
    """Return the fit of a file as it is proposed to be read, or why there is none."""
    try:
        found = read_file(path, said, by_numbers=True)
    except UserError as error:
        return str(error)
    return fit_epoch(found.epochs[-1], "bandlimited", load_settings(None))


def is_true(fit: Fit) -> bool:
    slack = TOLERANCE * TRUTH
    return bool(np.all((fit.low - slack <= TRUTH) & (fit.high + slack >= TRUTH)))


def assert_same(ours: tuple[Epoch, ...], theirs: tuple[Epoch, ...]) -> None:
    assert [one.label for one in ours] == [one.label for one in theirs]
    for one, other in zip(ours, theirs, strict=True):
        assert (one.condition, one.task, one.virtual) == (
            other.condition,
            other.task,
            other.virtual,
        )
        assert set(one.channels) == set(other.channels)
        for name, channel in one.channels.items():
            there = other.channels[name]
            assert np.array_equal(channel.time_s, there.time_s)
            size = float(np.max(np.abs(there.values)))
            assert np.max(np.abs(channel.values - there.values)) <= WITH_UNITS_IN_FEET * size


@pytest.mark.parametrize("name", ENTRIES)
def test_a_dialect_is_read_as_before_and_right_or_refused(tmp_path: Path, name: str) -> None:
    entry = ENTRIES[name]
    entry.write(tmp_path)
    path, said = tmp_path / entry.files[0], mapping_of(**entry.said)
    try:
        before = rm.read(path, **entry.said)
    except UserError:
        with pytest.raises(UserError):
            read_file(path, said)
    else:
        assert_same(read_file(path, said).epochs, before.epochs)
    found = by_numbers(path, said)
    if entry.refused:
        assert isinstance(found, str), found.value
        assert entry.refused in found
    else:
        assert not isinstance(found, str), found
        assert is_true(found), (found.low, TRUTH, found.high)


def test_no_file_gives_a_wrong_number_silently(tmp_path: Path) -> None:
    """Also without what a person would add: then most is refused, and nothing is wrong."""
    bare = {name: replace(entry, said={}) for name, entry in ENTRIES.items() if entry.said}
    wrong = []
    for number, (name, entry) in enumerate(bare.items()):
        folder = tmp_path / str(number)
        folder.mkdir()
        entry.write(folder)
        found = by_numbers(folder / entry.files[0], Mapping())
        if not isinstance(found, str) and not is_true(found):
            wrong.append(name)
    assert wrong == []


def test_the_entries_are_of_every_format() -> None:
    assert len(ENTRIES) >= 160
    suffixes = {Path(one).suffix for entry in ENTRIES.values() for one in entry.files}
    assert suffixes >= {".csv", ".txt", ".lvm", ".npz", ".mat", ".nwb", ".parquet", ".arrows"}


def test_only_one_format_is_not_built_anew_yet() -> None:
    left = {Path(one).suffix for entry in CORPUS.values() for one in entry.files} - SUFFIXES
    assert left == {".acq"}
