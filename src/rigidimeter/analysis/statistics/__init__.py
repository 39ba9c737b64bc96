"""Tables in, tables out: summaries, tests, mixed models and effect sizes."""

from rigidimeter.analysis.statistics.bootstrap import bootstrap
from rigidimeter.analysis.statistics.contrasts import (
    Contrast,
    JointTest,
    contrast,
    difference,
    interval_of,
    joint_test,
    pairwise,
)
from rigidimeter.analysis.statistics.day_levels import Epochs, test_by_levels
from rigidimeter.analysis.statistics.day_model import (
    DayDifference,
    day_difference,
    day_medians,
)
from rigidimeter.analysis.statistics.effect_from_p import (
    compare_published,
    effect_from_p,
    largest_r,
    rank_biserial_interval,
)
from rigidimeter.analysis.statistics.effect_sizes import (
    EffectDifference,
    Effects,
    TwoGroups,
    compare_effects,
    effect_sizes,
    holm,
    rank_biserial,
    two_groups,
)
from rigidimeter.analysis.statistics.exact_ranks import exact_ranksum
from rigidimeter.analysis.statistics.mixed import Mixed, fit_mixed, nested
from rigidimeter.analysis.statistics.partially_paired import PartiallyPaired, partially_paired
from rigidimeter.analysis.statistics.profiled_likelihood import evaluate, minimise, products
from rigidimeter.analysis.statistics.rank_correlation import RankCorrelation, rank_correlation
from rigidimeter.analysis.statistics.ranksum import RankSum, ranksum
from rigidimeter.analysis.statistics.summary import Summary, summarise
