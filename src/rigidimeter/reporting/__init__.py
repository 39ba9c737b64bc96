"""The report of a study: one page, its tables as CSV, its figures as SVG."""

from rigidimeter.reporting.page import write_report

__all__ = ["write_report"]
