"""The command line; ``main`` is the entry of the console script."""

import gc
import os
import sys

COLLECT_AFTER = 100_000
"""New objects between two garbage collections: modules make many, and all of them stay."""


def main() -> None:
    """Run the command line."""
    try:
        from snooker_cli.signals import begin_process, end_interrupted, handling
    except KeyboardInterrupt:
        os.write(2, b"snooker: interrupted\n")
        os._exit(130)
    begin_process()  # before all else, because modules take time to load
    from snooker_cli.errors import guarded

    # What goes to a closed stream (`>&-`) is dropped; else a result file would get its number.
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, mode, encoding="utf-8"))  # noqa: PTH123, SIM115
    for name in ("stdout", "stderr"):
        if not getattr(sys, name).encoding.lower().startswith("utf"):
            from snooker_cli.cli.plain_stream import PlainStream

            setattr(sys, name, PlainStream(getattr(sys, name)))
    os.environ["MPLBACKEND"] = "agg"  # figures are files; a notebook's may not even exist
    # The products of matrices here are small. More threads would only wait for them, and the
    # number of threads would decide how sums are rounded.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    gc.set_threshold(COLLECT_AFTER)

    def run() -> None:
        with handling(end_interrupted):
            from snooker_cli.cli.app import app
        app(prog_name="snooker")

    guarded(run)
