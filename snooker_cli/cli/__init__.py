"""The command line; ``main`` is the entry of the console script."""

import gc
import os
from functools import partial

from snooker_cli.cli.exit_codes import ending_on_interrupt

COLLECT_AFTER = 100_000
"""New objects between two garbage collections: modules make many, and all of them stay."""


def main() -> None:
    """Run the command line."""
    # The products of matrices here are small. More threads would only wait for them, and the
    # number of threads would decide how sums are rounded.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    gc.set_threshold(COLLECT_AFTER)
    with ending_on_interrupt():
        from snooker_cli.cli.app import app
        from snooker_cli.cli.exit_codes import guarded

        guarded(partial(app, prog_name="snooker"))
