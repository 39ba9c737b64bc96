"""Drawings on Axes of matplotlib: of the report, of the paper, and of `plot` in a notebook.

A function that draws takes the panels first; `drawn` makes the figure around them.
"""

from rigidimeter.analysis.figures.curves import (
    CHANNELS,
    EXCITATION_HEIGHTS,
    EXCITATION_SIZE,
    TORQUE_HEIGHTS,
    TORQUE_SIZE,
    WINDOW_S,
    draw_excitation,
    draw_impedance,
    draw_loops,
    draw_perturbation,
    draw_recorded,
    draw_spectrum,
    draw_torque,
    draw_unexplained,
    loop_limits,
    model_nm_rad,
    origin_s,
    recorded_size,
    shown_channels,
    torque_limit_nm,
)
from rigidimeter.analysis.figures.design_folder import draw_bode, write_design_folder
from rigidimeter.analysis.figures.inspected_columns import columns_figure, draw_columns
from rigidimeter.analysis.figures.interval_rows import (
    band_label,
    band_percent,
    by_measure,
    draw_bands,
    draw_effects,
    draw_methods,
    effect_rows,
    effect_words,
    effects_label,
    effects_size,
    methods_in,
    shift,
)
from rigidimeter.analysis.figures.plots import plot
from rigidimeter.analysis.figures.points import (
    Values,
    day_groups,
    day_rows,
    distribution_size,
    draw_days,
    draw_distribution,
    draw_ratings,
    draw_relations,
    draw_values,
    drawn_values,
    epoch_keys,
    longest_day,
    relation_words,
    values_of,
)
from rigidimeter.analysis.figures.style import (
    GREY,
    Look,
    condition_colours,
    condition_markers,
    drawn,
    note,
    styled,
    svg_text,
)
from rigidimeter.analysis.figures.svg_element import inline_svg
