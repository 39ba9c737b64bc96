"""Codes in place of the conditions of a session whose examiner must not know them.

They are drawn before the session and are in its manifest (`about.codes`), beside the names: they
keep a condition off screens and pages, not from somebody who opens the files.
"""

from __future__ import annotations

import random
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from rigidimeter.errors import UserError
from rigidimeter.recording.recording import Recording
from rigidimeter.recording.session_epochs import is_session
from rigidimeter.recording.session_folder import read_manifest
from rigidimeter.settings import Settings, dump_settings, parse_settings

NO_CODE = "(blinded)"
"""What is shown of a condition that has no code where others have one."""


def drawn_codes(conditions: Sequence[str], rng: random.Random) -> dict[str, str]:
    """Return a code for each condition, in an order that the names do not tell.

    Examples
    --------
    >>> sorted(drawn_codes(["OFF", "DBS"], random.Random(1)).values())
    ['code-A', 'code-B']
    """
    names = list(dict.fromkeys(conditions))
    order = rng.sample(range(len(names)), len(names))
    return {name: f"code-{chr(ord('A') + k)}" for name, k in zip(names, order, strict=True)}


def codes_of(about: Mapping[str, Any]) -> dict[str, str]:
    """Return the codes that a manifest's `about` holds; empty where nobody was blinded."""
    codes = about.get("codes")
    return {str(name): str(code) for name, code in codes.items()} if codes else {}


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
