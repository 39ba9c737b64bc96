"""Recordings of any laboratory as epochs: the successor of `analysis.reading`, not yet in use.

A file becomes `Columns`; a `Mapping` says which column is which quantity, in what unit; one gate
compares the numbers with what a joint can do; what passes is cut into epochs.
"""
