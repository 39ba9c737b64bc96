"""`rigidimeter explain`: what a finding means, and what to do about it."""

from __future__ import annotations

import re
from difflib import get_close_matches
from typing import TYPE_CHECKING

from rigidimeter.cli.help_pages import argument
from rigidimeter.cli.terminal_tables import Block, Heading, Table, show
from rigidimeter.core.errors import UserError

if TYPE_CHECKING:
    from rigidimeter.core.findings import Kind


NOTHING_TO_DO = "Nothing has to be done."

LINK = r" \(\[\w+\]\([^)]*\)\)"
"""To a page of the documentation."""


def explain(
    name: str | None = argument("[NAME]", "Of a finding; all without it.", None),
) -> None:
    """Explain a finding of the checks: what was looked at, what it means, and what to do.

    \b
    For example:
      rigidimeter explain
      rigidimeter explain tremor
    """
    from rigidimeter.core.findings import KINDS

    if name is None:
        rows = [(kind.name, kind.level) for kind in KINDS.values()]
        show([Table(("finding", "level"), rows, "<<"), "rigidimeter explain NAME explains one."])
        return
    if name not in KINDS:
        near = get_close_matches(name, KINDS, 1)
        hint = f"is it {near[0]}?" if near else "rigidimeter explain lists all"
        raise UserError(f"no finding is called {name!r}; {hint}")
    show(_blocks(KINDS[name]))


def _blocks(kind: Kind) -> list[Block]:
    from rigidimeter.core.findings import explained
    from rigidimeter.core.settings import DiagnosticLevels, DiagnosticsSettings

    settings = []
    if kind.name in DiagnosticLevels.model_fields:
        settings.append(f'diagnostics.levels.{kind.name} = "{kind.level}"')
    if kind.setting:
        default = DiagnosticsSettings.model_fields[kind.setting].default
        settings.append(f"diagnostics.{kind.setting} = {default:g}")
    (begins, usual), *others = explained(kind)
    blocks: list[Block] = [
        Heading(f"{kind.name}: {kind.level}"),
        f"Looked at: {re.sub(LINK, '', kind.checks)}.",
        *([f"Settings, with their defaults: {', '.join(settings)}."] if settings else []),
        "",
        f"{begins}:",
        f"  {usual.headline}.",
        f"  {usual.details}",
        f"  {usual.remedy or NOTHING_TO_DO}",
    ]
    for when, words in others:
        differs = [new for new, old in zip(words, usual, strict=True) if new and new != old]
        differs += [NOTHING_TO_DO] * (usual.remedy != words.remedy == "")
        blocks += ["", f"{when}:", *(f"  {text}" for text in differs)]
    return blocks
