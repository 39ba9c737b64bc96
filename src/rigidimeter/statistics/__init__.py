"""Tables in, tables out: summaries, tests, mixed models and effect sizes."""

from rigidimeter.statistics.contrasts import (
    Contrast,
    JointTest,
    contrast,
    difference,
    interval_of,
    joint_test,
    pairwise,
)
from rigidimeter.statistics.day_model import (
    DayDifference,
    day_difference,
    day_medians,
    exact_ranksum,
)
from rigidimeter.statistics.effect_from_p import (
    PublishedDifference,
    PublishedEffect,
    compare_published,
    effect_from_p,
    largest_r,
    rank_biserial_interval,
)
from rigidimeter.statistics.effect_sizes import (
    EffectDifference,
    Effects,
    TwoGroups,
    compare_effects,
    effect_sizes,
    holm,
    rank_biserial,
    two_groups,
)
from rigidimeter.statistics.mixed import Mixed, fit_mixed, nested
from rigidimeter.statistics.ranksum import RankSum, ranksum
from rigidimeter.statistics.summary import Summary, summarise

__all__ = [
    "Contrast",
    "DayDifference",
    "EffectDifference",
    "Effects",
    "JointTest",
    "Mixed",
    "PublishedDifference",
    "PublishedEffect",
    "RankSum",
    "Summary",
    "TwoGroups",
    "compare_effects",
    "compare_published",
    "contrast",
    "day_difference",
    "day_medians",
    "difference",
    "effect_from_p",
    "effect_sizes",
    "exact_ranksum",
    "fit_mixed",
    "holm",
    "interval_of",
    "joint_test",
    "largest_r",
    "nested",
    "pairwise",
    "rank_biserial",
    "rank_biserial_interval",
    "ranksum",
    "summarise",
    "two_groups",
]
