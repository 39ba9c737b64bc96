"""Where a result comes from: versions, settings, inputs and their digests."""

from __future__ import annotations

import hashlib
import json
import platform
from collections.abc import Iterable
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path

from rigidimeter.recording import is_session, read_manifest
from rigidimeter.settings import Settings, dump_settings
from rigidimeter.study.sessions import file_digest
from rigidimeter.version import __version__


def provenance(paths: Iterable[Path], settings: Settings, command: str = "") -> dict[str, str]:
    """Return the facts that let somebody else make the same result again."""
    canonical = json.dumps(dump_settings(settings), sort_keys=True)
    facts = {
        "rigidimeter": __version__,
        "made (UTC)": datetime.now(UTC).isoformat(timespec="seconds"),
        **({"command": command} if command else {}),
        "python": f"{platform.python_version()} on {platform.system()} {platform.machine()}",
        "libraries": ", ".join(f"{name} {version(name)}" for name in ("numpy", "scipy", "pyarrow")),
        "settings SHA-256": hashlib.sha256(canonical.encode()).hexdigest(),
    }
    for path in paths:
        if is_session(path):
            manifest = read_manifest(path)
            facts[f"{path}"] = (
                f"session of {manifest['created_utc']}, seeds {manifest['seeds']}, samples SHA-256 "
                f"{file_digest(path / 'samples.arrows')}"
            )
        elif path.is_file():
            facts[f"{path}"] = f"SHA-256 {file_digest(path)}"
    return facts
