"""What is refused of a spreadsheet, and a head above its table."""

import sys
import zipfile

import numpy as np
import pytest
import xlsxwriter
from tests.known_joint import angle_rad, torque_nm

from rigidimeter.analysis.reading.channels.inspection import inspect_table, option_words
from rigidimeter.analysis.reading.formats import ReadOptions, read_table
from rigidimeter.core.errors import UserError

TIME_S = np.arange(2400) / 120.0
TORQUE_NM, ANGLE_DEG = torque_nm(TIME_S, 1), np.degrees(angle_rad(TIME_S, 1))


def excel(path, sheets):
    with xlsxwriter.Workbook(path) as book:
        for name, (head, columns) in sheets.items():
            sheet = book.add_worksheet(name)
            for row, line in enumerate(head):
                sheet.write_row(row, 0, line)
            for row, values in enumerate(zip(*columns, strict=True), start=len(head)):
                sheet.write_row(row, 0, values)
    return path


JOINT = ([["Zeit [ms]", "Drehmoment [Nm]", "Winkel [°]"]], [1e3 * TIME_S, TORQUE_NM, ANGLE_DEG])


def test_a_head_a_row_of_units_and_a_remark_below(tmp_path):
    head = [["Lab 3"], [], ["Time", "Torque", "Angle"], ["s", "Nm", "deg"]]
    path = excel(tmp_path / "r.xlsx", {"a": (head, JOINT[1])})
    table = read_table(path)
    assert table.units == {"Time": "s", "Torque": "Nm", "Angle": "deg"}
    assert table.lines[0] == 5


def test_one_of_several_sheets_is_named(tmp_path):
    notes = ([["remarks"]], [["none"]])
    path = excel(tmp_path / "r.xlsx", {"Notes": notes, "T 1": JOINT, "T 2": JOINT})
    with pytest.raises(UserError, match=r"2 sheets hold a table; say which, as in --table 'T 1'"):
        read_table(path)
    options = ReadOptions(table="T 2")
    assert "--table" in option_words(inspect_table(read_table(path, options), options))
    with pytest.raises(UserError, match="there is no sheet 'T 3'; it has 'Notes', 'T 1', 'T 2'"):
        read_table(path, ReadOptions(table="T 3"))
    with pytest.raises(UserError, match="sheet Notes"):
        read_table(path, ReadOptions(table="Notes"))


MANIFEST = (
    '<?xml version="1.0" encoding="UTF-8"?><manifest:manifest '
    'xmlns:manifest="urn:oasis:names:tc:opendocument:xmlns:manifest:1.0"/>'
)
CELL = '<table:table-cell office:value-type="{}" {}><text:p>{}</text:p></table:table-cell>'


def opendocument(path, after=""):
    """Write a recording in the layout of LibreOffice, and what follows its rows."""
    cells = [[CELL.format("string", "", name) for name in ("t_s", "M_Nm", "phi_deg")]]
    cells += [
        [CELL.format("float", f'office:value="{float(v)!r}"', v) for v in row]
        for row in zip(TIME_S[:50], TORQUE_NM[:50], ANGLE_DEG[:50], strict=True)
    ]
    rows = "".join(f"<table:table-row>{''.join(row)}</table:table-row>" for row in cells) + after
    of = "urn:oasis:names:tc:opendocument:xmlns"
    content = (
        '<?xml version="1.0" encoding="UTF-8"?><office:document-content '
        f'xmlns:office="{of}:office:1.0" xmlns:table="{of}:table:1.0" xmlns:text="{of}:text:1.0">'
        '<office:body><office:spreadsheet><table:table table:name="Sheet1">'
        f"{rows}</table:table></office:spreadsheet></office:body></office:document-content>"
    )
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("mimetype", "application/vnd.oasis.opendocument.spreadsheet")
        archive.writestr("META-INF/manifest.xml", MANIFEST)
        archive.writestr("content.xml", content)
    return path


FAR = (
    '<table:table-row table:number-rows-repeated="1048525"><table:table-cell '
    'table:number-columns-repeated="16384"/></table:table-row><table:table-row><table:table-cell '
    'table:number-columns-repeated="16383"/>'
    + CELL.format("float", 'office:value="1"', 1)
    + "</table:table-row>"
)


@pytest.mark.parametrize("name", ["r.xlsx", "r.ods"])
def test_a_cell_in_the_last_row_and_column_is_a_sentence(tmp_path, rigidimeter, name):
    """The library asks for 400 GB at once, and ends the process that asks."""
    path = tmp_path / name
    if name.endswith("ods"):
        opendocument(path, FAR)
    else:
        with xlsxwriter.Workbook(path) as book:
            book.add_worksheet("Notes").write(0, 0, "none")
            sheet = book.add_worksheet("Sheet1")
            sheet.write(0, 0, "time_s")
            sheet.write(1_048_575, 16_383, 1.0)
    ran = rigidimeter("estimate", path)
    assert ran.status == 1
    assert str(path) in ran.err
    assert "needs more than 4 GiB" in ran.err
    assert "delete the rows and columns beyond it" in ran.err


def test_a_sheet_that_expands_a_thousandfold_is_refused(tmp_path):
    path = tmp_path / "r.xlsx"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("xl/worksheets/sheet1.xml", bytes(200 * 2**20))
    with pytest.raises(UserError, match=r"its sheets expands to 200 MiB"):
        read_table(path)


def test_damage_anywhere_is_read_or_refused(tmp_path):
    path = excel(tmp_path / "r.xlsx", {"a": (JOINT[0], [c[:60] for c in JOINT[1]])})
    whole = path.read_bytes()
    rng = np.random.default_rng(5)
    told = []
    for _ in range(60):
        damaged = bytearray(whole)
        if rng.random() < 0.3:
            del damaged[rng.integers(1, len(whole)) :]
        for place in rng.integers(0, len(damaged), rng.integers(1, 4)):
            damaged[place] ^= int(rng.integers(1, 256))
        path.write_bytes(damaged)
        try:
            read_table(path)
        except UserError as error:
            told.append(str(error))
    assert len(told) > 20
    assert all(text.startswith(str(path)) for text in told)


def test_without_calamine_the_extra_is_named(tmp_path, monkeypatch):
    path = excel(tmp_path / "r.xlsx", {"a": JOINT})
    monkeypatch.setitem(sys.modules, "python_calamine", None)
    with pytest.raises(UserError, match=r"pip install 'rigidimeter\[excel\]'"):
        read_table(path)
