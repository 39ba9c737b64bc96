"""The report of a study: one page, its tables as CSV, its figures as SVG."""

from rigidimeter.report.page import write_report
from rigidimeter.report.table import csv_text
from rigidimeter.report.tables import results_table

__all__ = ["csv_text", "results_table", "write_report"]
