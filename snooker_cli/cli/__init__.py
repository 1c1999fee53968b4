"""The command line; ``main`` is the entry of the console script."""

import gc
import io
import os
import sys
from functools import partial

from snooker_cli.errors import end_interrupted, guarded, handling
from snooker_cli.formatting import in_encoding

COLLECT_AFTER = 100_000
"""New objects between two garbage collections: modules make many, and all of them stay."""


class PlainStream(io.TextIOWrapper):
    """A text stream that writes plain words for what its encoding lacks.

    As it takes any text, its ``encoding`` is UTF-8: Typer would write bytes of UTF-8 past it if it
    were ASCII.
    """

    encoding = "utf-8"

    def __init__(self, stream: io.TextIOWrapper) -> None:
        lines = stream.line_buffering
        super().__init__(stream.buffer, stream.encoding, "backslashreplace", line_buffering=lines)
        self._written_in, self._owner = stream.encoding, stream  # which else closes the buffer

    def write(self, text: str) -> int:
        """Write text, and return its number of characters."""
        super().write(in_encoding(text, self._written_in))
        return len(text)


def main() -> None:
    """Run the command line."""
    # What goes to a closed stream (`>&-`) is dropped. Otherwise a result file would get its number.
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, mode, encoding="utf-8"))  # noqa: PTH123, SIM115
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if not stream.encoding.lower().startswith("utf"):
            setattr(sys, name, PlainStream(stream))
    os.environ["MPLBACKEND"] = "agg"  # figures are files; a notebook's backend may not even exist
    # The products of matrices here are small. More threads would only wait for them, and the
    # number of threads would decide how sums are rounded.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    gc.set_threshold(COLLECT_AFTER)
    with handling(end_interrupted):
        from snooker_cli.cli.app import app

        guarded(partial(app, prog_name="snooker"))
