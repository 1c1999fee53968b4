"""Store traces in an HDF5 file, valid H5MD 1.1; docs/file-format.md names all that is in it.

One file holds one batch: repeats of a point, one after the other. It is written under a temporary
name, flushed to the disk and then renamed, so a file is never incomplete. Values that the reader
would refuse are not written, see ``value_ranges``.
"""

from typing import TYPE_CHECKING

from snooker_cli.lazy_names import lazy_names
from snooker_cli.store.file_format import READABLE as READABLE
from snooker_cli.store.file_format import SCHEMA_VERSION as SCHEMA_VERSION
from snooker_cli.store.file_format import Fingerprint as Fingerprint
from snooker_cli.store.file_format import Provenance as Provenance
from snooker_cli.store.file_format import RepeatHeader as RepeatHeader
from snooker_cli.store.file_format import scene_hash as scene_hash
from snooker_cli.store.reader import check as check
from snooker_cli.store.reader import file_info as file_info
from snooker_cli.store.reader import read as read
from snooker_cli.store.reader import read_checkpoint as read_checkpoint
from snooker_cli.store.reader import read_events as read_events
from snooker_cli.store.reader import read_headers as read_headers
from snooker_cli.store.reader import read_last_events as read_last_events
from snooker_cli.store.value_ranges import EventCheck as EventCheck
from snooker_cli.store.value_ranges import check_repeats as check_repeats
from snooker_cli.store.value_ranges import check_snapshot as check_snapshot
from snooker_cli.store.value_ranges import fault_of as fault_of

if TYPE_CHECKING:
    from snooker_cli.store.writer import Recorder as Recorder
    from snooker_cli.store.writer import write as write

__getattr__ = lazy_names(__name__, {"writer": "Recorder write"})  # most commands only read
