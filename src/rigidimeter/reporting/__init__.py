"""The report of a result: one page, its tables as CSV, its figures as SVG.

Loaded when it is asked for: matplotlib, which only figures need, takes as long as an epoch.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rigidimeter.reporting.contents import Column, Figure, Section, Table, bullets, paragraph
    from rigidimeter.reporting.make_report import report
    from rigidimeter.reporting.sections import SECTIONS

__all__ = ["SECTIONS", "Column", "Figure", "Section", "Table", "bullets", "paragraph", "report"]


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    modules = {"SECTIONS": "sections", "report": "make_report"}
    return getattr(import_module(f"{__name__}.{modules.get(name, 'contents')}"), name)
