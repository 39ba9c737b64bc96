"""What a command says of settings that were entered on the page, first in sentences."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from pathlib import Path

from rigidimeter.core.errors import UserError
from rigidimeter.core.files import toml_text
from rigidimeter.core.settings import Settings, dump_settings
from rigidimeter.rig.console.page.jobs import Jobs


async def computed(
    jobs: Jobs,
    settings: Settings,
    command: tuple[str, ...],
    options: tuple[str, ...],
    lines: Callable[[Path, Settings], list[str]],
) -> str:
    """Run a command on settings, in a folder that is deleted; return its answer for the page.

    Parameters
    ----------
    jobs : Jobs
    settings : Settings
    command, options : tuple of str
        What stands before `--settings` and behind it.
    lines : callable
        Takes the folder and the settings; returns what the answer comes to.
    """
    with tempfile.TemporaryDirectory(prefix="rigidimeter-form-") as name:
        folder = Path(name)
        path = folder / "protocol.toml"
        path.write_text(toml_text(dump_settings(settings)), encoding="utf-8")
        answer = await jobs.command(*command, "--settings", str(path), *options, folder=folder)
        try:
            texts = lines(folder, settings)
        except UserError as error:
            texts = [str(error).replace(name, "…")]
    return answer.html(name, texts)
