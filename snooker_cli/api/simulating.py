"""Runs that are planned and simulated: what that takes, and what came out."""

import logging
import re
import threading
from collections.abc import Iterator, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import replace
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from snooker_cli import options, runs
from snooker_cli.api.arguments import with_options
from snooker_cli.api.configs import (
    ConfigSource,
    Overrides,
    scale_lines,
    typical_scales,
    with_scenes,
)
from snooker_cli.api.results import Outcome, Plan, first
from snooker_cli.api.runs import Run
from snooker_cli.errors import RunError, UserError
from snooker_cli.formatting import (
    counted,
    duration,
    point_label,
    printable,
    rough,
    size,
    text_table,
)
from snooker_cli.runs.batch import CHECKPOINT_INTERVAL, RepeatResult
from snooker_cli.runs.execution import share_of
from snooker_cli.runs.plan import LAW, is_excessive, run_plan
from snooker_cli.runs.processes import processors
from snooker_cli.runs.progress import showing_notices
from snooker_cli.runs.status import continuing, ended
from snooker_cli.runs.watched_execution import execute_watched, run_summary, share_done
from snooker_cli.trace import StopReason

if TYPE_CHECKING:
    from snooker_cli.runs.dask_executor import DaskExecutor  # loaded only if it is needed

_log = logging.getLogger(__name__)


class PlannedRun:
    """A run that a user wants. Its config is checked; nothing is written yet.

    The arguments are those of ``run``.

    share : the points and numbers of the repeats of a part, or None for all
    idle : a sentence if such a part has nothing to do
    """

    def __init__(
        self,
        config: ConfigSource,
        overrides: Overrides = None,
        *,
        out: str | PathLike[str] | None = None,
        fresh: bool = False,
        jobs: int | None = None,
        executor: str = "threads",
        part: str | None = None,
    ) -> None:
        self.fresh, self.jobs, self.part = fresh, jobs, part
        self.cancelled = threading.Event()
        valid_config, points, self.scene_classes = with_scenes(config, overrides)
        run = Run(Path(), valid_config, points)
        name = run.identity if isinstance(config, Mapping) else Path(config).stem
        run = replace(run, directory=runs.RUNS / name if out is None else Path(out))
        self.run = run if fresh else runs.continued(run)
        numbered = self.run.points  # in the order of the sweep, as the points of the config
        self.scene_classes = [
            replace(scenes, points=tuple(numbered[point.index] for point in scenes.points))
            for scenes in self.scene_classes
        ]
        self.share: set[tuple[int, int]] | None = None
        self.idle = ""
        if part is not None:
            self.share, self.idle = _share(self.run, part, fresh)
        self.cluster = _cluster(executor, jobs, self.cancelled)

    def plan(self) -> Plan:
        """What it would do. Raises ``RunError`` for a folder with other results."""
        with self.cluster or nullcontext():
            change = runs.planned_change(self.run, fresh=self.fresh)
            content = self._estimate(self.fresh)
        scales = typical_scales(self.run.points)
        content["scales"] = scales.as_json()
        notes = [*self.run.common_random_notes, *scale_lines(scales)]
        lines = [*_plan_lines(content, self.part), *notes]
        planned = Plan(content, [self.idle] if self.idle else lines)
        planned.change = change
        return planned

    def carry_out(
        self,
        *,
        checkpoint: float,
        yes: bool,
        progress: bool,
        processes: bool = False,
        command: str = "",
    ) -> Outcome:
        """Simulate what is missing; an interrupt and repeats that failed are in the outcome.

        checkpoint, yes, progress : as of ``run``
        processes, command : as of ``execute``
        """
        run, cluster = self.run, self.cluster
        with cluster or nullcontext():
            runs.planned_change(run, fresh=self.fresh)  # which may refuse, before the estimate
            # Stored files are checked only if the whole run would be too much.
            too_much = not yes and is_excessive(self._estimate(True))
            if too_much and is_excessive(left := self._estimate(self.fresh)):
                ways = (
                    f"set fewer collisions or repeats, or `record: summary`, or give {options.YES}"
                )
                raise UserError(_costs(left), ways)
            results, watcher = execute_watched(
                run,
                fresh=self.fresh,
                bar=progress,
                part=self.share,
                cancelled=self.cancelled,
                workers=processors() if cluster else self._threads,
                executor=cluster,
                interval=checkpoint,
                processes=processes,
                command=command,
            )
        if not all(result.cached for result in results) and run.figures():
            again = f"run `snooker plot {run.directory}` again"
            _log.warning("%s: these figures are older; %s", run.figures_folder, again)
        summary = run_summary(run, results, watcher)
        outcome = Outcome(
            summary, [self.idle] if self.idle else _outcome_lines(run, results, summary)
        )
        outcome.done = share_done(results, len(run.points) * run.config.repeats)
        outcome.errors = [result.error for result in results if result.error]
        outcome.interrupted = self.cancelled.is_set()
        return outcome

    @property
    def _threads(self) -> int:
        """Threads that simulate, here or on the workers."""
        if self.cluster is None:
            return self.jobs or processors()
        threads: int = self.cluster.threads
        return max(1, min(threads, self.jobs or threads))

    def _estimate(self, fresh: bool) -> dict[str, Any]:
        """What it takes, as if the folder were empty if ``fresh``."""
        return run_plan(self.run, self.scene_classes, self._threads, fresh=fresh, share=self.share)


def plan(config: ConfigSource, overrides: Overrides = None, **how: Any) -> Plan:
    """What ``run`` would do: repeats, the search, time and disk space.

    how : ``out``, ``fresh``, ``jobs``, ``executor`` and ``part``, as of ``run``

    Nothing is simulated or written; stored files are read and checked. The keys are those of
    ``snooker run --dry-run --json``: ``to_do`` repeats, ``collisions``, ``seconds`` on ``threads``,
    ``bytes``, typical ``scales``, ... Raises as ``run`` does.
    """
    return PlannedRun(config, overrides, **how).plan()


@with_options(
    *(options.RUN_OUT, options.FRESH, options.JOBS, options.EXECUTOR, options.PART, options.YES)
)
def run(
    config: ConfigSource,
    overrides: Overrides = None,
    *,
    out: str | PathLike[str] | None = None,
    fresh: bool = False,
    jobs: int | None = None,
    executor: str = "threads",
    part: str | None = None,
    checkpoint: float = CHECKPOINT_INTERVAL,
    yes: bool = True,
    progress: bool = True,
) -> Run:
    """Simulate what is missing of a config's run, store it, and open the run.

    config : a YAML file, or the same keys as a dict
    overrides : values of keys; several values, or a range as a text, are a sweep:
        ``{"cor": [0.8, 0.9], "balls.rings": "range(1,4)"}``
    checkpoint : seconds after which unfinished repeats are saved
    progress : show a bar in a terminal, or in a notebook that has ipywidgets; a log gets lines

    For a dict, the run's folder has eight digits of its hash as a name. ``print(run.outcome)``
    shows what came out. Ctrl-C stores what is simulated, then raises ``KeyboardInterrupt``; the
    same call continues. Raises ``ConfigError``, ``RunError`` for a folder with other results, and
    for repeats that failed when all others are stored.
    """
    source = "{…}" if isinstance(config, Mapping) else repr(str(config))
    with showing_notices():
        request = PlannedRun(
            config, overrides, out=out, fresh=fresh, jobs=jobs, executor=executor, part=part
        )
        outcome = request.carry_out(
            checkpoint=checkpoint,
            yes=yes,
            progress=progress,
            command=f"snooker.run({source}, {overrides})",
        )
    if outcome.interrupted:
        raise KeyboardInterrupt(f"{outcome.done}; call run again to finish")
    if outcome.errors:
        number = sum(point["repeats"] for point in outcome["points"])
        failed = f"{counted(len(outcome.errors), 'repeat')} of {number} failed"
        problem = f"{request.run.directory}: {failed} ({outcome.errors[0]})"
        raise RunError(problem, "snooker.open gives the others")
    return replace(request.run, outcome=outcome)


def _share(run: Run, part: str, fresh: bool) -> tuple[set[tuple[int, int]], str]:
    """What ``share_of`` gives for a part. Raises ``UserError``."""
    match = re.fullmatch(r"(\d{1,6})/(\d{1,6})", part)
    k, n = (int(match[1]), int(match[2])) if match else (0, 0)
    if not 1 <= k <= n:
        raise UserError(f"{options.PART.of(part)}: give K/N with 1 ≤ K ≤ N, as in 3/16")
    if fresh:
        raise UserError(
            f"{options.PART} and {options.FRESH}: parts delete nothing; delete the folder first"
        )
    return share_of(run, k, n)


def _cluster(
    executor: str, at_once: int | None, cancelled: threading.Event
) -> "DaskExecutor | None":
    """The workers that an executor names; None for threads. Raises ``SnookerError``."""
    name, _, address = executor.partition("=")
    if executor == "threads":
        return None
    if name != "dask":
        raise UserError(f"{options.EXECUTOR.of(executor)}: give threads, or dask=tcp://HOST:PORT")
    from snooker_cli.runs.dask_executor import DaskExecutor

    cluster = DaskExecutor(address, at_once, cancelled)
    if cluster.threads == 0:
        _log.warning("the dask scheduler at %s has no workers yet; waiting for them", address)
    return cluster


def _plan_lines(plan: dict[str, Any], part: str | None) -> Iterator[str]:
    """The plan as text."""
    of_part = f"; part {part}" if part else ""
    yield (
        f"{counted(plan['points'], 'point')}, {counted(plan['repeats'], 'repeat')} each{of_part}: "
        f"{plan['cached']:,} stored in {plan['run']}, {plan['to_do']:,} to do"
    )
    for scenes in plan["kinds"]:
        balls, points = scenes["balls"], scenes["points"]
        fewest = f"{balls[0]:,} to " if balls[1:] else ""
        title = point_label(points[0])
        if points[1:]:
            title = f"{counted(len(points), 'point')}, {title} to {point_label(points[-1])}"
        yield ""
        yield f"{title}: {fewest}{counted(balls[-1], 'ball')}, {scenes['to_do']:,} to do"
        yield f"  search    {scenes['search']}"
        laws = [name.removeprefix(LAW) for name in scenes["models"] if name.startswith(LAW)]
        if laws:
            yield f"  laws      {', '.join(laws)}"
        states = ", and states at some times" if "snapshots" in scenes["models"] else ""
        yield f"  records   {'events' if scenes['models']['events'] else f'a summary{states}'}"
    yield ""
    yield _costs(plan)


def _costs(plan: dict[str, Any]) -> str:
    if plan["to_do"] == 0:
        return "nothing to do"
    number = f"at most {plan['collisions']:,} collisions"
    if plan["by_time"]:
        number = f"about {rough(plan['collisions'])} collisions by kinetic theory"
    threads = counted(plan["threads"], "thread")
    time = f"{number}: about {duration(plan['seconds'])} on {threads}"
    disk = f", about {size(plan['bytes'])}"
    if plan["free_bytes"] is not None and plan["bytes"] > plan["free_bytes"]:
        disk += f", but only {size(plan['free_bytes'])} are free"
    return time + disk


def _outcome_lines(
    run: Run, results: Sequence[RepeatResult], summary: dict[str, Any]
) -> Iterator[str]:
    """The table of points, early ends, and where the results are.

    Failed repeats are only counted: their errors were printed as they failed.
    """
    wanted = run.config.repeats
    rows = [
        [
            point_label(point["parameters"]),
            str(wanted) if point["repeats"] == wanted else f"{point['repeats']} of {wanted}",
            f"{point['collisions']:,}",
            ended(point),
        ]
        for point in summary["points"]
        if point["repeats"]  # a part of a run has none of some points
    ]
    yield from first(text_table(["point", ">repeats", ">collisions", "ended"], rows))
    if kept := sum(result.unstored for result in results):
        files = "The older, longer file was" if kept == 1 else f"{kept} older, longer files were"
        yield f"{files} kept."
    explained = [
        printable(f"point {result.point}, repeat {result.repeat}: {result.stop.message}")
        for result in results
        if result.stop
        and not result.stop.reason.complete
        and result.stop.reason is not StopReason.INTERRUPTED
    ]
    yield from first(explained, 3, " such repeats", rest="")
    yield from _collapse_hints(run, results)
    if number := summary["simultaneous"]:
        verb = "has" if number == 1 else "have"
        yield (
            f"{counted(number, 'collision')} {verb} exactly the time of another of the same ball. "
            "They happen one after the other, in a fixed order (docs/how-it-works.md)."
        )
    done = []
    if summary["events"]:
        compiling = summary["compiling_seconds"]
        after = f" after {compiling:.0f} s of compiling" if compiling >= 1 else ""
        speed = f"{summary['seconds']:.2f} s ({summary['events_per_second']:,} events/s)"
        done.append(f"{counted(summary['events'], 'event')} in {speed}{after}")
    if cached := sum(result.cached for result in results):
        were = "was" if cached == 1 else "were"
        done.append(f"{counted(cached, 'repeat')} {were} already stored")
    yield f"{', '.join(done) or 'no events'}; results in {run.directory}"


def _collapse_hints(run: Run, results: Sequence[RepeatResult]) -> list[str]:
    """How the config can be changed so that collapsed repeats continue, each way once."""
    reasons = {(result.point, result.stop.reason) for result in results if result.stop}
    ways = (continuing(run.by_number[point].config, reason) for point, reason in sorted(reasons))
    return [f"To continue such repeats, set {way}." for way in dict.fromkeys(filter(None, ways))]
