"""Where a result comes from: versions, settings, inputs and their digests."""

from __future__ import annotations

import hashlib
import json
import platform
import shlex
import sys
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING

from rigidimeter import __version__

if TYPE_CHECKING:
    from rigidimeter.settings import Settings

__all__ = ["provenance"]


def provenance(paths: tuple[Path, ...], settings: Settings) -> dict[str, str]:
    """Return facts that let somebody else make the same result again."""
    from rigidimeter.recording import is_session, read_manifest
    from rigidimeter.settings import dump_settings

    canonical = json.dumps(dump_settings(settings), sort_keys=True)
    facts = {
        "rigidimeter": __version__,
        "made (UTC)": datetime.now(UTC).isoformat(timespec="seconds"),
        "command": shlex.join(["rigidimeter", *sys.argv[1:]]),
        "python": f"{platform.python_version()} on {platform.system()} {platform.machine()}",
        "libraries": ", ".join(f"{name} {version(name)}" for name in ("numpy", "scipy", "pyarrow")),
        "settings SHA-256": hashlib.sha256(canonical.encode()).hexdigest(),
    }
    for path in paths:
        if is_session(path):
            manifest = read_manifest(path)
            facts[f"{path}"] = (
                f"session of {manifest['created_utc']}, seeds {manifest['seeds']}, samples SHA-256 "
                f"{_digest(path / 'samples.arrows')}"
            )
        elif path.is_file():
            facts[f"{path}"] = f"SHA-256 {_digest(path)}"
    return facts


def _digest(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
