"""`rigidimeter study`: make a study folder, empty or virtual; `compare` and `report` read it."""

import typer

from rigidimeter.cli.study.new_folder import new
from rigidimeter.cli.study.virtual import simulate

__all__ = ["study"]

study = typer.Typer(
    name="study",
    no_args_is_help=True,
    rich_markup_mode=None,
    help="Make a study folder: an empty one, or one from the virtual rig.",
)
study.command()(new)
study.command()(simulate)
