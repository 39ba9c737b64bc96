"""All rows, section by section, in the order of the page."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from functools import partial

from rigidimeter.errors import UserError
from rigidimeter.paper import appendix, controller, highpass, score_rows
from rigidimeter.paper import printed_effects as effects
from rigidimeter.paper import protocol_rows as protocol
from rigidimeter.paper import sensitivity_rows as sensitivity
from rigidimeter.paper import simulated_epochs as simulated
from rigidimeter.paper import virtual_rows as virtual
from rigidimeter.paper.comparison_table import Row
from rigidimeter.paper.context import Context

__all__ = ["MAKERS", "SECTIONS", "chosen", "make_rows"]

Maker = Callable[[Context], Row]

_PER_DEGREE, _PER_RADIAN = controller.READINGS

SECTIONS: Mapping[str, Mapping[str, Maker]] = {
    "Equations": {
        "eq-1": score_rows.equation_1,
        "eq-2": score_rows.equation_2,
        "eq-3": controller.equation_3,
        "eq-4": controller.equation_4,
        "eq-5": controller.equation_5,
        "eq-6": highpass.equation_6,
        "eq-6-highpass": partial(
            highpass.highpass,
            _PER_DEGREE,
            "Sec. 2.4.4",
            "The slow pole of the loop lies near 0.16 Hz, beside the corner of the filter, which "
            "takes from the position what the torque still holds. No such filter can have been in "
            "the simulations of Sec. 3.4.",
        ),
        "eq-6-highpass-per-radian": partial(
            highpass.highpass,
            _PER_RADIAN,
            "Sec. 2.4.4 with App. A",
            "Read per radian the loop is faster than the filter and the same step costs little; "
            "the motion then is not the paper's (row app-a-units).",
        ),
        "eq-7": virtual.equation_7,
        "eq-8": appendix.equation_8,
        "eq-8-largest": appendix.largest_bandwidth,
    },
    "Figures": {
        "fig-3a": appendix.figure_3a,
        "fig-3b": protocol.figure_3b,
        "fig-4a": protocol.figure_4a,
        "fig-4b": partial(
            virtual.torque_figure,
            "fig-4b",
            "Fig. 4(b)",
            "torque",
            "the estimated torque describes the measured one well",
            "measured, estimated and simulated torque",
        ),
        "fig-4c": partial(
            virtual.torque_figure,
            "fig-4c",
            "Fig. 4(c)",
            "stiffness",
            "stiffness part; estimated and simulated differ more than for the viscosity",
            "the part of the stiffness, Kθ",
        ),
        "fig-4d": partial(
            virtual.torque_figure,
            "fig-4d",
            "Fig. 4(d)",
            "damping",
            "viscous part; estimated and simulated alike",
            "the part of the damping, Bθ′",
        ),
        "fig-5a": virtual.figure_5a,
        "fig-5b": partial(
            virtual.measure_figure,
            "fig-5b",
            "Fig. 5(b)",
            "impulse_nm_s",
            "angular impulse lower in DBS, p = 4.3e-4",
        ),
        "fig-5c": partial(
            virtual.measure_figure,
            "fig-5c",
            "Fig. 5(c)",
            "work_j",
            "work lower in DBS, p = 5.6e-4 (text)",
        ),
        "fig-6a": sensitivity.figure_6a,
        "fig-6b": sensitivity.figure_6b,
        "fig-6b-left-sum": sensitivity.left_sum,
        "fig-6b-delay": sensitivity.delay,
        "fig-7": virtual.figure_7,
        "fig-8a": partial(
            virtual.measure_figure,
            "fig-8a",
            "Fig. 8(a)",
            "inertia_kg_m2",
            "no significant difference of the inertia, p = 0.165",
        ),
        "fig-8b": partial(
            virtual.measure_figure,
            "fig-8b",
            "Fig. 8(b)",
            "damping_nm_s_rad",
            "viscosity lower in DBS, p = 5.0e-4",
        ),
        "fig-8c": partial(
            virtual.measure_figure,
            "fig-8c",
            "Fig. 8(c)",
            "stiffness_nm_rad",
            "stiffness lower in DBS, p = 1.8e-4 (the caption calls it viscosity)",
        ),
    },
    "Tables": {
        "table-1": protocol.table_1,
        "table-2": virtual.table_2,
        "table-2-mupdrs": partial(effects.line_of_table_2, "mupdrs"),
        "table-2-impulse": partial(effects.line_of_table_2, "impulse"),
        "table-2-work": partial(effects.line_of_table_2, "work"),
        "table-2-viscosity": partial(effects.line_of_table_2, "viscosity"),
        "table-2-stiffness": partial(effects.line_of_table_2, "stiffness"),
    },
    "Statements of the text": {
        "sec-1-voluntary-ols": simulated.voluntary_least_squares,
        "sec-1-voluntary-iv": simulated.voluntary_instruments,
        "sec-2.3-cycles-motion": protocol.cycles_of_motion,
        "sec-2.3-cycles-epoch": protocol.cycles_of_epoch,
        "sec-2.3-duration": protocol.session_length,
        "sec-2.4.2-units": partial(controller.units, _PER_DEGREE, "Sec. 2.4.2"),
        "sec-2.4.3-bandwidth": appendix.bandwidth,
        "sec-3.1-f-test": effects.f_test,
        "sec-3.2-cancel": sensitivity.cancelling,
        "p-mupdrs": partial(effects.p_of_text, "mupdrs"),
        "p-work": partial(effects.p_of_text, "work"),
        "p-viscosity": partial(effects.p_of_text, "viscosity"),
        "p-stiffness": partial(effects.p_of_text, "stiffness"),
        "k-printed": protocol.one_stiffness,
        "sec-3.6-order": effects.order_of_effects,
        "sec-4-better": effects.better_than_work,
    },
    "Simulations of Sec. 3.4": {
        "sec-3.4-mean": simulated.mean_errors,
        "sec-3.4-sd": simulated.spread_of_errors,
        "sec-3.4-noise": simulated.implied_noise,
    },
    "Appendix A": {
        "app-a-units": partial(controller.units, _PER_RADIAN, "App. A"),
        "app-a-forearm": appendix.forearm_inertia,
        "app-a-inertia": appendix.total_inertia,
        "app-a-damping": appendix.total_damping,
    },
}
"""By section and row: the function that makes it, in any order and on its own."""

MAKERS: Mapping[str, Maker] = {
    row_id: maker for makers in SECTIONS.values() for row_id, maker in makers.items()
}


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
        every = ", ".join(MAKERS)
        raise UserError(f"--only {unknown[0]}: there is no such row; the rows are {every}")
    return tuple(row_id for row_id in MAKERS if not wanted or row_id in wanted)


def make_rows(
    context: Context,
    only: Iterable[str] = (),
    progress: Callable[[str], None] = lambda _: None,
) -> list[Row]:
    """Make rows in the order of the page.

    Parameters
    ----------
    context : Context
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
        rows.append(replace(MAKERS[row_id](context), id=row_id))
        progress(row_id)
    return rows
