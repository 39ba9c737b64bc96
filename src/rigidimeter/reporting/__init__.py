"""The report of a result: one page, its tables as CSV, its figures as SVG."""

from rigidimeter.reporting.contents import Column, Figure, Section, Table, bullets, paragraph
from rigidimeter.reporting.make_report import recording_result, report
from rigidimeter.reporting.sections import SECTIONS

__all__ = [
    "SECTIONS",
    "Column",
    "Figure",
    "Section",
    "Table",
    "bullets",
    "paragraph",
    "recording_result",
    "report",
]
