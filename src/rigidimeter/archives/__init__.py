"""Many recordings at once, to one table: resumable, on one machine or a cluster."""

from rigidimeter.archives.archive_run import batch
