"""A recording as its examiner may see it: codes in place of the conditions' names."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from rigidimeter.analysis.reading.recording import Recording
from rigidimeter.core.errors import UserError
from rigidimeter.core.session import NO_CODE, codes_of, is_session, read_manifest
from rigidimeter.core.settings import Settings, dump_settings, parse_settings


def with_codes(recording: Recording) -> Recording:
    """Return a recording that names conditions by the codes of its sessions alone.

    Raises
    ------
    UserError
        If something else than blinded sessions was read.
    """
    codes: dict[Path, dict[str, str]] = {}
    for path in recording.paths:
        about = read_manifest(path).get("about", {}) if is_session(path) else {}
        codes[path] = codes_of(about)
        if not codes[path]:
            raise UserError(
                f"{path}: --blinded is for sessions that were recorded blinded, whose manifest has "
                "codes; leave it out"
            )
    together = {name: code for one in codes.values() for name, code in one.items()}
    by_source = {str(path): one for path, one in codes.items()}
    epochs = tuple(
        replace(epoch, condition=by_source[epoch.source].get(epoch.condition, NO_CODE))
        for epoch in recording.epochs
    )
    settings = _coded(recording.settings, together)
    return replace(recording, epochs=epochs, settings=settings)


def _coded(settings: Settings, codes: Mapping[str, str]) -> Settings:
    """Return settings without the names of conditions; arms of others are left out."""
    values = dump_settings(settings)
    arms = {codes[name]: arm for name, arm in values["subject"].items() if name in codes}
    blocks = [
        {**block, "condition": codes[block["condition"]]} for block in values["protocol"]["blocks"]
    ]
    values["subject"] = arms
    values["protocol"] = {**values["protocol"], "blocks": blocks}
    return parse_settings(values, source="settings of the blinded session")
