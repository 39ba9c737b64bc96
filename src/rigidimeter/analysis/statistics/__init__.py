"""Tables in, tables out: summaries, tests, mixed models and effect sizes."""

from rigidimeter.analysis.statistics.contrasts import (
    Contrast,
    JointTest,
    contrast,
    difference,
    interval_of,
    joint_test,
)
from rigidimeter.analysis.statistics.day_components import DayComponents, day_components
from rigidimeter.analysis.statistics.day_levels import (
    PartiallyPaired,
    SubjectEpochs,
    partially_paired,
    test_by_levels,
)
from rigidimeter.analysis.statistics.day_model import (
    DayDifference,
    day_difference,
    day_medians,
)
from rigidimeter.analysis.statistics.effects import (
    EffectDifference,
    Effects,
    TwoGroups,
    compare_effects,
    effect_sizes,
    holm,
    rank_biserial,
    two_groups,
)
from rigidimeter.analysis.statistics.mixed import Mixed, fit_mixed, nested
from rigidimeter.analysis.statistics.precision import WANTED_PERCENT, Precision, precision_of
from rigidimeter.analysis.statistics.profiled_likelihood import evaluate, minimise, products
from rigidimeter.analysis.statistics.published_effects import (
    compare_published,
    effect_from_p,
    largest_r,
    rank_biserial_interval,
)
from rigidimeter.analysis.statistics.ranks import (
    RankCorrelation,
    RankSum,
    exact_ranksum,
    rank_correlation,
    ranksum,
)
from rigidimeter.analysis.statistics.resampling import bootstrap
from rigidimeter.analysis.statistics.summary import Summary, summarise
