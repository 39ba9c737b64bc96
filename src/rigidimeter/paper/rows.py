"""All rows of the ledger, in the order of the page."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping

from rigidimeter.errors import UserError
from rigidimeter.paper import appendix, controller, counts, highpass, measured, torques
from rigidimeter.paper import arm_equation as arm
from rigidimeter.paper import perturbation_rows as perturbation
from rigidimeter.paper import printed_effects as effects
from rigidimeter.paper import score_rows as scores
from rigidimeter.paper import sensitivity_rows as sensitivity
from rigidimeter.paper import sensor_noise as noise
from rigidimeter.paper import voluntary_torque as voluntary
from rigidimeter.paper.comparison_table import Row
from rigidimeter.paper.context import Workshop

__all__ = ["MAKERS", "SECTIONS", "chosen", "make_rows"]

_MODULES = (
    appendix,
    arm,
    controller,
    counts,
    effects,
    highpass,
    measured,
    noise,
    perturbation,
    scores,
    sensitivity,
    torques,
    voluntary,
)

MAKERS: Mapping[str, Callable[[Workshop], Row]] = {
    row_id: maker for module in _MODULES for row_id, maker in module.ROWS.items()
}
"""By row: the function that makes it, in any order and on its own."""


SECTIONS: Mapping[str, tuple[str, ...]] = {
    "Equations": (
        "eq-1",
        "eq-2",
        "eq-3",
        "eq-4",
        "eq-5",
        "eq-6",
        "eq-6-highpass",
        "eq-6-highpass-per-radian",
        "eq-7",
        "eq-8",
        "eq-8-largest",
    ),
    "Figures": (
        "fig-3a",
        "fig-3b",
        "fig-4a",
        "fig-4b",
        "fig-4c",
        "fig-4d",
        "fig-5a",
        "fig-5b",
        "fig-5c",
        "fig-6a",
        "fig-6b",
        "fig-6b-left-sum",
        "fig-6b-delay",
        "fig-7",
        "fig-8a",
        "fig-8b",
        "fig-8c",
    ),
    "Tables": (
        "table-1",
        "table-2",
        "table-2-mupdrs",
        "table-2-impulse",
        "table-2-work",
        "table-2-viscosity",
        "table-2-stiffness",
    ),
    "Statements of the text": (
        "sec-1-voluntary-ols",
        "sec-1-voluntary-iv",
        "sec-2.3-cycles-motion",
        "sec-2.3-cycles-epoch",
        "sec-2.3-duration",
        "sec-2.4.2-units",
        "sec-2.4.3-bandwidth",
        "sec-3.1-f-test",
        "sec-3.2-cancel",
        "p-mupdrs",
        "p-work",
        "p-viscosity",
        "p-stiffness",
        "k-printed",
        "sec-3.6-order",
        "sec-4-better",
    ),
    "Simulations of Sec. 3.4": ("sec-3.4-mean", "sec-3.4-sd", "sec-3.4-noise"),
    "Appendix A": ("app-a-units", "app-a-forearm", "app-a-inertia", "app-a-damping"),
}
"""The page, section by section."""


def chosen(only: Iterable[str]) -> tuple[str, ...]:
    """Return the rows to make, in the order of the page; all of them if none is named.

    Raises
    ------
    UserError
        If a name is no row.
    """
    wanted = set(only)
    unknown = sorted(wanted - MAKERS.keys())
    if unknown:
        every = ", ".join(row_id for ids in SECTIONS.values() for row_id in ids)
        raise UserError(f"--only {unknown[0]}: there is no such row; the rows are {every}")
    return tuple(
        row_id for ids in SECTIONS.values() for row_id in ids if not wanted or row_id in wanted
    )


def make_rows(
    workshop: Workshop,
    only: Iterable[str] = (),
    progress: Callable[[str], None] = lambda _: None,
) -> list[Row]:
    """Make rows in the order of the page.

    Parameters
    ----------
    workshop : Workshop
    only : iterable of str
        Rows by id; all of them if empty.
    progress : callable
        Called with the id of each row once it is made.

    Raises
    ------
    UserError
        If a name is no row.
    """
    rows = []
    for row_id in chosen(only):
        rows.append(MAKERS[row_id](workshop))
        progress(row_id)
    return rows
