"""The command line; ``main`` is the entry of the console script."""

import gc
import os
import sys
from functools import partial

from snooker_cli.errors import end_interrupted, guarded, handling

COLLECT_AFTER = 100_000
"""New objects between two garbage collections: modules make many, and all of them stay."""


def main() -> None:
    """Run the command line."""
    # What goes to a closed stream (`>&-`) is dropped. Otherwise a result file would get its number.
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, mode, encoding="utf-8"))  # noqa: PTH123, SIM115
    # The products of matrices here are small. More threads would only wait for them, and the
    # number of threads would decide how sums are rounded.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    gc.set_threshold(COLLECT_AFTER)
    with handling(end_interrupted):
        from snooker_cli.cli.app import app

        guarded(partial(app, prog_name="snooker"))
