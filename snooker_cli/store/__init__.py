"""A trace <-> an HDF5 file, valid H5MD 1.1; docs/file-format.md is the schema.

One file a repeat. Long columns are in chunks, each through HDF5's shuffle
and deflate filters, which every reader has. A file is written beside its place, flushed to the disk
and then renamed, so that a finished file can never be torn.
"""

from snooker_cli.store.file_format import (
    SCHEMA_VERSION,
    Checked,
    Fingerprint,
    Provenance,
    RepeatHeader,
    Stored,
    content_hash,
)
from snooker_cli.store.reader import About, about, check, events, glance, read
from snooker_cli.store.writer import Recorder, part_beside, parts_of_this_machine, whole, write

__all__ = [
    "SCHEMA_VERSION",
    "About",
    "Checked",
    "Fingerprint",
    "Provenance",
    "Recorder",
    "RepeatHeader",
    "Stored",
    "about",
    "check",
    "content_hash",
    "events",
    "glance",
    "part_beside",
    "parts_of_this_machine",
    "read",
    "whole",
    "write",
]
