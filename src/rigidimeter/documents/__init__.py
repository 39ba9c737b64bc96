"""Files of text, JSON, CSV and TOML: the one place where they are written, and read as values."""

from rigidimeter.documents.escaping import as_read, as_written, visible
from rigidimeter.documents.reading import (
    noted_digests,
    open_regular,
    parse_json,
    parse_toml,
    read_bytes,
    read_json,
    read_toml,
)
from rigidimeter.documents.writing import (
    csv_text,
    in_place,
    json_line,
    json_text,
    plain_values,
    replace_file,
    text_bytes,
    toml_text,
    write_json,
    write_text,
)
