"""The command `rigidimeter`: commands by name, and errors as sentences.

Modules of the command line import heavy libraries inside their functions, so that `--version` and
`--help` answer at once.
"""

from __future__ import annotations

import gc
import io
import os
import signal
import sys
import warnings
from collections.abc import Sequence
from pathlib import Path
from types import FrameType
from typing import Annotated

import typer

from rigidimeter.cli.batch import batch
from rigidimeter.cli.check import check
from rigidimeter.cli.commission import commission
from rigidimeter.cli.compare import compare
from rigidimeter.cli.console import console
from rigidimeter.cli.design import design
from rigidimeter.cli.emulate import emulate
from rigidimeter.cli.estimate import estimate
from rigidimeter.cli.explain import explain
from rigidimeter.cli.export import export
from rigidimeter.cli.help_pages import HelpCommand
from rigidimeter.cli.inspect import inspect
from rigidimeter.cli.model import model
from rigidimeter.cli.numbers import with_numbers
from rigidimeter.cli.output import VisibleErrors, echo
from rigidimeter.cli.ratings import ratings
from rigidimeter.cli.report import report
from rigidimeter.cli.reproduce import reproduce
from rigidimeter.cli.run import recover, run
from rigidimeter.cli.simulate import simulate
from rigidimeter.cli.study import demo, study
from rigidimeter.cli.study_plan import add_plan_commands
from rigidimeter.core.errors import UserError
from rigidimeter.core.extensions import load_file
from rigidimeter.core.version import __version__

_INTERRUPTED = 130

app = typer.Typer(
    name="rigidimeter",
    cls=VisibleErrors,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
)


def _print_version(wanted: bool) -> None:
    if wanted:
        echo(f"rigidimeter {__version__}")
        raise typer.Exit


def _load(paths: list[Path] | None) -> None:
    """Run Python files that add to the package, such as an estimator, in their order."""
    for path in paths or ():
        load_file(path)


@app.callback()
def _root(
    load: Annotated[
        list[Path] | None,
        typer.Option(
            "--load",
            metavar="FILE",
            callback=_load,
            is_eager=True,
            help="First run a Python file of extensions. It adds an estimator, a file format, a "
            "term or a check; repeat as needed.",
        ),
    ] = None,
    version: Annotated[
        bool,
        typer.Option("--version", callback=_print_version, is_eager=True, help="Show the version."),
    ] = False,
) -> None:
    """Measure joint rigidity. Research software, not a medical device.

    \b
    Try all of it:        rigidimeter demo (a virtual subject on a virtual rig)
    Analyse a recording:  rigidimeter inspect demo-study/elbow.csv
    Run a rig:            rigidimeter console --rig RIG.toml
    """


for panel, commands in {
    "Analyse": (estimate, compare, report, model, inspect, explain, batch, export),
    "Plan": (design, simulate),
    "Measure": (run, console, commission, check, emulate, recover),
    "Paper": (reproduce, ratings),
    "Start": (demo,),
}.items():
    for command in commands:
        app.command(cls=HelpCommand, rich_help_panel=panel)(command)
add_plan_commands(study)
app.add_typer(study, rich_help_panel="Start")
with_numbers(app)


def _terminated(_signal: int, _frame: FrameType | None) -> None:
    raise KeyboardInterrupt


def _say_interrupted() -> None:
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGQUIT, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)  # it ends already; another would be a traceback
    echo("rigidimeter: interrupted", err=True)


def _warned(message: Warning | str, *_: object, **__: object) -> str:
    """Return a warning as notices are printed: where in our code it was given helps nobody."""
    return f"warning: {message}\n"


def main() -> None:
    """Run the command line; a mistake of the user ends with one sentence and status 1."""
    # Before NumPy is imported: matrices here are small, and a second thread mostly waits, in a busy
    # loop, for the first.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    # Each full collection goes over what every imported module made, 50 ms, and finds little.
    gc.set_threshold(50_000, 10, 10)
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGQUIT):  # also where a parent ignores it
        signal.signal(number, _terminated)
    if signal.getsignal(signal.SIGHUP) is not signal.SIG_IGN:  # as `nohup` does, for a long study
        signal.signal(signal.SIGHUP, _terminated)
    warnings.formatwarning = _warned
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")  # a terminal without "−" is no reason to fail
    try:
        app()
        return
    except UserError as error:
        lines: Sequence[str] = error.lines
    except MemoryError:
        lines = (
            "this needs more memory than the computer has; split the input, or analyse less of it "
            "at once",
        )
    except BrokenPipeError:
        # The reader of our output has gone, as in `rigidimeter ... | head`: not our error.
        sys.stderr.close()
        sys.exit(0)
    except OSError as error:
        what = f"{error.filename}: " if error.filename else ""
        lines = (f"{what}{error.strerror or error}",)
    except KeyboardInterrupt:  # before typer has read the command line
        _say_interrupted()
        sys.exit(_INTERRUPTED)
    except SystemExit as end:
        if end.code == _INTERRUPTED:  # typer turns the interruption of a command into this
            _say_interrupted()
        raise
    for index, line in enumerate(lines):
        echo(line if index else f"rigidimeter: {line}", err=True)
    sys.exit(1)
