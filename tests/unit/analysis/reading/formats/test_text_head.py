"""Heads of text files: what is found, and sentences about what is not."""

import numpy as np
import pytest

from rigidimeter.analysis.reading.formats import ReadOptions, read_table
from rigidimeter.analysis.reading.formats.text_head import stated_rate
from rigidimeter.core.errors import UserError

ROWS = "".join(f"{k / 100},{k % 7},{k % 5}\n" for k in range(60))
LABVIEW = "LabVIEW Measurement\t\nX_Columns\t{}\n***End_of_Header***\t\nDelta_X\t0.004\t0.004\n"
MULTI, STARTS = LABVIEW.format("Multi"), "Time\t10:11:12\t\t10:11:13\n"


def table(path, text, **options):
    path.write_text(text, "utf-8")
    return read_table(path, ReadOptions(**options))


def test_lines_keep_their_numbers_below_a_head(tmp_path):
    text = "Lab 3\nSubject: 1\n\n# a remark\nt,M,phi\ns,Nm,deg\n" + ROWS
    found = table(tmp_path / "r.csv", text)
    assert list(found.columns) == ["t", "M", "phi"]
    assert found.units == {"t": "s", "M": "Nm", "phi": "deg"}
    assert found.lines[0] == 7
    skipped = table(tmp_path / "r.csv", "1,2,3\n" + text, skip_rows=1)
    assert skipped.lines[0] == 8


def test_labview_without_a_column_of_time_has_a_rate(tmp_path):
    text = LABVIEW.format("No") + "***End_of_Header***\nX_Value\tTorque\tAngle\tComment\n"
    found = table(tmp_path / "r.lvm", text + "\t1.5\t2\n" * 30)
    assert found.scalars["rate_hz"] == pytest.approx(250.0)
    np.testing.assert_array_equal(found.columns["Torque"], np.full(30, 1.5))


@pytest.mark.parametrize(
    ("line", "rate_hz"),
    [
        ("Sampling rate: 1 kHz", 1000.0), ("fs = 200 Hz", 200.0), ("Abtastzeit: 2,5 ms", 400.0),
        ("Sampling frequency (Hz): 250", 250.0), ("Bemonsteringsfrequentie;200 Hz", 200.0),
        ("sampling_interval = 0.01 s", 100.0), ("dt 500 us", 2000.0), ("Sampling time: 20 s", 0.0),
        ("Sampled for 20 s by A", 0.0), ("Sampling rate: 200 Hz; gain 5", 200.0),
        ("Sampling rate: 200 Hz, 16 bits", 200.0), ("200 Hz, not decimated", 0.0),
        ("offs 20 Hz", 0.0), ("sample 5 s/division", 0.0), ("dt 0 s", 0.0), ("width 3 s", 0.0),
    ],
)  # fmt: skip
def test_a_rate_that_a_line_states(line, rate_hz):
    assert stated_rate([line]).get("rate_hz", 0.0) == pytest.approx(rate_hz)


@pytest.mark.parametrize(
    "lines",
    [
        ["Sampling rate: 200 Hz, of EMG sampled at 2000 Hz"],
        ["Sampling rate: 1000 Hz (resampled to 200 Hz)"],
        ["Sampling rate: 1000 Hz, reduction 5:1"],
        ["Sampling rate: 1 kHz, saved every 5 ms"],
        ["Sample rate: 1000 Hz", "Stored rate: 200 Hz"],
        ["Sampling rate: 1000 Hz", "subsampled 1:5"],
    ],
)
def test_a_rate_beside_another_number_is_asked_about(lines):
    assert stated_rate(lines) == {"rate_hz": "; ".join(lines)}


def test_a_row_of_text_between_rows_is_not_a_footer(tmp_path):
    with pytest.raises(UserError, match="line 62 has 1 value, but the first line names 3 columns"):
        table(tmp_path / "r.csv", "t_s,M_Nm,phi_deg\n" + ROWS + "pause\n" + ROWS)


@pytest.mark.parametrize(
    ("text", "options", "told"),
    [
        (ROWS, {"names": ("a", "b")}, "its rows have 3 columns, but --names gives 2"),
        (ROWS, {"names": ("a", "b", "a")}, "two columns are named a"),
        (ROWS, {"skip_rows": 99}, "has fewer lines than --skip-rows 99"),
        ("a\nb\nc\nd\ne\n" + ROWS, {}, "does not name as many; name them with --names"),
        ("LabVIEW Measurement\n" + ROWS, {}, "head of this LabVIEW file is not complete"),
        (MULTI + "***End_of_Header***\nX_Value\tA\tB\n" + ROWS, {}, "columns are X_Value, A, B"),
        (MULTI + STARTS + "***End_of_Header***\nX_Value\tA\tX_Value\tB\n", {}, "different starts"),
        ("x\n5 msec/sample\n900 channels\na\nb\n", {}, "head of this AcqKnowledge file is not"),
        ("x\n0 msec/sample\n1 channels\nT\nNm\nsec\tCH1\n" + ROWS, {}, "no sampling interval"),
        ("x\n1.2.3 sec/sample\n1 channels\nT\nNm\nsec\tCH1\n" + ROWS, {}, "no sampling interval"),
        ("x\n5 msec/sample\n-1 channels\na\nb\n", {}, "head of this AcqKnowledge file is not"),
    ],
)
def test_what_is_refused(tmp_path, text, options, told):
    with pytest.raises(UserError) as caught:
        table(tmp_path / "r.txt", text, **options)
    assert told in str(caught.value)


def test_a_head_of_any_bytes_is_read_or_refused(tmp_path):
    rng = np.random.default_rng(8)
    whole = (LABVIEW.format("One") + "***End_of_Header***\nX_Value\tA\n" + ROWS).encode()
    path = tmp_path / "r.lvm"
    told = []
    for _ in range(100):
        damaged = bytearray(whole)
        for place in rng.integers(0, 200, 4):
            damaged[place] ^= int(rng.integers(1, 256))
        path.write_bytes(damaged)
        try:
            read_table(path)
        except UserError as error:
            told.append(str(error))
    assert all(text.startswith(str(path)) for text in told)


SPIKE2 = '"INFORMATION"\n"SUMMARY"\n"1"\t"Waveform"\t"T"\t"Nm"\n"2"\t"Waveform"\t"phi"\t"deg"\n'


def test_spike2_channels_keep_their_clocks(tmp_path):
    text = SPIKE2 + '"CHANNEL"\t"1"\n"T"\n"START"\t0.5\t0.1\n1\n2\n3\n\n"START"\t9.0\t0.1\n4\n5\n'
    text += '"CHANNEL"\t"2"\n"START"\t0.25\t0.5\n7\n8\n'
    found = table(tmp_path / "r.txt", text)
    assert found.units == {"time_s": "s", "T": "Nm", "phi": "deg"}
    here = np.isfinite(found.columns["T"])
    np.testing.assert_allclose(found.columns["time_s"][here], [0.5, 0.6, 0.7, 9.0, 9.1])
    here = np.isfinite(found.columns["phi"])
    np.testing.assert_allclose(found.columns["time_s"][here], [0.25, 0.75])


@pytest.mark.parametrize(
    ("channel", "told"),
    [
        ("", "holds no signal with at least 2 samples"),
        ('"START"\t0\t0.1\n1\nx\n', "the channel that starts here cannot be read"),
        ('"START"\t0\n1\n2\n', "the channel that starts here cannot be read"),
        ('"START"\t0\t0\n1\n2\n', "the sampling interval is 0 s"),
    ],
)
def test_a_damaged_export_of_spike2_is_refused(tmp_path, channel, told):
    with pytest.raises(UserError, match=told):
        table(tmp_path / "r.txt", SPIKE2 + '"CHANNEL"\t"1"\n' + channel)
