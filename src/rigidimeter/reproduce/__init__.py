"""The paper's equations, figures, tables and statements, recomputed by the product."""

from rigidimeter.reproduce.catalogue import MAKERS, SECTIONS, chosen, make_rows
from rigidimeter.reproduce.ledger import AGREES, DIFFERS, UNPUBLISHED, VERDICTS, Check, Row
from rigidimeter.reproduce.page import ledger_text, render_page, tally, write_ledger
from rigidimeter.reproduce.workshop import DEFAULT_SEED, Workshop

__all__ = [
    "AGREES",
    "DEFAULT_SEED",
    "DIFFERS",
    "MAKERS",
    "SECTIONS",
    "UNPUBLISHED",
    "VERDICTS",
    "Check",
    "Row",
    "Workshop",
    "chosen",
    "ledger_text",
    "make_rows",
    "render_page",
    "tally",
    "write_ledger",
]
