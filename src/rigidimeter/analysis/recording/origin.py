"""Where a result comes from: versions, settings, inputs and their digests."""

from __future__ import annotations

import hashlib
import json
import platform
from collections.abc import Iterable, Mapping
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path

from rigidimeter.core.session import SAMPLES, is_session, read_manifest
from rigidimeter.core.settings import Settings, dump_settings
from rigidimeter.core.study_files import StudyFolder
from rigidimeter.core.version import __version__


def provenance(
    paths: Iterable[Path], digests: Mapping[Path, str], settings: Settings, command: str = ""
) -> dict[str, str]:
    """Return the facts that let somebody else make the same result again.

    Parameters
    ----------
    paths : iterable of Path
        Session folders and files that were read.
    digests : mapping of Path to str
        SHA-256 of what was read of each file: by now it may hold something else.
    settings : Settings
    command : str
    """
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
            checked = "session_id" in manifest
            seeds = ", ".join(f"{name} {seed}" for name, seed in manifest["seeds"].items())
            facts[f"{path}"] = (
                f"session of {manifest['created_utc']}, seeds {seeds}, samples SHA-256 "
                f"{digests.get(path / SAMPLES, 'not known')}, "
                + ("with checksums" if checked else "without checksums: cannot be verified")
            )
        elif path in digests:
            facts[f"{path}"] = f"SHA-256 {digests[path]}"
    return facts


def study_provenance(
    read: StudyFolder,
    sessions: Iterable[str],
    digests: Mapping[str, str],
    settings: Settings,
    command: str,
) -> dict[str, str]:
    """Return the same of a study folder: its tables, and the sessions that count.

    Parameters
    ----------
    read : StudyFolder
    sessions : iterable of str
        Their paths below the folder.
    digests : mapping of str to str
        SHA-256 of every file of the recordings, by its path below the folder.
    settings : Settings
    command : str
    """
    tables = [path for name, path in read.files.items() if name != "key"]
    known = {path: read.digests[name] for name, path in read.files.items()}
    known |= {read.folder / name: digest for name, digest in digests.items()}
    paths = [*tables, *(read.folder / session for session in sessions)]
    return provenance(paths, known, settings, command)
