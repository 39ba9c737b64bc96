"""The paper's equations, figures, tables and statements, recomputed by the product."""

from rigidimeter.paper.comparison_table import AGREES, DIFFERS, UNPUBLISHED, VERDICTS, Check, Row
from rigidimeter.paper.context import Context
from rigidimeter.paper.paper_page import ledger_text, render_page, tally, write_ledger
from rigidimeter.paper.rows import MAKERS, SECTIONS, chosen, make_rows

__all__ = ["Context", "make_rows"]
