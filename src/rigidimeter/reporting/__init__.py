"""The report of a study: one page, its tables as CSV, its figures as SVG."""

from rigidimeter.reporting.page import write_report
from rigidimeter.reporting.page_table import csv_text
from rigidimeter.reporting.report_tables import results_table

__all__ = ["csv_text", "results_table", "write_report"]
