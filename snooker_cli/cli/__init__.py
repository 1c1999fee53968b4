"""The command line, whose commands are loaded where an interrupt is answered already."""

import os
from functools import partial

from snooker_cli.cli.interrupts import at_once


def main() -> None:
    """Run the command line; the console script's entry."""
    # Sums of products are short here: a second thread would only wait for them, at full speed, and
    # how many there are would decide how they are rounded.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    with at_once():
        from snooker_cli.cli.commands import app
        from snooker_cli.cli.completion import rejoined
        from snooker_cli.cli.endings import guarded

        guarded(partial(app, prog_name="snooker", obj=rejoined()))
