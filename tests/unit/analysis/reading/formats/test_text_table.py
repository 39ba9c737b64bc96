"""Marks of missing samples, labels and line numbers of text files."""

import numpy as np
import pytest

from rigidimeter.analysis.reading.formats.read_options import ReadOptions
from rigidimeter.analysis.reading.formats.readers import read_recording
from rigidimeter.core.errors import UserError
from rigidimeter.core.files import read_text_table

PLAIN = "time_s,torque_nm,angle_rad\n0.0,1.5,-0.25\n0.5,-2e-3,0.75\n1.0,3,0\n"


@pytest.mark.parametrize("mark", ["", "NaN", "nan", "NA", "N/A", " NA", "#N/A", "null"])
def test_marks_of_missing_samples(tmp_path, mark):
    path = tmp_path / "r.csv"
    rows = [f"{k / 100},{k % 3 + 0.5},0.1" for k in range(20)]
    rows[7] = f"0.07,{mark},0.1"
    path.write_text("time_s,torque_nm,angle_rad\n" + "\n".join(rows))
    (epoch,), (notice,) = read_recording(path, ReadOptions())
    assert notice.level == "error"
    assert "torque_nm has 1 sample missing or not finite, at 0.07 s" in notice.text
    assert 0.07 not in epoch.channels["torque_nm"].time_s
    assert len(epoch.channels["angle_rad"]) == 20


def test_a_missing_mark_in_the_first_column_is_not_a_comment(tmp_path):
    path = tmp_path / "r.csv"
    path.write_text("torque_nm,time_s,angle_rad\n1,0,1\n#N/A,1,1\n2,2,1\n3,3,1\n")
    (epoch,), notices = read_recording(path, ReadOptions())
    assert len(epoch.channels["angle_rad"]) == 4
    assert [notice.level for notice in notices if "has 1 sample" in notice.text] == ["error"]


def test_line_numbers_count_comments_and_blank_lines(tmp_path):
    path = tmp_path / "r.csv"
    path.write_text("# one\n\n" + PLAIN + "# seven\n1.5,abc,0\n")
    with pytest.raises(UserError, match=r"r\.csv, line 8: torque_nm holds 'abc', which is not a"):
        read_recording(path, ReadOptions())


def test_text_far_down_a_column_is_found(tmp_path):
    path = tmp_path / "r.csv"
    rows = "".join(f"{k / 1000},{k % 9},0\n" for k in range(200_000))
    path.write_text("time_s,torque_nm,angle_rad\n" + rows + "200,1,0.5 V\n")
    _, notices = read_recording(path, ReadOptions())
    assert notices[0].level == "error"
    assert "line 200002: angle_rad holds '0.5 V'" in notices[0].text


def test_a_row_of_units_or_a_column_of_text_is_refused(tmp_path):
    path = tmp_path / "r.csv"
    rows = "".join(f"{k / 1000},{k % 7},{k % 5}\n" for k in range(2000))
    path.write_text("time_s,torque_nm,angle_rad\n-0.001,N·m,rad\n" + rows)
    with pytest.raises(UserError, match=r"line 2: torque_nm holds 'N·m'"):
        read_recording(path, ReadOptions())
    words = "".join(f"{k / 1000},{'x' if k % 50 == 9 else k},0\n" for k in range(2000))
    path.write_text("time_s,torque_nm,angle_rad\n" + words)
    with pytest.raises(UserError, match=r"line 11: torque_nm holds 'x'"):
        read_recording(path, ReadOptions())


def test_an_epoch_whose_condition_changes_is_lost_alone(tmp_path):
    path = tmp_path / "r.csv"
    rows = "".join(
        f"{k / 100},{k % 7},{k % 5 / 100},{1 + k // 1000},{'DBS' if k == 500 else 'OFF'}\n"
        for k in range(2000)
    )
    path.write_text("time_s,torque_nm,angle_rad,epoch,condition\n" + rows)
    (epoch,), (notice,) = read_recording(path, ReadOptions())
    assert epoch.label == "2"
    assert notice.level == "error"
    assert "condition changes from OFF to DBS within epoch 1" in notice.text


def test_a_date_in_a_column_of_numbers_is_text(tmp_path):
    path = tmp_path / "r.csv"
    path.write_text("time_s,torque_nm,angle_rad\n0,12:30:00,2\n1,12:30:01,2\n")
    with pytest.raises(UserError, match=r"line 2: torque_nm holds '12:30:00'"):
        read_recording(path, ReadOptions())


def test_labels_with_a_decimal_comma_file(tmp_path):
    path = tmp_path / "r.csv"
    path.write_text(
        "time_s;torque_nm;angle_rad;condition\n0,0;1,5;1;DBS, left\n0,1;2,5;1;DBS, left\n"
    )
    (epoch,), _ = read_recording(path, ReadOptions())
    assert epoch.condition == "DBS, left"
    np.testing.assert_array_equal(epoch.channels["torque_nm"].values, [1.5, 2.5])


def test_a_nameless_column_has_its_number(tmp_path):
    path = tmp_path / "r.csv"
    path.write_text(",torque_nm,angle_rad\n0,1,2\n1,2,3\n")
    options = ReadOptions(columns={"time_s": "column 1"})
    assert len(read_recording(path, options)[0]) == 1


def test_whole_numbers_as_labels(tmp_path):
    path = tmp_path / "r.csv"
    path.write_text(
        "time_s,torque_nm,angle_rad,epoch\n0,1,2,1\n1,1,2,1\n2,1,2,\n3,1,2,2\n4,1,2,2\n"
    )
    epochs, _ = read_recording(path, ReadOptions())
    assert [epoch.label for epoch in epochs] == ["1", "2"]


def test_what_windows_writes_in_western_europe(tmp_path):
    path = tmp_path / "r.csv"
    path.write_bytes(
        "t;torque_nm;Winkel (°);condition\n0;1,5;2;früh\n0,1;2,5;3;früh\n".encode("cp1252")
    )
    options = ReadOptions(columns={"time_s": "t", "angle_rad": "Winkel (°)"})
    (epoch,), notices = read_recording(path, options)
    assert notices == []
    assert epoch.condition == "früh"
    np.testing.assert_allclose(epoch.channels["angle_rad"].values, np.radians([2, 3]))


def test_labels_that_look_like_truth_values_stay_as_written(tmp_path):
    path = tmp_path / "r.csv"
    path.write_text("time_s,torque_nm,angle_rad,condition\n0,1,2,TRUE\n1,2,3,TRUE\n")
    assert read_recording(path, ReadOptions())[0][0].condition == "TRUE"


@pytest.fixture
def table(tmp_path):
    def write(text: str):
        path = tmp_path / "labels.csv"
        path.write_text(text)
        return read_text_table(path)

    return write


def test_a_small_table_keeps_its_text_and_its_lines(table):
    found = table('# made by hand\ncode; score\n\n 001 ; 2,5\n;\n"a\nb";NA\nnone;\n')
    assert found.columns == {"code": ("001", "a\nb", "none"), "score": ("2,5", "NA", "")}
    assert found.lines == (4, 6, 8)
    assert [found.number("score", row) for row in range(3)] == [2.5, None, None]


def test_a_cell_that_is_no_number_is_named_with_its_line(table):
    found = table('code,score\n"a\nb",1\nc,1e999\nd,two\n')
    with pytest.raises(UserError, match=r"line 5: score is 'two', which is not a number"):
        found.number("score", 2)
    with pytest.raises(UserError, match=r"line 4: score is 1e999, which is too large"):
        found.number("score", 1)
    with pytest.raises(UserError, match="there is no column day; its columns are code, score"):
        found.column("day", "--day")


def test_a_table_without_rows(tmp_path):
    path = tmp_path / "labels.csv"
    path.write_text("# nothing yet\ncode,score\n,\n")
    assert read_text_table(path, may_be_empty=True).lines == ()
    with pytest.raises(UserError, match="names its columns in line 2 but has no rows"):
        read_text_table(path)
