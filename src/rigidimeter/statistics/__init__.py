"""Tables in, tables out: summaries, tests and effect sizes."""

from rigidimeter.statistics.ranksum import RankSum, ranksum
from rigidimeter.statistics.summary import Summary, summarise

__all__ = ["RankSum", "Summary", "ranksum", "summarise"]
