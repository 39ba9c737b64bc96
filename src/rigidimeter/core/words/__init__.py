"""Numbers and tables as people read them."""

from rigidimeter.core.words.numbers import (
    Shown,
    amount,
    axis_unit,
    clear_of_zero,
    condition_name,
    decimals,
    fixed,
    format_number,
    interval,
    interval_text,
    number,
    p_and_r,
    p_text,
    p_value,
    scaled,
    series,
    tick_labels,
    with_error,
    within,
)
from rigidimeter.core.words.tables import (
    INTERVAL,
    SESSION,
    TURNED,
    WORDS,
    Column,
    Kind,
    Table,
    shown_below,
    shown_value,
)
from rigidimeter.core.words.text import (
    epoch_name,
    epochs_text,
    html_table,
    one_cell,
    one_line,
    plural,
    short_names,
)
