"""Store traces in an HDF5 file, valid H5MD 1.1; docs/file-format.md names all that is in it.

One file holds one batch: repeats of a point, one after the other. It is written under a temporary
name, flushed to the disk and then renamed, so a file is never incomplete.
"""

from snooker_cli.store.file_format import (
    SCHEMA_VERSION,
    Fingerprint,
    Provenance,
    RepeatHeader,
    content_hash,
)
from snooker_cli.store.reader import (
    FileInfo,
    check,
    file_info,
    read,
    read_checkpoint,
    read_events,
    read_headers,
)
from snooker_cli.store.writer import Recorder, write

__all__ = [
    "SCHEMA_VERSION",
    "FileInfo",
    "Fingerprint",
    "Provenance",
    "Recorder",
    "RepeatHeader",
    "check",
    "content_hash",
    "file_info",
    "read",
    "read_checkpoint",
    "read_events",
    "read_headers",
    "write",
]
