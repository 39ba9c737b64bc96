"""Many recordings at once, to one table: resumable, on one machine or a cluster."""

from rigidimeter.analysis.batch.archive_run import batch
from rigidimeter.analysis.batch.epoch_table import columns
from rigidimeter.analysis.batch.parts import Parts
