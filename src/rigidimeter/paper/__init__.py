"""The paper's equations, figures, tables and statements, recomputed by the product."""

from rigidimeter.paper.comparison_table import (
    AGREES,
    DIFFERS,
    UNPUBLISHED,
    VERDICTS,
    Bound,
    Claim,
    bounded,
    near,
    rounded,
    within_percent,
)
from rigidimeter.paper.context import Context
from rigidimeter.paper.controller import position_sd_deg
from rigidimeter.paper.highpass import highpass_errors_percent
from rigidimeter.paper.printed import TABLE_1
from rigidimeter.paper.printed_effects import n_from, p_from, r_from
from rigidimeter.paper.protocol_rows import cycles_counted
from rigidimeter.paper.rows import (
    MAKERS,
    STATEMENTS,
    chosen,
    drawn,
    ledger_text,
    make_rows,
    render_paper,
    tally,
    write_ledger,
)
from rigidimeter.paper.score_rows import (
    factored,
    imposed_epoch,
    scored,
    work_change_percent,
    work_closed_form_j,
)
from rigidimeter.paper.simulated_epochs import noise_runs, voluntary_errors_percent
