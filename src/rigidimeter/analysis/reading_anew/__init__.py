"""Recordings of any laboratory as epochs: the successor of `analysis.reading`, not yet in use.

A file becomes `Columns`; a `Mapping` says which column is which quantity, in what unit; one gate
compares the numbers with what a joint can do; what passes is cut into epochs.
"""

from rigidimeter.analysis.reading_anew.columns import Column, Columns, Interval
from rigidimeter.analysis.reading_anew.gate import RULES, Rule, broken
from rigidimeter.analysis.reading_anew.judge import Verdict, verdict
from rigidimeter.analysis.reading_anew.mapping import (
    Fault,
    Mapping,
    Pick,
    mapping_of,
    mapping_text,
    merged,
    read_mapping,
    words,
)
from rigidimeter.analysis.reading_anew.readers import READERS, Reader, columns_of, reader_of
from rigidimeter.analysis.reading_anew.recording import Recording, read_file, recording_of
from rigidimeter.analysis.reading_anew.search import Proposal, propose
from rigidimeter.analysis.reading_anew.seen import Seen, look
