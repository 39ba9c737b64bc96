"""`rigidimeter reproduce`: the paper's numbers beside ours."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

from rigidimeter.cli.help_pages import OPTIONS
from rigidimeter.cli.output import echo
from rigidimeter.cli.progress import Meter
from rigidimeter.cli.terminal_tables import Heading, Table, show
from rigidimeter.core.errors import UserError


def reproduce(
    out: Path = OPTIONS.option("--out DIR", "Folder for page, ledger and figures.", ...),
    seed: int = OPTIONS.option("--seed", "Seed of everything random.", 2023, min=0, max=2**31),
    only: list[str] | None = OPTIONS.option("--only ID", "Only this row; repeat for several."),
) -> None:
    """Recompute every equation, figure and table of the paper.

    Writes one self-contained page, paper.html, with a verdict for each row, ledger.json with the
    same rows, and the figures. The recordings of the animal were never published; rows that need
    them use a virtual study of the same design and say so. That study is stored in
    DIR/virtual-study, where the other commands can read it.

    \b
    For example:
      rigidimeter reproduce --out paper
      rigidimeter reproduce --out paper --only fig-6b --only eq-8-largest
    """
    from rigidimeter.paper import Context, chosen, make_rows, tally, write_ledger

    names = [name for text in only or [] for name in text.split(",") if name]
    wanted = chosen(names)
    if not names and find_spec("numba") is None:  # it would be missed after minutes
        raise UserError("all rows need one more package: pip install 'rigidimeter[batch]'")
    if out.exists() and not out.is_dir():
        raise UserError(f"--out {out}: is a file; name a folder")
    # The virtual study takes about as long as all rows together, and figures a quarter of a row.
    done = {"study": 0.0, "rows": 0.0, "figures": 0.0}
    with Meter("reproduce", 2.25 * len(wanted)) as meter:

        def reach(part: str, amount: float) -> None:
            done[part] = amount
            meter.reach(sum(done.values()))

        context = Context(
            seed,
            folder=out / "virtual-study",
            progress=lambda share: reach("study", share * len(wanted)),
        )
        rows = make_rows(context, wanted, progress=lambda _: reach("rows", done["rows"] + 1.0))
        try:
            page = write_ledger(
                rows, out, seed, progress=lambda _: reach("figures", done["figures"] + 0.25)
            )
        except OSError as error:
            reason = error.strerror or error
            raise UserError(f"--out {out}: cannot be written ({reason})") from None
    show(
        [
            Heading("; ".join(f"{count} {verdict}" for verdict, count in tally(rows).items())),
            Table(("row", "verdict"), [(row.id, row.verdict) for row in rows], "<<"),
        ]
    )
    echo(str(page))
