"""A trace <-> an HDF5 file, valid H5MD 1.1; docs/file-format.md is the schema.

One file a repeat. Long columns are in chunks, each through HDF5's shuffle
and deflate filters, which every reader has. A file is written beside its place, flushed to the disk
and then renamed, so that a finished file can never be torn.
"""

from snooker_cli.store.fingerprint import Fingerprint, content_hash
from snooker_cli.store.parts import part_beside, parts_of_this_machine, whole
from snooker_cli.store.reading import About, about, check, events, glance, read
from snooker_cli.store.recording import Recorder, write
from snooker_cli.store.records import (
    SCHEMA_VERSION,
    AbsentError,
    Checked,
    Provenance,
    Stored,
    StoreError,
    Told,
)
from snooker_cli.store.states import write_states

__all__ = [
    "SCHEMA_VERSION",
    "About",
    "AbsentError",
    "Checked",
    "Fingerprint",
    "Provenance",
    "Recorder",
    "StoreError",
    "Stored",
    "Told",
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
    "write_states",
]
