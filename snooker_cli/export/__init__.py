"""A repeat -> tables and frames for other programs: CSV, Parquet, H5MD."""

from snooker_cli.export.frames import frames
from snooker_cli.export.parquet import write_parquet
from snooker_cli.export.tables import (
    EVENTS,
    STATES,
    Table,
    csv_lines,
    events_table,
    states_table,
    write_csv,
)
from snooker_cli.export.writing import ExportError

__all__ = [
    "EVENTS",
    "STATES",
    "ExportError",
    "Table",
    "csv_lines",
    "events_table",
    "frames",
    "states_table",
    "write_csv",
    "write_parquet",
]
