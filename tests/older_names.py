"""Turn a session folder into one of before settings were renamed."""

import json
from pathlib import Path
from typing import Any

from rigidimeter.core.files import ZEROS, json_text, text_bytes, with_checksum
from rigidimeter.core.settings import RENAMED


def older(settings: dict[str, Any]) -> dict[str, Any]:
    """Return nested settings under the names that they had."""
    before = dict(settings)
    for table in RENAMED.keys() & settings.keys():
        old = {new: old for old, new in RENAMED[table].items()}
        before[table] = {old.get(key, key): value for key, value in settings[table].items()}
    if "levels" in before.get("diagnostics", {}):
        levels = before["diagnostics"]["levels"].items()
        named = {name: "doubt" if level == "caution" else level for name, level in levels}
        before["diagnostics"] = {**before["diagnostics"], "levels": named}
    return before


def with_older_names(folder: Path) -> Path:
    """Rewrite a manifest, with a checksum if it has one."""
    path = folder / "manifest.json"
    manifest = json.loads(path.read_text())
    manifest["settings"] = older(manifest["settings"])
    if "checksum" not in manifest:
        path.write_bytes(text_bytes(json_text(manifest)))
        return folder
    text = text_bytes(json_text({**manifest, "checksum": ZEROS}))
    path.write_bytes(with_checksum(text))
    return folder
