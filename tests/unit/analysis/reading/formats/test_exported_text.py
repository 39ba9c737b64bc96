"""Marks between thousands, and the sections and heads of Vicon Nexus and Qualisys."""

import numpy as np
import pytest
from tests.laboratory_exports import D, M, qualisys, vicon

from rigidimeter.analysis.reading.formats import read_table
from rigidimeter.analysis.reading.formats.grouped_numbers import ungrouped
from rigidimeter.core.errors import UserError


@pytest.mark.parametrize(
    ("rows", "delimiter"),
    [
        ("1,234;2,345\n5,678;9,012", ";"),
        ('"1.234","2.345"\n"5.678","9.012"', ","),
        ("1,234.5\t0,5", "\t"),
        ("0.005;0,512\n1.005;1,512", ";"),
        ("0.005\t1,5\n1.005\t1,512", "\t"),
        ("1\t234\t567\n2\t345\t678", "\t"),
        ("12:00:01,234;1.5", ";"),
        ("01.02.2024;1,5\n1,500;2", ";"),
        ("1.500,5,2.5,3", ","),
    ],
)
def test_what_may_be_a_decimal_mark_stays(rows, delimiter):
    assert ungrouped(rows.encode(), delimiter).decode() == rows


def table(path, text):
    path.write_text(text, "utf-8")
    return read_table(path)


@pytest.mark.parametrize(
    ("was", "now", "told"),
    [
        ("Outputs\n100\n", "Outputs\n120\n", "different frames/s (Devices 100, Model Outputs 120)"),
        ("Outputs\n100\n", "Outputs\n0\n", "a rate of 0 samples/s"),
        ("Sub Frame,X,Y,Z", "Sub Frame", "line 4007: the section Model Outputs that begins here"),
        ("\n30,0,", "\nx,0,", "the section Model Outputs that begins here cannot be read"),
        ("\n30,0,", "\n29,0,", "do not increase"),
    ],
)
def test_a_damaged_export_of_vicon_is_refused(tmp_path, was, now, told):
    device, model = vicon().split("Model", 1)
    with pytest.raises(UserError) as caught:
        table(tmp_path / "r.csv", device + ("Model" + model).replace(was, now, 1))
    assert told in str(caught.value)


def test_empty_cells_of_vicon_are_missing(tmp_path):
    text = vicon().replace(f"\n1,1,{1e3 * M[1]:.9g},", "\n1,1,,")
    found = table(tmp_path / "r.csv", text)
    assert np.flatnonzero(np.isnan(found.columns["Elbow cell - Moment Mz"]))[0] == 1


def test_the_keys_of_qualisys(tmp_path):
    found = table(tmp_path / "r.tsv", qualisys(("T", "A"), heading=False))
    assert found.scalars == {"rate_hz": 200.0}
    np.testing.assert_allclose(found.columns["A"], D, rtol=1e-8)
    text = qualisys(("hand", "wrist"), heading=False).replace("CHANNEL_NAMES", "MARKER_NAMES")
    rows = "\n".join(["1\t2\t3\t4\t5\t6"] * 5)
    head = "\n".join(text.split("\n")[:7])
    found = table(tmp_path / "m.tsv", f"{head}\n{rows}\n")
    assert list(found.columns) == [f"{name} {axis}" for name in ("hand", "wrist") for axis in "XYZ"]
    assert found.lines[0] == 8
    with pytest.raises(UserError, match="the head of this Qualisys file is not complete"):
        table(tmp_path / "d.tsv", text.replace("FREQUENCY\t200", "FREQUENCY\tx"))
