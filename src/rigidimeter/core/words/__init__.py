"""Numbers and tables as people read them."""

from rigidimeter.core.words.numbers import (
    amount,
    axis_unit,
    condition_name,
    decimals,
    fixed,
    interval,
    number,
    p_and_r,
    p_value,
    scaled,
    series,
    within,
)
from rigidimeter.core.words.tables import (
    INTERVAL,
    SESSION,
    WORDS,
    Column,
    Kind,
    Table,
    shown_below,
    shown_value,
)
from rigidimeter.core.words.text import (
    html_table,
    interval_text,
    one_cell,
    one_line,
    plural,
    short_names,
    with_error,
)
