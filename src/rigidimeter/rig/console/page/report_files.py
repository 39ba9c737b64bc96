"""Reports of the console's folder, as its server gives them to the browser.

Only folders that hold a `report.html` are served. A report comes with `Content-Security-Policy:
sandbox`, so whatever stands in it can neither read the operator's page nor order anything.
"""

from __future__ import annotations

import os
from pathlib import Path

PAGE = "report.html"
OF_STUDY = "report"
_FOR_SESSION = "-report"
POLICY = "sandbox allow-scripts allow-downloads allow-popups"


def report_folder(session: str = "") -> str:
    """Return the name of the folder in which a session's report lies, or that of the study."""
    return f"{session}{_FOR_SESSION}" if session else OF_STUDY


def report_link(folder: str) -> str:
    """Return the address of a report, below that of the page."""
    return f"/report/{folder}/{PAGE}"


def report_file(root: Path, folder: str, path: str) -> Path | None:
    """Return a file of a report; None where there is none, or it lies elsewhere."""
    if folder != OF_STUDY and not folder.endswith(_FOR_SESSION):
        return None
    within = os.path.realpath(root / folder)
    found = os.path.realpath(os.path.join(within, path))
    inside = os.path.dirname(within) == os.path.realpath(root) and found.startswith(within + os.sep)
    report = Path(within, PAGE).is_file()
    return Path(found) if inside and report and os.path.isfile(found) else None
