"""``import snooker_cli as snooker``: the functions and classes for scripts and notebooks."""

from __future__ import annotations

import ast
import csv
import dataclasses
import inspect
import io
import json
import re
import shutil
import signal
from collections.abc import Callable
from importlib import import_module
from operator import attrgetter
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command_line import SMALL, Snooker, output_of
from matplotlib.figure import Figure
from repeating import content_hash

import snooker_cli as snooker
from snooker_cli import api, options
from snooker_cli.analysis.decay import decays
from snooker_cli.api.arguments import OPTIONS_OF
from snooker_cli.config.yaml_document import document
from snooker_cli.laws import Constant
from snooker_cli.runs.batch import RepeatResult
from snooker_cli.runs.watched_execution import RunProgress

CONFIG: dict[str, Any] = document(SMALL, "small.yaml").data


@pytest.fixture
def run(finished: Path) -> snooker.Run:
    """The finished run: two points of three repeats."""
    return snooker.open("small")


@pytest.fixture
def command(snooker: Snooker) -> Snooker:
    """The command line, under a name that the package does not have here."""
    return snooker


def energy(_: Any, velocities: np.ndarray[Any, Any], scene: snooker.Scene) -> float:
    return float(0.5 * np.sum(scene.masses * np.sum(velocities**2, axis=1)))


def test_importing_the_package_loads_nothing() -> None:
    program = """
import sys
before = set(sys.modules)
import snooker_cli as snooker
added = set(sys.modules) - before
print(*(name for name in sorted(added) if name.partition(".")[0] not in sys.stdlib_module_names))
snooker.open
print(*({"matplotlib", "numba", "scipy"} & set(sys.modules)))
"""
    assert output_of(program).splitlines() == ["snooker_cli snooker_cli.lazy_names", ""]
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        snooker.nothing  # noqa: B018


def test_a_run_is_that_of_the_command_line(finished: Path) -> None:
    done = snooker.open(finished)
    for config, overrides, out in (
        ("small.yaml", None, "file"),
        (CONFIG | {"cor": np.float64(0.3)}, {"cor": np.array([0.85, 1.0])}, "arrays"),
        (CONFIG, {"cor": "0.85:1.0:2", "collapse": "stop"}, "range"),
    ):
        made = snooker.run(config, overrides, out=out, progress=False)
        assert made.digests == done.digests, out
        for ours, theirs in zip(made, done, strict=True):
            assert content_hash(ours.trace) == content_hash(theirs.trace)


def test_the_same_call_finds_the_repeats_and_fresh_replaces_them(here: Path) -> None:
    made = snooker.run(CONFIG, {"repeats": 1})
    (status,) = made.statuses(0)
    age = status.path.stat().st_mtime_ns
    assert status.header.provenance.command == "snooker.run({…}, {'repeats': 1})"
    assert snooker.run(CONFIG, {"repeats": 1}).directory == Path("runs", made.identity)
    assert status.path.stat().st_mtime_ns == age
    assert snooker.run("small.yaml").directory == Path("runs/small")
    with pytest.raises(snooker.RunError, match="another config"):
        snooker.run("small.yaml", {"cor": 0.5, "seed": 9}, out="runs/small")
    assert len(snooker.run("small.yaml", {"cor": 0.5}, fresh=True).points) == 1


def test_an_interrupt_keeps_what_is_done(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    finish = RunProgress.finished

    def finished(self: RunProgress, result: RepeatResult) -> None:
        finish(self, result)
        signal.raise_signal(signal.SIGINT)

    before = signal.getsignal(signal.SIGINT)
    with monkeypatch.context() as patched:
        patched.setattr(RunProgress, "finished", finished)
        with pytest.raises(KeyboardInterrupt, match=r"of 400 repeats done; call run again"):
            snooker.run("small.yaml", {"repeats": 200}, jobs=1)
    assert signal.getsignal(signal.SIGINT) is before
    kept = len(list(snooker.open("small")))
    assert 0 < kept < 400
    assert len(list(snooker.run("small.yaml", {"repeats": 200}))) == 400


def test_failed_repeats_are_an_error(finished: Path) -> None:
    made = snooker.open("small")
    for path in {status.path for status in made.statuses(1)}:
        path.unlink()
        path.mkdir()
    with pytest.raises(snooker.RunError, match=r"3 repeats of 6 failed .*cannot write"):
        snooker.run("small.yaml")
    assert len(list(made.repeats(0))) == 3
    with pytest.raises(snooker.UserError, match="there is no point 7"):
        made.repeats(7)  # before anything is read
    assert repr(made.points[0]) == "<point 0: cor=0.85>"


def test_the_table_has_a_row_for_each_repeat(run: snooker.Run) -> None:
    table = run.table()
    assert {column.shape for column in table.values()} == {(6,)}
    assert list(table)[:5] == ["point", "cor", "repeat", "ending", "complete"]
    assert table["cor"].tolist() == [0.85] * 3 + [1.0] * 3
    assert table["repeat"].tolist() == [0, 1, 2] * 2
    assert np.array_equal(table["complete"], table["ending"] == "complete")
    assert set(table["ending"]) == {"complete", "wall trap"}
    assert np.all(table["wall_collisions"] + table["pair_collisions"] == table["collisions"])
    alphas = [row for row in run.fit(cor=0.85) if row["model"] == "haff"]
    assert table["alpha"][:3].mean() == pytest.approx(alphas[0]["value"])
    for row, repeat in enumerate(run):
        trace = repeat.trace
        assert table["time"][row] == repeat.stop.time
        columns, wall = repeat.series(), trace.start.container.wall_length
        pressure = columns.wall_impulse[-1] / (wall * trace.stop.time)
        assert table["pressure"][row] == pytest.approx(pressure)
        widths = np.diff(np.append(columns.time, trace.stop.time))
        mean = np.sum(columns.kinetic_energy * widths) / trace.stop.time
        assert table["temperature"][row] == pytest.approx(mean / trace.start.number)
        last = energy(None, trace.finish.velocities, trace.finish) + trace.finish.container_energy
        first = trace.start.kinetic_energy + trace.start.container_energy
        assert table["energy_ratio"][row] == pytest.approx(last / first)
        if row < 3:
            alone = [found for found in decays([trace], ["kinetic_energy"]) if found.law == "haff"]
            assert table["alpha"][row] == pytest.approx(alone[0].fits[0].value, rel=1e-12)
    assert np.isnan(table["k"][3:]).all()


@pytest.mark.filterwarnings("error")
def test_a_gas_at_rest_has_temperature_zero(here: Path) -> None:
    """Its time is 0, over which there is no mean; and no share of an energy 0 is left."""
    run = snooker.run(CONFIG | {"balls": CONFIG["balls"] | {"speed": 0.0}})
    table = run.table()
    for name in ("time", "temperature", "pressure", "mean_speed"):
        assert table[name].tolist() == [0.0] * 6
    assert np.isnan(table["energy_ratio"]).all()
    with pytest.raises(snooker.FigureError, match="has nothing to show: no further collision"):
        run[0, 0].animate("film.html")


def test_rough_balls_have_their_energy_of_rotation_in_series_and_tables(here: Path) -> None:
    """Events and a summary have the same; at the ends it is that of the stored spins."""
    rough = {"tangential_cor": 0.5, "collisions": 300, "seed": 5}
    run = snooker.run(CONFIG | rough | {"record": "events"})
    short = snooker.run(CONFIG | rough | {"record": "summary"}, out="short")
    for repeat, other in zip(run, short, strict=True):
        columns, again = repeat.series(), other.series()
        finish = other.trace.finish
        assert columns["spin_energy"][0] == 0.0
        assert columns["spin_energy"][-1] == pytest.approx(finish.spin_energy, rel=1e-12)
        assert again["spin_energy"][-1] == pytest.approx(finish.spin_energy, rel=1e-12)
    table = run.table()
    assert np.all(table["rotational_temperature"] > 0)
    assert table["rotational_temperature"] == pytest.approx(
        short.table()["rotational_temperature"], rel=0.02
    )
    assert "rotational_temperature" not in snooker.run(CONFIG, out="smooth").table()


def test_the_table_of_a_heated_gas_has_its_energy_account(here: Path) -> None:
    """The stationary part is that of the point; other scenes have no such numbers."""
    heated = {"balls": {"count": 7, "radius": 1.0, "speed": 6.0}, "wall_temperature": 20.0}
    heated |= {"container": {"shape": "circle", "radius": 10.0, "mass": float("inf")}, "repeats": 8}
    heated |= {"cor": 0.9, "collisions": 3000, "record": "summary"}
    run = snooker.run(heated)
    table = run.table()
    names = ("wall_energy", "lost_energy", "stationary_from")
    for row, repeat in enumerate(run):
        columns = repeat.series()
        assert table["wall_energy"][row] == pytest.approx(columns["wall_energy"][-1])
        assert table["lost_energy"][row] == pytest.approx(columns["lost_energy"][-1])
    begins = table["stationary_from"] / table["time"]
    assert begins == pytest.approx(np.full(8, begins[0]))
    assert 0.05 <= begins[0] <= 0.5
    compared = run.compare()
    assert "not refused as stationary" in run.finding()
    assert f"all: {run.finding()}" == compared.text(brief=True)  # it has no fit
    units = {row["quantity"]: row["unit"] for row in compared}
    assert units["pressure by the virial"] == "Pa m"
    assert run.fit() == []
    assert np.isnan([snooker.run(CONFIG).table()[name] for name in names]).all()


def test_swept_limits_texts_and_nulls_are_columns(here: Path) -> None:
    swept = {"collisions": [20, 30], "balls.speeds": ["equal", "maxwell"], "wall_cor": [None, 0.5]}
    balls = {"count": 3, "radius": 1.0, "speed": 10.0}
    table = snooker.run(CONFIG | {"balls": balls, "repeats": 1, "sweep": swept}).table()
    assert table["config.collisions"].tolist() == [20] * 4 + [30] * 4
    assert np.all(table["collisions"] <= table["config.collisions"])
    assert table["balls.speeds"].tolist() == (["equal"] * 2 + ["maxwell"] * 2) * 2
    assert np.isnan(table["wall_cor"]).tolist() == [True, False] * 4
    # A pair is a text in JSON.
    ball = {"position": [0, 0], "velocity": [1, 0], "radius": 1.0}
    swept = {"sweep": {"balls.list[0].position": [[0, 0], [1, 2]]}, "repeats": 1}
    made = snooker.run(CONFIG | {"balls": {"list": [ball]}} | swept, out="runs/pairs")
    assert made.table()["balls.list[0].position"].tolist() == ["[0.0, 0.0]", "[1.0, 2.0]"]


def test_only_repeats_that_are_there_have_rows(separate: Path) -> None:
    run = snooker.open("small")
    run.status_of(1, 1).path.unlink()
    assert run.table()["point"].tolist() == [0, 0, 0, 1, 1]
    assert run.table()["repeat"].tolist() == [0, 1, 2, 0, 2]
    shutil.rmtree(separate / "point-0000")
    shutil.rmtree(separate / "point-0001")
    with pytest.raises(snooker.RunError, match=r"no repeat of the point .* is there yet"):
        run.table()


def test_the_exported_table_is_the_same(run: snooker.Run, command: Snooker) -> None:
    table = run.table()
    own = run.export(Path("own.csv")).read_text(encoding="utf-8")
    assert command("export", "small", "--table").out == own
    names, *rows = csv.reader(own.splitlines())
    of_csv = dict(zip(names, map(np.array, zip(*rows, strict=True)), strict=True))
    of_csv["complete"] = of_csv["complete"] == "True"
    assert command("export", "small", "--table", "--out", "table.parquet").code == 0
    read = pytest.importorskip("pyarrow.parquet").read_table("table.parquet")
    assert read.schema.field("pressure").metadata == {b"unit": b"Pa m"}
    for columns in (of_csv, {name: read[name].to_numpy() for name in read.column_names}):
        assert list(columns) == list(table)
        for name, column in table.items():
            same = columns[name].astype(column.dtype)
            assert np.array_equal(same, column, column.dtype.kind == "f")


def test_a_repeat_has_events_states_and_series(run: snooker.Run) -> None:
    repeat = run[1, 2]
    events, stored = repeat.events, repeat.trace.events
    assert stored is not None
    assert events.dtype.names == ("time", "i", "j", "impulse")
    assert len(events) == 150
    for name in events.dtype.names:
        assert np.array_equal(events[name], getattr(stored, name))
    states = repeat.states([0.0, repeat.stop.time])
    assert np.array_equal(states.positions[0], repeat.scene.positions)
    assert np.array_equal(states.velocities[1], repeat.trace.finish.velocities)
    series = repeat.series()
    assert np.array_equal(series.time[1:], events.time)
    measured = repeat.measure(energy, series.time[::10])
    assert measured == pytest.approx(series["kinetic_energy"][::10])
    times = np.linspace(0, repeat.stop.time, 5)
    places = repeat.measure(lambda _x, _v, scene: scene.container_position, times)
    assert np.array_equal(places, repeat.states(times).container_position)
    assert len(np.unique(places[:, 0])) == 5
    assert repeat.parameters == {"cor": 1.0}
    assert repr(repeat).startswith("<repeat 2 of cor=1.0: 150 collisions")


def test_figures_fits_and_comparisons_are_those_of_the_commands(
    run: snooker.Run, command: Snooker
) -> None:
    assert json.loads(command("fit", "small", "--json").out) == run.fit()
    assert json.loads(command("compare", "small", "--json").out) == run.compare()
    assert run.fit(since=1.0, until=5.0)[0]["amplitude"] == "free"
    for records in (run.fit, run.compare):
        assert records(cor=1.0) == [row for row in records() if row["parameters"] == {"cor": 1.0}]
        assert records(cor=[1.0, 0.85]) == records()
    table, some = run.table(), run.table(cor=1.0)
    assert all(np.array_equal(some[key], table[key][3:], equal_nan=key != "ending") for key in some)
    figure = run.plot("cooling", cor=0.85)
    assert isinstance(figure, Figure)
    assert command("plot", "small", "cooling", "--where", "cor=0.85").code == 0
    stored = Path("runs/small/figures/cooling-cor-0.85.png").read_bytes()
    pixels = stored.partition(b"IDAT")[2]
    assert figure._repr_png_().partition(b"IDAT")[2] == pixels


def test_a_repeat_is_exported_to_files_and_streams(run: snooker.Run, command: Snooker) -> None:
    stream = io.StringIO()
    run.export_events(stream, 1, 2)
    assert stream.getvalue() == command("export", "small", "--point", "1", "--repeat", "2").out
    run.export_states("states.csv", [0.0, 0.5], repeat=1)
    run.export_states("same.csv", "0,0.5", repeat=1)
    lines = Path("states.csv").read_text("utf-8").splitlines()
    assert len(lines) == 1 + 2 * (1 + run[0, 1].scene.number)
    assert Path("same.csv").read_text("utf-8").splitlines() == lines
    with pytest.raises(snooker.UserError, match="exists already; give replace=True"):
        run.export("states.csv", replace=False)
    with pytest.raises(snooker.UserError, match="this file holds results of a run"):
        run.export(run.status_of(0, 0).path)


def test_conditions_are_keywords(run: snooker.Run) -> None:
    assert run.where("cor>0.9") == {"cor": 1.0}
    assert [point.index for point in run.matching(**run.where("cor>0.9"))] == [1]
    with pytest.raises(snooker.UserError, match=r"where\('cor'\): give KEY=VALUE"):
        run.where("cor")


@pytest.mark.parametrize("key", ["quantity", "size", "repeats", "self"])
def test_conditions_are_no_other_arguments(key: str, run: snooker.Run, command: Snooker) -> None:
    """A key that is an argument of the function, too."""
    for name in ("fit", "compare", "plot", "animate", "export"):
        ended = command(name, "small", "--where", f"{key}=9")
        assert ended.code == 2
        assert re.search("has no key|no point has", ended.err), ended.err


@pytest.mark.parametrize(
    ("wrong", "sentence"),
    [
        (lambda run: run[0], r"run\[0\]: give a point and a repeat"),
        (lambda run: run[0, -1], "there is no repeat -1: small has repeats 0 to 2"),
        (lambda run: run[0, 0].states([2.0, 1.0]), "times must ascend"),
        (lambda run: run[0, 0].measure(energy, 1e9), "times must ascend within 0 and"),
        (lambda run: run.plot("energy", cor=0.1), "no point has cor = 0.1"),
        (lambda run: snooker.open("smal"), "the nearest is smal"),
        (lambda run: snooker.plan(CONFIG, part="3/2"), "^part='3/2': give K/N"),
    ],
)
def test_what_a_user_gets_wrong_is_a_sentence(
    wrong: Callable[[snooker.Run], Any], sentence: str, run: snooker.Run
) -> None:
    with pytest.raises(snooker.SnookerError, match=sentence):
        wrong(run)


# Simulations without files


def test_a_scene_from_arrays_gives_the_bits_of_the_config(run: snooker.Run) -> None:
    start, trace = run[1, 0].scene, run[1, 0].trace
    scene = snooker.new_scene(
        start.positions,
        start.velocities,
        1.0,
        container=snooker.Circle(10.0),
        container_mass=1e7,
    )
    repeat = snooker.simulate(scene, collisions=150)
    assert repeat.stop == trace.stop
    assert np.array_equal(repeat.trace.finish.positions, trace.finish.positions)
    assert repeat.parameters == {}
    assert repr(repeat).startswith("<simulation: 150 collisions")
    summary = snooker.simulate(scene, time=1.0, summary=True)
    assert summary.series().time[-1] == 1.0
    with pytest.raises(snooker.UserError, match="recorded as a summary"):
        summary.measure(energy, 0.5)


PLACES, STILL = [[0.0, 0.0], [3.0, 0.0]], [[1.0, 0.0], [0.0, 0.0]]


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"positions": [[0.0, 0.0], [1.0, 0.0]]}, "balls 0 and 1 overlap by 1 m"),
        ({"positions": [[0.0, 0.0, 0.0]] * 2}, r"give positions and velocities of shape \(N, 2\)"),
        ({"positions": [[0.0, 0.0], [np.nan, 0.0]]}, r"balls.list\[1\].position: .* finite"),
        ({"positions": [], "velocities": []}, "the arrays do not fit"),
        ({"velocities": "fast"}, "the arrays do not fit"),
        ({"container": 10.0}, "give Circle, Box, Channel or PeriodicBox"),
        ({"seed": 3}, "new_scene has no seed; it has cor, wall_cor, cor_speed, .*, collapse"),
        ({"cor": 2.0}, "cor: 2"),
    ],
)
def test_a_scene_that_cannot_be_is_refused(changes: dict[str, Any], sentence: str) -> None:
    good: dict[str, Any] = {"positions": PLACES, "velocities": STILL, "radii": 1.0}
    with pytest.raises(snooker.SnookerError, match=sentence):
        snooker.new_scene(**(good | {"container": snooker.Circle(10.0)} | changes))


def test_a_simulation_needs_a_limit() -> None:
    scene = snooker.new_scene(PLACES, STILL, 1.0, container=snooker.Circle(10.0))
    with pytest.raises(snooker.UserError, match="needs a number of collisions or a time"):
        snooker.simulate(scene)
    with pytest.raises(snooker.UserError, match="time=nan: give a number above 0"):
        snooker.simulate(scene, time=float("nan"))


def test_a_notebook_shows_a_repeat_as_its_player(run: snooker.Run) -> None:
    shown = run[0, 1]._repr_html_()
    assert shown is not None
    assert "<iframe" in shown
    summary = snooker.simulate(run[0, 1].scene, collisions=20, summary=True)
    assert summary._repr_html_() is None
    written = run[0, 1].animate("film.html", until=1.0, most=5)
    assert written.read_text(encoding="utf-8").startswith("<!doctype html>")
    with pytest.raises(snooker.FigureError):
        run[0, 1].animate("film.html", since=-1.0)


def test_a_simulation_continues_from_a_state(run: snooker.Run) -> None:
    """The same collisions follow; with another CoR the first one differs in its impulse."""
    repeat = run[0, 1]
    k = len(repeat.events) - 5
    between = (repeat.events.time[k - 1] + repeat.events.time[k]) / 2
    scene = repeat.state(between)
    rest = snooker.simulate(scene, collisions=5).events
    assert rest.i.tolist() == repeat.events.i[k:].tolist()
    assert rest.j.tolist() == repeat.events.j[k:].tolist()
    assert between + rest.time == pytest.approx(repeat.events.time[k:], rel=1e-9)
    softer = dataclasses.replace(scene, pair_law=Constant(0.1), wall_law=Constant(0.1))
    (first,) = snooker.simulate(softer, collisions=1).events
    assert (first.i, first.j, first.time) == (rest.i[0], rest.j[0], rest.time[0])
    assert first.impulse < rest.impulse[0]


def test_completion_shows_what_scripts_use(run: snooker.Run) -> None:
    names = {name for name in dir(run) if not name.startswith("_")}
    assert {"table", "fit", "plot", "export", "report", "points", "repeats"} <= names
    assert not names & {
        "batches",
        "file_statuses",
        "delete_all_but",
        "digests",
        "by_number",
    }
    assert {name for name in dir(snooker) if not name.startswith("_")} == set(snooker.__all__)
    assert all(getattr(snooker, name).__name__ == name for name in snooker.__all__)


def test_errors_name_arguments_of_python(run: snooker.Run, command: Snooker) -> None:
    """The command line names its options."""
    with pytest.raises(snooker.RunError, match="give out=… for another folder, or fresh=True"):
        snooker.run(CONFIG | {"seed": 9}, out=run.directory, progress=False)
    with pytest.raises(snooker.UserError, match="with 0 ≤ since < until"):
        run.fit(2.0, 1.0)
    ended = command("run", "small.yaml", "-o", "seed=9", "--out", "runs/small")
    assert "give --out for another folder, or --fresh, which deletes them" in ended.err


def test_wrong_arguments_are_errors_of_python(run: snooker.Run) -> None:
    """They are errors of the package too."""
    repeat = run[0, 0]
    for wrong, kind, sentence in (
        (
            lambda: run.plot("energy-fits"),
            ValueError,
            "energy-fit, and snooker.figure_l",
        ),
        (lambda: run.plot("energy", repaet=1), TypeError, r"plot\(\) got .*did you mean repeat\?"),
        (
            lambda: run.fit(quantiy="E"),
            TypeError,
            r"fit\(\) got .* did you mean quantity\?",
        ),
        (lambda: run.compare(core=0.8), TypeError, r"compare\(\) got .*did you mean cor\?"),
        (
            lambda: run.fit(quantity="nope"),
            ValueError,
            "quantity='nope': no quantity contains",
        ),
        (lambda: run.plot("snapshot", colour="red"), ValueError, "colour='red': give speed or"),
        (lambda: run.plot("snapshot", times=["a"]), TypeError, "times: give a number or a list"),
        (lambda: repeat.states("a"), TypeError, "times: give a number or a list of numbers, s"),
        (lambda: repeat.states([2.0, 1.0]), ValueError, "times must ascend"),
        (lambda: repeat.state("a"), TypeError, "times: give a number"),
        (lambda: run[0], TypeError, r"run\[0\]: give a point and a repeat"),
        (lambda: run[9, 0], IndexError, "there is no point 9"),
        (lambda: run.where("cor"), ValueError, "give KEY=VALUE"),
    ):
        with pytest.raises(kind, match=sentence) as caught:
            wrong()
        assert isinstance(caught.value, snooker.SnookerError)
    assert len(run) == len(list(run)) == 6


def test_sentences_name_options_by_their_table() -> None:
    """So a script gets an argument; but for what only commands do, and commands in backticks."""
    package = Path(api.__file__).parents[1]
    named = []
    for path in package.rglob("*.py"):
        if path.relative_to(package).as_posix().startswith(("options.py", "cli", "validation")):
            continue
        nodes = list(ast.walk(ast.parse(path.read_text("utf-8"))))
        documents = {id(node.value) for node in nodes if isinstance(node, ast.Expr)}
        for node in nodes:
            text = node.value if isinstance(node, ast.Constant) else None
            if isinstance(text, str) and id(node) not in documents:
                named += re.findall("--[a-z]+(?:-[a-z]+)*", re.sub("`[^`]*`", "", text))
    assert named == []


PUBLIC = [getattr(snooker, name) for name in snooker.__all__]  # their modules fill OPTIONS_OF


@pytest.mark.parametrize("name", OPTIONS_OF)
def test_methods_have_the_words_and_defaults_of_options(name: str) -> None:
    module, _, function = name.removeprefix("snooker_cli.api.").partition(".")
    method = attrgetter(function)(import_module(f"snooker_cli.api.{module}"))
    arguments = inspect.signature(method).parameters
    for option in OPTIONS_OF[name]:
        default = option.default if option.python_default is None else option.python_default
        assert arguments[option.word].default == default
        assert f"{option.word} : {option.help}" in method.__doc__


def test_an_option_is_named_as_its_user_gives_it() -> None:
    assert [str(options.FIT_SINCE), options.SIZE.of("3x3")] == ["since", "size='3x3'"]
    with options.in_command():
        assert [str(options.FIT_SINCE), options.SIZE.of("3x3")] == ["--from", "--size 3x3"]


def test_repeats_have_their_numbers_where_some_are_missing(separate: Path) -> None:
    run = snooker.open(separate)
    run.statuses(0)[1].path.unlink()
    assert [repeat.number for repeat in run.repeats(0)] == [0, 2]
