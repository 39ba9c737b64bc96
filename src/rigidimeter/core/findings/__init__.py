"""What a check found, as data, and the one place of its words.

`Finding` is what was measured and what it does to J, B and K. `KINDS` lists every kind of finding
with its unit, its default level and its templates; code from outside the package may add its own.
"""

from rigidimeter.core.findings.finding import (
    SERIOUS_FIRST,
    UNKNOWN_EFFECT,
    Effect,
    Fact,
    Finding,
    Three,
    finding_from,
    found_between,
)
from rigidimeter.core.findings.kind import Kind, Level
from rigidimeter.core.findings.kinds import KINDS, default_level
from rigidimeter.core.findings.kinds_of_study import STUDY_KINDS
from rigidimeter.core.findings.words import Words, explained, words_of
