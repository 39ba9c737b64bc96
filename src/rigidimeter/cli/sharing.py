"""What a session shares, as its settings ask: streams while it runs, NWB when it has ended."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import TYPE_CHECKING

from rigidimeter.errors import UserError

if TYPE_CHECKING:
    from rigidimeter.settings import Settings


def require_packages(settings: Settings) -> None:
    """Refuse settings that need a package which is not installed, before anything starts.

    Raises
    ------
    UserError
        With the command that installs it.
    """
    needs = (
        ("lsl", settings.sharing.lsl, "pylsl", "lsl"),
        ("nwb_at_close", settings.sharing.nwb_at_close, "pynwb", "nwb"),
    )
    for key, wanted, package, extra in needs:
        if wanted and importlib.util.find_spec(package) is None:
            raise UserError(
                f"sharing.{key} = true needs one more package: pip install 'rigidimeter[{extra}]'"
            )


def write_nwb_beside(folder: Path) -> str:
    """Write `SESSION.nwb` beside a closed session, without estimates; return what came of it.

    A blinded session is written with its codes. The session is recorded whatever becomes of this,
    so a failure is a sentence.
    """
    from rigidimeter.exporting import export_sessions, sessions_of_recording
    from rigidimeter.recording import read, read_manifest
    from rigidimeter.recording.blinded import codes_of, with_codes

    out = folder.with_name(f"{folder.name}.nwb")
    try:
        blinded = bool(codes_of(read_manifest(folder).get("about", {})))
        recording = with_codes(read(folder)) if blinded else read(folder)
        export_sessions(sessions_of_recording(recording, None, blinded=blinded), "nwb", out)
    except UserError as error:
        return f"error: {out} was not written: {error}"
    return f"the same as NWB in {out}"
