"""Files of text, JSON, CSV and TOML: the one place where they are written, and read as values."""

from rigidimeter.core.files.checksum import (
    FIELD,
    ZEROS,
    checksum_holds,
    covered_values,
    digest_hex,
    with_checksum,
)
from rigidimeter.core.files.data_dictionary import (
    DICTIONARY,
    Meaning,
    described,
    dictionary_text,
    is_dictionary,
    meaning_of,
    write_dictionary,
    write_dictionary_beside,
)
from rigidimeter.core.files.escaping import NUMBER_TEXT, as_read, as_written, printable, visible
from rigidimeter.core.files.label_table import (
    TextTable,
    cell_number,
    cells_of,
    checked_names,
    first_line_names,
    read_text_table,
    refuse_duplicates,
    wrong_count,
)
from rigidimeter.core.files.reading import (
    noted_digests,
    open_regular,
    parse_json,
    parse_toml,
    read_bytes,
    read_json,
    read_toml,
)
from rigidimeter.core.files.size_limits import (
    BOOTSTRAP_COUNTS,
    CELLS,
    DOCUMENT_BYTES,
    ESTIMATES_BYTES,
    EXPANDED_BYTES,
    EXPANSION,
    MAGNITUDE,
    MAX_COLUMNS,
    MAX_DIGITS,
    MAX_EPOCHS,
    MAX_NOTICES,
    MIB,
    NESTING,
    RANKED_PAIRS,
    RECORDING_BYTES,
    SAMPLING_RATE_HZ,
    SCORES_BY_GROUPS_SQUARED,
    SETTINGS_BYTES,
    TABLE_BYTES,
    TABLE_ROWS,
    lines_text,
    size_text,
)
from rigidimeter.core.files.text_lines import (
    content,
    is_missing,
    joined_names,
    read_utf8,
    records,
    trimmed,
)
from rigidimeter.core.files.writing import (
    append_line,
    csv_text,
    in_place,
    json_line,
    json_text,
    lock,
    plain_values,
    replace_file,
    text_bytes,
    toml_text,
    write_json,
    write_text,
)
