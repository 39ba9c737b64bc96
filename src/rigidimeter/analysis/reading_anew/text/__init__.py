"""Recordings as text: one path, on which the programs that wrote them are rows of a table."""
