"""``snooker bench``: measure the engine: its speed, its errors, hard cases, known physics."""

from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from snooker_cli import options
from snooker_cli.api.output_files import made_folder
from snooker_cli.cli.app import Command, Group
from snooker_cli.cli.output import print_line
from snooker_cli.cli.parameters import takes
from snooker_cli.errors import ExitCode, notice

if TYPE_CHECKING:
    from snooker_cli.validation.study import Record, Study

WRITTEN = options.BENCH_OUT, options.AS_JSON

bench = typer.Typer(
    cls=Group,
    help="Measure the engine: speed, errors, physics, hard cases.",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,
)


@bench.command(cls=Command)
@takes(options.QUICK, options.EARLIER, *WRITTEN)
def speed(*, quick: bool, compare: Path | None, out: Path | None, as_json: bool) -> None:
    """Measure repeats and collisions per second.

    All threads run, store and analyse many short repeats. Then one thread simulates several gases.
    It takes a minute or two. Run nothing else meanwhile.
    """
    from snooker_cli.validation.speed_study import SPEED
    from snooker_cli.validation.study_tables import earlier_record

    more = {} if compare is None else {"earlier": earlier_record(compare)}
    _carry_out(SPEED, SPEED.plan(quick), out, as_json, more)


@bench.command(cls=Command)
@takes(options.QUICK, *WRITTEN)
def error(*, quick: bool, out: Path | None, as_json: bool) -> None:
    """Compare errors and costs of several methods with an exact result.

    The methods are snooker, the source report's algorithm and time stepping. The exact result is
    computed with intervals. It takes a minute or two. Run nothing else meanwhile. It needs the
    extra `reference`.
    """
    from snooker_cli.validation.accuracy_study import ERROR

    _carry_out(ERROR, ERROR.plan(quick), out, as_json)


@bench.command(cls=Command)
@takes(options.QUICK, *WRITTEN)
def physics(*, quick: bool, out: Path | None, as_json: bool) -> None:
    """Compare pressure, cooling and speeds with known values.

    Each difference is given in standard errors. It takes two to four minutes, and ends with exit
    code 4 if a value does not agree.
    """
    from snooker_cli.validation.physics_study import PHYSICS

    _carry_out(PHYSICS, PHYSICS.plan(quick), out, as_json)


@bench.command(cls=Command)
@takes(*WRITTEN)
def hard(
    cases: Annotated[
        list[str] | None, typer.Argument(metavar="CASE", help="Only these [all but the slow ones].")
    ] = None,
    *,
    out: Path | None,
    as_json: bool,
) -> None:
    """Simulate and check scenes that could break an engine.

    Everything that must be true is measured beside what rounding alone
    can do. It takes two minutes, and ends with exit code 4 if a case fails. It needs the extra
    `reference`.
    """
    from snooker_cli.validation.hard_cases import HARD, hard_plan

    _carry_out(HARD, hard_plan(cases or []), out, as_json)


def _carry_out(
    study: "Study", plan: "Record", out: Path | None, as_json: bool, more: "Record | None" = None
) -> None:
    """Measure and print; write files if there is a folder for them; exit code 4 for a failure.

    more : is added to the record
    """
    from snooker_cli.validation.study import text_of
    from snooker_cli.validation.study_tables import lines, write

    with nullcontext() if out is None else made_folder(out):
        record = study.measure(plan, notice) | (more or {})
        print_line(text_of(record) if as_json else "\n".join(lines(record)))
        if out is not None:
            for path in write(study, record, out):
                notice(str(path))
    if not study.passed(record):
        raise typer.Exit(int(ExitCode.SOME_FAILED))
