"""``snooker bench``: measure the engine."""

from __future__ import annotations

import typer

from snooker_cli.cli.running import AsJson

bench = typer.Typer(help="Measure the engine.", no_args_is_help=True)


@bench.callback()
def _root() -> None:
    """Measure the engine."""


@bench.command()
def speed(as_json: AsJson = False) -> None:
    """Collisions per second of one thread, for several scenes; let nothing else run meanwhile."""
    import json
    import platform

    from snooker_cli.bench.speed import CASES, measure
    from snooker_cli.cli.tables import Column, print_table

    timings = [measure(case) for case in CASES]
    if as_json:
        typer.echo(
            json.dumps({"machine": platform.platform(), "cases": [vars(t) for t in timings]})
        )
        return
    print_table(
        [
            Column("scene"),
            Column("balls", True),
            Column("packing", True),
            Column("collisions/s", True),
            Column("lowest to highest", True),
        ],
        [
            [
                timing.case,
                str(timing.balls),
                f"{timing.packing_fraction:.4f}",
                f"{timing.median / 1e6:.2f} M",
                f"{timing.lowest / 1e6:.2f} to {timing.highest / 1e6:.2f} M",
            ]
            for timing in timings
        ],
    )
