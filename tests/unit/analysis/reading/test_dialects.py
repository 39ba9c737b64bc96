"""A known joint in many dialects: its truth as `inspect` proposes to read it, or a refusal.

No file may give a wrong number silently.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.corpus import CORPUS, Entry
from tests.known_joint import TRUTH

from rigidimeter.analysis.estimation import fit_epoch
from rigidimeter.analysis.reading.channels.inspection import inspect_table
from rigidimeter.analysis.reading.channels.joining import join_tables, joined_options
from rigidimeter.analysis.reading.formats import read_table
from rigidimeter.analysis.reading.formats.table_epochs import epochs_from_table
from rigidimeter.analysis.reading.recording import read_options
from rigidimeter.core.errors import UserError
from rigidimeter.core.settings import load_settings

TOLERANCE = np.array([2e-3, 2e-3, 1e-3])
"""Beside the interval: rounding of 12 and 16 bits, interpolation of a channel of 100 Hz."""


def outcome(folder: Path, entry: Entry):
    """Return the fit at the proposed options, or why there is none."""
    folder.mkdir(exist_ok=True)
    entry.write(folder)
    said = dict(entry.said)
    joins, offset = said.pop("join", False), said.pop("clock_offset", None)
    options = read_options(**said)
    try:
        tables = [read_table(folder / name, options) for name in entry.files]
        table = tables[0]
        if joins:
            table, _ = join_tables(tables, options, offset)
            options = joined_options(options)
        found = inspect_table(table, options)
        if found.proposal.unsaid:
            return "\n".join(found.proposal.unsaid)
        epochs, _ = epochs_from_table(table, found.options)
    except UserError as error:
        return str(error)
    return fit_epoch(epochs[-1], "bandlimited", load_settings(None))


def says_the_truth(fit) -> bool:
    slack = TOLERANCE * TRUTH
    return bool(np.all((fit.low - slack <= TRUTH) & (fit.high + slack >= TRUTH)))


@pytest.mark.parametrize("name", CORPUS)
def test_a_dialect_is_read_right_or_refused(tmp_path, name):
    entry = CORPUS[name]
    found = outcome(tmp_path, entry)
    if entry.refused:
        assert isinstance(found, str), found.value
        assert entry.refused in found
        return
    assert not isinstance(found, str), found
    assert says_the_truth(found), (found.low, TRUTH, found.high)


def test_no_file_gives_a_wrong_number_silently(tmp_path):
    """Also without what a person would add: then most is refused, and nothing is wrong."""
    bare = {name: entry for name, entry in CORPUS.items() if entry.said}
    wrong = []
    for number, (name, entry) in enumerate(bare.items()):
        found = outcome(tmp_path / str(number), replace(entry, said={}))
        if not isinstance(found, str) and not says_the_truth(found):
            wrong.append(name)
    assert wrong == []


def test_the_corpus_has_what_was_promised():
    assert len(CORPUS) >= 60
    suffixes = {Path(name).suffix for entry in CORPUS.values() for name in entry.files}
    assert len(suffixes) >= 18
