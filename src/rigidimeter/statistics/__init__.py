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
)
from rigidimeter.statistics.effect_from_p import (
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
from rigidimeter.statistics.exact_ranks import exact_ranksum
from rigidimeter.statistics.mixed import Mixed, fit_mixed, nested
from rigidimeter.statistics.partially_paired import PartiallyPaired, partially_paired
from rigidimeter.statistics.rank_correlation import RankCorrelation, rank_correlation
from rigidimeter.statistics.ranksum import RankSum, ranksum
from rigidimeter.statistics.summary import Summary, summarise
