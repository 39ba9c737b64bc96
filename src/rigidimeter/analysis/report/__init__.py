"""The report of a result: one page, its tables as CSV, its figures as SVG.

Loaded when it is asked for: matplotlib, which only figures need, takes as long as an epoch.
"""

from typing import TYPE_CHECKING

from rigidimeter.core.lazy_names import lazy_names

if TYPE_CHECKING:
    from rigidimeter.analysis.report.contents import Block, Figure, Section, paragraph
    from rigidimeter.analysis.report.make_report import report
    from rigidimeter.analysis.report.methods import methods_prose
    from rigidimeter.analysis.report.page import (
        data_uri,
        page_text,
        sections_of,
        shown_tables,
        shown_text,
        source_names,
    )
    from rigidimeter.analysis.report.report_folder import inputs_seen_from, why_not_own
    from rigidimeter.analysis.report.sections import SECTIONS
    from rigidimeter.analysis.report.shown import Shown

__all__ = [
    "SECTIONS",
    "Block",
    "Figure",
    "Section",
    "Shown",
    "data_uri",
    "inputs_seen_from",
    "methods_prose",
    "page_text",
    "paragraph",
    "report",
    "sections_of",
    "shown_tables",
    "shown_text",
    "source_names",
    "why_not_own",
]

__getattr__ = lazy_names(
    __name__,
    {
        "contents": ("Block", "Figure", "Section", "paragraph"),
        "make_report": ("report",),
        "methods": ("methods_prose",),
        "page": (
            "data_uri",
            "page_text",
            "sections_of",
            "shown_tables",
            "shown_text",
            "source_names",
        ),
        "report_folder": ("inputs_seen_from", "why_not_own"),
        "sections": ("SECTIONS",),
        "shown": ("Shown",),
    },
)
