"""`rigidimeter reproduce`: the paper's numbers beside ours."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rigidimeter.errors import UserError

__all__ = ["reproduce"]


def reproduce(
    out: Annotated[
        Path, typer.Option("--out", metavar="DIR", help="Folder for page, ledger and figures.")
    ],
    seed: Annotated[
        int, typer.Option("--seed", min=0, max=2**31, help="Seed of everything random.")
    ] = 2023,
    only: Annotated[
        list[str] | None,
        typer.Option("--only", metavar="ID", help="Make this row alone; repeat for several."),
    ] = None,
) -> None:
    """Recompute the paper: every equation, figure and table beside what it prints.

    Writes one self-contained page, paper.html, with a verdict for each row, ledger.json with the
    same rows, and the figures. What needs the recordings of the animal, which were never published,
    comes from a virtual study of the same design and says so. That study is kept in
    DIR/virtual-study, where the other commands can read it.

    \b
    For example:
      rigidimeter reproduce --out paper
      rigidimeter reproduce --out paper --only fig-6b --only eq-8-largest
    """
    from rigidimeter.cli.progress import Meter
    from rigidimeter.paper import Context, chosen, make_rows, tally, write_ledger

    names = [name for text in only or [] for name in text.split(",") if name]
    wanted = chosen(names)
    if out.exists() and not out.is_dir():
        raise UserError(f"--out {out}: is a file; name a folder")
    # The virtual study takes about as long as all rows together: it is half of the work.
    done = {"rows": 0.0, "study": 0.0}
    with Meter("reproduce", 2.0 * len(wanted)) as meter:

        def studied(share: float) -> None:
            done["study"] = share * len(wanted)
            meter.reach(sum(done.values()))

        def made(_: str) -> None:
            done["rows"] += 1.0
            meter.reach(sum(done.values()))

        context = Context(seed, folder=out / "virtual-study", progress=studied)
        rows = make_rows(context, wanted, progress=made)
    try:
        page = write_ledger(rows, out, seed)
    except OSError as error:
        raise UserError(f"--out {out}: cannot be written ({error.strerror or error})") from None
    width = max(len(row.id) for row in rows)
    for row in rows:
        typer.echo(f"{row.id:{width}}  {row.verdict}")
    typer.echo("; ".join(f"{count} {verdict}" for verdict, count in tally(rows).items()))
    typer.echo(str(page))
