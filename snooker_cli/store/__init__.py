"""A trace <-> an HDF5 file, valid H5MD 1.1; this docstring is the schema.

One file a repeat. Units are in the attribute ``unit``; k_B = 1, so that temperature is in J.

=======================================  ================================================
``/h5md``                                ``version`` = [1, 1]; groups author, creator
``/parameters/snooker``                  attributes ``schema_version``, ``content`` (hash),
                                         ``provenance`` and ``ending`` (JSON)
``/particles/balls/position``            element, float64 [2, N, 2] m: start and finish
``/particles/balls/velocity``            element, float64 [2, N, 2] m s-1
``/particles/balls/mass``, ``radius``    float64 [N], kg and m
``/particles/container/position``        element, float64 [2, 1, 2] m
``/particles/container/velocity``        element, float64 [2, 1, 2] m s-1
``/particles/container/mass``            float64 [1] kg; inf if the container is fixed
``/particles/container/radius``          float64 [1] m; nan for a box
``/particles/*/box/edges``               float64 [2] m: width and height, not for a circle
``/connectivity/collisions``             element, int32 [n, 1, 2]: ball, and ball, -1 or -2
``/observables/impulse``                 element, float64 [n] kg m s-1
``/observables/summary/QUANTITY``        element, float64 [g]: see ``trace.Series``
=======================================  ================================================

In a collision -1 is the wall. With -2 a ball slides along it: the first such row of a ball since it
last met another stands, at its time, for the infinitely many bounces before, the next ones for its
pressing since the row before; ``impulse`` is the sum of the bounces' and the pressing's.

An element is a group of ``step``, ``time`` (s) and ``value``.
``connectivity`` and ``impulse`` share one ``step`` and one ``time`` (s), and are there if events
were recorded; ``summary`` if not. Long columns are in chunks, each through HDF5's shuffle and
deflate filters, which every reader has. A file is written beside its place, flushed to the disk
and then renamed, so that a finished file can never be torn.
"""

from snooker_cli.store.fingerprint import Fingerprint, content_hash
from snooker_cli.store.parts import part_beside, parts_of_this_machine
from snooker_cli.store.reading import check, glance, read
from snooker_cli.store.recording import Recorder, write
from snooker_cli.store.records import (
    SCHEMA_VERSION,
    Checked,
    Provenance,
    Stored,
    StoreError,
    Told,
)

__all__ = [
    "SCHEMA_VERSION",
    "Checked",
    "Fingerprint",
    "Provenance",
    "Recorder",
    "StoreError",
    "Stored",
    "Told",
    "check",
    "content_hash",
    "glance",
    "part_beside",
    "parts_of_this_machine",
    "read",
    "write",
]
