"""What the picture of a file shows of its columns."""

import numpy as np
from tests.known_joint import angle_rad, torque_nm

from rigidimeter.analysis.figures import columns_figure
from rigidimeter.analysis.reading.channels.inspection import inspect_table
from rigidimeter.analysis.reading.formats.read_options import ReadOptions
from rigidimeter.analysis.reading.formats.table import Table

TIME_S = np.arange(1200) / 100.0


def test_each_column_but_the_time_with_every_value_and_its_unit():
    angle = np.degrees(angle_rad(TIME_S))
    angle[1::2] = np.nan  # a slower clock: every other row is empty
    columns = {
        "Zeit [s]": TIME_S,
        "M [Nm]": torque_nm(TIME_S),
        "phi": angle,
        "note": np.full(TIME_S.size, "a", dtype=object),
    }
    options = ReadOptions({"angle_rad": "phi"}, units={"angle_rad": "deg"})
    panes = columns_figure(inspect_table(Table("r.csv", columns), options)).axes
    titles = [pane.get_title(loc="left") for pane in panes]
    assert titles == ["M [Nm], read as torque_nm", "phi, read as angle_rad"]
    assert [pane.get_ylabel() for pane in panes] == ["Nm", "deg"]
    assert panes[-1].get_xlabel() == "time (s)"
    time, drawn = panes[1].lines[0].get_data()
    np.testing.assert_array_equal(time, TIME_S[::2])
    np.testing.assert_array_equal(drawn, angle[::2])


def test_no_line_crosses_a_gap():
    time_s = TIME_S + np.where(np.arange(TIME_S.size) < 500, 0.0, 30.0)
    columns = {"t_s": time_s, "torque_nm": torque_nm(TIME_S), "angle_rad": angle_rad(TIME_S)}
    (pane, _) = columns_figure(inspect_table(Table("r.csv", columns), ReadOptions())).axes
    _, drawn = pane.lines[0].get_data()
    np.testing.assert_array_equal(np.flatnonzero(np.isnan(drawn)), [500])
    np.testing.assert_array_equal(drawn[np.isfinite(drawn)], columns["torque_nm"])
