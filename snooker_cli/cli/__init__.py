"""The command line, whose commands are loaded where an interrupt is answered already."""

import gc
import os
from functools import partial

from snooker_cli.cli.exit_codes import at_once

RARELY = 100_000
"""New objects after which to look for garbage: modules make many, and all of them stay."""


def main() -> None:
    """Run the command line; the console script's entry."""
    # Sums of products are short here: a second thread would only wait for them, at full speed, and
    # how many there are would decide how they are rounded.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    gc.set_threshold(RARELY)
    with at_once():
        from snooker_cli.cli.app import app
        from snooker_cli.cli.exit_codes import guarded

        guarded(partial(app, prog_name="snooker"))
