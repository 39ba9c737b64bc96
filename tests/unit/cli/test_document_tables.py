"""A document of plain values as tables: every value once, with its unit."""

import math

from rigidimeter.cli.document_tables import document_tables
from rigidimeter.cli.terminal_tables import text_lines

DOCUMENT = {
    "seed": 1,
    "loop": {
        "stable": True,
        "angle_rad": math.pi / 2,
        "inertia_kg_m2": 0.0045,
        "verdict": "two words",
        "errors_percent": {"OFF": {"inertia_kg_m2": 0.5}, "DBS": {"inertia_kg_m2": 0.25}},
    },
    "corners": [{"speed_rad_s": math.pi * n, "of": None} for n in range(9)],
}


def test_entries_stand_side_by_side_and_units_come_from_the_names() -> None:
    assert text_lines(document_tables(DOCUMENT, "All")) == [
        "All",
        "  seed  1",
        "All: loop",
        "  stable                 yes",
        "  angle, deg           90.00",
        "  inertia, 10⁻³ kg·m²  4.500",
        "  verdict",
        "    two words",
        "All: loop: errors percent",
        "                 OFF     DBS",
        "  inertia, %  0.5000  0.2500",
        "All: corners, the first 8 of 9",
        "                1      2      3      4",
        "  speed, deg/s  0  180.0  360.0  540.0",
        "  of            –      –      –      –",
        "                    5      6     7     8",
        "  speed, deg/s  720.0  900.0  1080  1260",
        "  of                –      –     –     –",
    ]
