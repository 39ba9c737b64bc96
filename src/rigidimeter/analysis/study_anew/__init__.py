"""A study as one long table: a row for each epoch and measure, everything else a function of it.

Not used by the program yet: it takes the place of `analysis.study` when it is whole.
"""
