"""A known joint in many dialects: its truth as `inspect` proposes to read it, or a refusal.

No file may give a wrong number silently.
"""

import numpy as np
import pytest
from tests.dialects import DIALECTS
from tests.known_joint import TRUTH

from rigidimeter.errors import UserError
from rigidimeter.estimation import identify
from rigidimeter.recording.channels.inspection import inspect_table
from rigidimeter.recording.formats import read_recording, read_table
from rigidimeter.recording.recording import read_options


def outcome(folder, dialect):
    """Return J, B and K with their intervals at the proposed options, or why not."""
    path = folder / dialect.file
    path.write_bytes(dialect.content)
    options = read_options(**dialect.said)
    try:
        found = inspect_table(read_table(path, options), options)
        if found.proposal.unsaid:
            return "\n".join(found.proposal.unsaid)
        (epoch,), _ = read_recording(path, found.options)
    except UserError as error:
        return str(error)
    values = {name: channel.values for name, channel in epoch.channels.items()}
    stamps = epoch.channels["torque_nm"].time_s
    return identify(**values, time_s=stamps - stamps[0], method="bandlimited")


def says_the_truth(fit):
    return bool(np.all((fit.low <= TRUTH) & (fit.high >= TRUTH)))


@pytest.mark.parametrize("name", DIALECTS)
def test_a_dialect_is_read_right_or_refused(tmp_path, name):
    dialect = DIALECTS[name]
    found = outcome(tmp_path, dialect)
    if dialect.refused:
        assert isinstance(found, str), found.value
        assert dialect.refused in found
    else:
        assert not isinstance(found, str), found
        assert says_the_truth(found), (found.low, TRUTH, found.high)


def test_no_file_gives_a_wrong_number_silently(tmp_path):
    """Also without what a person would add: then most is refused, and nothing is wrong."""
    bare = {name: found for name, found in DIALECTS.items() if found.said}
    wrong = []
    for name, dialect in bare.items():
        found = outcome(tmp_path, type(dialect)(dialect.file, dialect.content))
        if not isinstance(found, str) and not says_the_truth(found):
            wrong.append(name)
    assert wrong == []
    assert len(DIALECTS) >= 40
