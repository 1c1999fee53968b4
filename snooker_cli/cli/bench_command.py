"""``snooker bench``: measure the engine's speed, and its errors beside those of other ways."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from snooker_cli.cli.options import AsJson
from snooker_cli.cli.output import notice
from snooker_cli.errors import ExitCode, UserError
from snooker_cli.formatting import Column, counted, short, table_lines, with_error

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from snooker_cli.figures import FigureData


Out = Annotated[
    Path | None,
    typer.Option("--out", metavar="DIR", help="Also write tables, JSON and any figures there."),
]

bench = typer.Typer(
    help="Measure the engine: speed, errors, physics, hard cases.",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,
)


@bench.command()
def speed(
    quick: Annotated[
        bool, typer.Option("--quick", help="In seconds, to see that it works: not to be quoted.")
    ] = False,
    everything: Annotated[
        bool, typer.Option("--all", help="A million balls too, which takes some minutes more.")
    ] = False,
    out: Out = None,
    as_json: AsJson = False,
) -> None:
    """Collisions per second of one thread, for several gases, and what else a run takes.

    It takes a minute or two; let nothing else run meanwhile.
    """
    from snooker_cli.validation.speed_study import (
        ALL_PLAN,
        FULL_PLAN,
        SMALL_PLAN,
        lines_of_speed,
        measured,
        pictures,
    )

    measurement = measured(SMALL_PLAN if quick else ALL_PLAN if everything else FULL_PLAN, notice)
    _give("speed", measurement, lines_of_speed(measurement), pictures, out, as_json)


@bench.command()
def error(
    quick: Annotated[
        bool, typer.Option("--quick", help="Seven balls, in seconds: not to be quoted.")
    ] = False,
    out: Out = None,
    as_json: AsJson = False,
) -> None:
    """Errors and costs of snooker, of the report's algorithm and of time stepping, side by side.

    snooker runs in 64 bits and, for comparison, in 32. The truth is computed with as many digits as
    chaos asks for. It takes a minute or two; let nothing else run meanwhile.
    """

    try:
        from snooker_cli.validation.accuracy_study import full_plan, measured, quick_plan
    except ModuleNotFoundError as missing:
        if missing.name != "mpmath":
            raise
        raise UserError(
            "mpmath is not installed; install snooker's extra: pip install 'snooker-cli[reference]'"
        ) from None

    measurement = measured(quick_plan() if quick else full_plan(), notice)
    from snooker_cli.validation.accuracy_study import pictures

    _give("error", measurement, _lines_of_errors(measurement), pictures, out, as_json)


@bench.command()
def physics(
    quick: Annotated[
        bool, typer.Option("--quick", help="Few balls, in seconds: not to be quoted.")
    ] = False,
    out: Out = None,
    as_json: AsJson = False,
) -> None:
    """Pressures, collision rates, cooling and speeds beside what is known of them.

    Each with its standard error, and how many of them lie between. It takes two to four minutes,
    and ends with exit code 4 if a row does not agree.
    """
    from snooker_cli.validation.physics_study import (
        full_plan,
        lines_of_physics,
        measured,
        pictures,
        quick_plan,
    )

    measurement = measured(quick_plan() if quick else full_plan(), notice)
    _give("physics", measurement, lines_of_physics(measurement), pictures, out, as_json)
    if not all(row["agrees"] for row in measurement["rows"]):
        raise typer.Exit(int(ExitCode.SOME_FAILED))


@bench.command()
def hard(
    cases: Annotated[
        list[str] | None,
        typer.Argument(metavar="[CASE]...", help="Only these [all but those that take minutes]."),
    ] = None,
    configs: Annotated[
        Path, typer.Option("--configs", metavar="DIR", help="The folder of the cases' configs.")
    ] = Path("configs", "hard"),
    out: Out = None,
    as_json: AsJson = False,
) -> None:
    """Scenes made to break an engine, and whether they do: each with both engines.

    Everything that must be true is measured beside what rounding alone could do. It takes half a
    minute, and ends with exit code 4 if a case fails.
    """
    from snooker_cli.validation.hard_cases import chosen, lines_of_hard, measured

    measurement = measured(chosen(cases or [], configs), configs, notice)
    _give("hard", measurement, lines_of_hard(measurement), lambda _: [], out, as_json)
    if not all(case["holds"] for case in measurement["cases"]):
        raise typer.Exit(int(ExitCode.SOME_FAILED))


def _give(
    name: str,
    measurement: dict[str, Any],
    lines: Iterator[str],
    pictures: Callable[[dict[str, Any]], list[tuple[str, FigureData]]],
    out: Path | None,
    as_json: bool,
) -> None:
    """Print a measurement, and write it as tables, JSON and figures if there is a folder for it."""
    import json

    text = json.dumps(measurement, ensure_ascii=False, allow_nan=False)
    tables = "\n".join(lines)
    typer.echo(text if as_json else tables)
    if out is None:
        return

    from snooker_cli.figures.drawing import save

    out.mkdir(parents=True, exist_ok=True)
    written = [out / f"{name}.txt", out / f"{name}.json"]
    for path, content in zip(written, (tables, text), strict=True):
        path.write_text(content + "\n", encoding="utf-8")
    for stem, picture in pictures(measurement):
        written += save(picture, out / stem)
    for path in written:
        notice(str(path))


LEGEND = """\
events/s: processor time from the scene to its end, all that a short run needs included
m at n: error of place at the true time of event n, root mean square over the balls
true: events before the first with other bodies; events: how many until the same time
overlap: the deepest of two bodies, or of a ball and the wall
energy, momentum, angular: what is missing in the books, as a part of what there was"""


def _lines_of_errors(measurement: dict[str, Any]) -> Iterator[str]:
    """The measurement as tables for people."""
    yield LEGEND
    yield ""
    for scene in measurement["scenes"]:
        yield from _lines_of_scene(scene)
        yield ""
    for ensemble in measurement["ensembles"]:
        yield from _lines_of_ensemble(ensemble)
        yield ""
    yield from _lines_of_horizons(measurement["horizons"])


def _lines_of_scene(scene: dict[str, Any]) -> Iterator[str]:
    """What one scene cost and how wrong it came out, by each method."""
    collisions = scene["collisions"]
    yield (
        f"{scene['name']}: {scene['what']}; {counted(collisions, 'event')}, "
        f"{scene['certain']} of them certain in {scene['digits']} digits"
    )
    checkpoints = scene["checkpoints"]
    shown = [k for k, events in enumerate(checkpoints) if events in (10, 100, collisions)]
    yield from table_lines(
        [
            Column("method"),
            Column("events/s", True),
            *(Column(f"m at {checkpoints[k]}", True) for k in shown),
            Column("true", True),
            Column("events", True),
            Column("overlap, m", True),
            Column("energy", True),
            Column("momentum", True),
            Column("angular", True),
        ],
        [
            [
                one["method"],
                f"{one['events_per_second']:,.0f}",
                *(_small(one["place_errors"][k]) for k in shown),
                str(one["first_different"]),
                str(one["collisions"]),
                _small(one["overlap"]),
                *(
                    _small(one["ledger"][name])
                    for name in ("energy", "momentum", "angular_momentum")
                ),
            ]
            for one in scene["results"]
        ],
    )


def _lines_of_ensemble(ensemble: dict[str, Any]) -> Iterator[str]:
    """Averages over repeats and their differences from snooker's."""
    yield (
        f"averages of {ensemble['what']}: {ensemble['repeats']} repeats of {ensemble['time']:g} s, "
        "and differences from snooker's, ± standard error"
    )
    names = [bias["quantity"] for bias in ensemble["methods"][0]["biases"]]
    yield from table_lines(
        [
            Column("method"),
            *(Column(each, True) for name in names for each in (name, "difference")),
            Column("overlap, m", True),
            Column("in repeats", True),
        ],
        [
            [
                one["method"],
                *(
                    cell
                    for bias in one["biases"]
                    for cell in (
                        with_error(bias["mean"], bias["error"]),
                        "–" if k == 0 else with_error(bias["difference"], bias["difference_error"]),
                    )
                ),
                _small(one["overlap"]),
                str(one["overlapping"]),
            ]
            for k, one in enumerate(ensemble["methods"])
        ],
    )


def _lines_of_horizons(horizons: list[dict[str, Any]]) -> Iterator[str]:
    """How far ahead scenes can be computed."""
    yield (
        "horizon: the first event with other bodies than in truth, beside ln(1/ε)/λ, at which one "
        "rounding has grown to 1"
    )
    yield from table_lines(
        [
            Column("scene"),
            Column("event, each repeat"),
            Column("ln(1/ε)/λ", True),
            Column("λ measured, 1/event", True),
            Column("λ known", True),
        ],
        [
            [
                one["name"],
                ", ".join(str(each["parted"]) for each in one["repeats"]),
                f"{one['estimate']:.0f}",
                short(one["mean_exponent"]),
                f"{one['exponent']:g}",
            ]
            for one in horizons
        ],
    )


def _small(value: float | None) -> str:
    """An error to two digits, as 1.2e-15; a dash for none."""
    return "–" if value is None else f"{value:.1e}".replace("-", "−")
