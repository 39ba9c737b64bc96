"""The blocks of documents that are written from the code, between marks, and the JSON Schemas.

`python -m tests.docs.generated` writes them anew. A block NAME stands between the marks
`<!-- NAME: begin -->` and `<!-- NAME: end -->`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

from tests.docs.command_help import command_help
from tests.docs.conformance_table import drive_rules, sensor_rules
from tests.docs.files_tables import FILES_BLOCKS, columns_read, formats_table, ratings_keys
from tests.docs.findings_table import findings_table
from tests.docs.json_schemas import SCHEMAS, schema_text
from tests.docs.markdown import ROOT
from tests.docs.settings_tables import (
    mapping_tables,
    plan_tables,
    rig_tables,
    settings_tables,
    study_tables,
)

REFERENCE = ROOT / "docs" / "reference"
BLOCKS: Mapping[Path, Mapping[str, Callable[[], str]]] = {
    REFERENCE / "files.md": FILES_BLOCKS,
    REFERENCE / "formats.md": {"formats": formats_table},
    ROOT / "docs" / "how-to" / "name-the-columns.md": {"columns": columns_read},
    ROOT / "docs" / "how-to" / "analyse-ratings.md": {"ratings": ratings_keys},
    REFERENCE / "diagnostics.md": {"findings": findings_table},
    REFERENCE / "commands.md": {"options": command_help},
    REFERENCE / "settings.md": {"settings": settings_tables},
    REFERENCE / "rig-file.md": {"drivers": rig_tables},
    REFERENCE / "drivers.md": {"sensor": sensor_rules, "drive": drive_rules},
    REFERENCE / "study-files.md": {
        "study": study_tables,
        "plan": plan_tables,
        "mapping": mapping_tables,
    },
}
FOLDER = ROOT / "docs" / "static" / "schemas"


def with_blocks(page: Path) -> str:
    """Return the text of a page with its blocks as the code has them."""
    text = page.read_text("utf-8")
    for name, made in BLOCKS[page].items():
        begin, end = f"<!-- {name}: begin -->\n", f"<!-- {name}: end -->"
        before, _, rest = text.partition(begin)
        assert end in rest, f"{page.name} has no block {name}"
        text = before + begin + made().strip("\n") + "\n" + end + rest.partition(end)[2]
    return text


if __name__ == "__main__":
    for path in BLOCKS:
        path.write_text(with_blocks(path), "utf-8")
    for schema in SCHEMAS:
        (FOLDER / schema).write_text(schema_text(schema), "utf-8")
