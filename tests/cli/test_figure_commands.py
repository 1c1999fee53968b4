"""``snooker plot``: files, selections, unfinished runs, and what it refuses."""

from __future__ import annotations

import json
import shutil
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
import typer
from figure_runs import (
    ELASTIC,
    made,
)

from snooker_cli.cli import figure_commands
from snooker_cli.cli.exit_codes import guarded
from snooker_cli.errors import ExitCode
from snooker_cli.figures import (
    FIGURES,
)
from snooker_cli.runs import Run

Plot = Callable[..., tuple[int, str, str]]


@pytest.fixture
def plot(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Plot:
    """``snooker plot`` with arguments: its exit code, stdout and stderr."""
    app = typer.Typer(pretty_exceptions_enable=False)
    app.command()(figure_commands.plot)

    def call(*arguments: str | Path) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["plot", *map(str, arguments)])
        capsys.readouterr()
        with pytest.raises(SystemExit) as end:
            guarded(app)
        said = capsys.readouterr()
        return int(end.value.code or 0), said.out, said.err

    return call


def test_plot_writes_figures_and_prints_their_paths(
    plot: Plot, decaying: Run, tmp_path: Path
) -> None:
    code, out, err = plot(decaying.directory, "energy-fit", "--out", tmp_path)
    assert code == ExitCode.DONE
    stems = ("energy-fit-cor-0.8", "energy-fit-cor-0.9")
    assert out.splitlines() == [
        str(tmp_path / f"{stem}.{ending}") for stem in stems for ending in ("svg", "png", "json")
    ]
    assert all(Path(line).stat().st_size > 0 for line in out.splitlines())
    assert "energy-fit left out at 1 of 3 points: nothing decays" in err


def test_plot_gives_all_that_a_run_can(plot: Plot, tmp_path: Path) -> None:
    run = made(tmp_path / "run", *ELASTIC, "collisions=20", "repeats=1")
    code, out, err = plot(run.directory, "--json")
    assert code == ExitCode.DONE
    content = json.loads(out)
    names = [figure["kind"] for figure in content["figures"]]
    assert names == ["energy", "pressure", "ideal-ratio"]
    assert all((run.directory / "figures" / f"{name}.png").exists() for name in names)
    assert [each["kind"] for each in content["skipped"]] == [k for k in FIGURES if k not in names]
    assert "momentum-x left out: it needs velocities" in err


def test_plot_selects_and_names_files_after_it(plot: Plot, decaying: Run, tmp_path: Path) -> None:
    where = ("--where", "cor=0.8,1.0", "--where", "record=events", "--repeat", "2")
    code, out, _ = plot(decaying.directory, "momentum-x", *where, "--out", tmp_path, "--json")
    assert code == ExitCode.DONE
    (figure,) = json.loads(out)["figures"]
    assert Path(figure["files"][0]).name == "momentum-x-cor-0.8-1.0-record-events-repeat-2.svg"
    assert [point["parameters"]["cor"] for point in figure["numbers"]["points"]] == [0.8, 1.0]
    assert "repeat 2 of 3" in figure["caption"]


def test_plot_draws_what_is_there_of_an_unfinished_run(
    plot: Plot, decaying: Run, tmp_path: Path
) -> None:
    shutil.copytree(decaying.directory, tmp_path / "run")
    for repeat in ("point-0000/repeat-0001.h5", "point-0001/repeat-0000.h5"):
        (tmp_path / "run" / repeat).unlink()
    shutil.rmtree(tmp_path / "run" / "point-0002")
    code, out, err = plot(tmp_path / "run", "energy", "energy-fit", "--json")
    assert code == ExitCode.DONE
    missing = "2 of 3 at CoR 0.8, 2 of 3 at CoR 0.9 and none of 3 at CoR 1 are there."
    assert err == f"snooker: The run is unfinished: {missing}\n"
    energy, *fits = json.loads(out)["figures"]
    assert energy["caption"].endswith(missing)
    assert [fit["numbers"]["repeat"] for fit in fits] == [0, 1]
    assert all("2 of 3 repeats are there" in fit["caption"] for fit in fits)
    code, out, err = plot(tmp_path / "run", "--where", "cor=1.0")
    assert (code, out) == (ExitCode.USAGE, "")
    assert "no repeat is there yet; run the config again" in err


def test_plot_lists_the_figures(plot: Plot) -> None:
    code, out, _ = plot("--list")
    assert code == ExitCode.DONE
    assert [line.split()[0] for line in out.splitlines()] == ["figure", *FIGURES]
    code, out, _ = plot("--list", "--json")
    assert {each["name"]: each["needs"] for each in json.loads(out)} == {
        name: kind.needs for name, kind in FIGURES.items()
    }


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["enrgy"], "there is no figure enrgy; the nearest is energy"),
        (["energy", "--where", "cor"], "--where cor: give KEY=VALUE"),
        (["--where", "cor=0.7"], "no point has cor = 0.7: there it is 0.8, 0.9 and 1.0"),
        (["energy", "--repeat", "3"], "there is no repeat 3"),
        (["pressure-area"], "cannot give pressure-area"),
    ],
)
def test_plot_says_what_is_wrong(
    plot: Plot, decaying: Run, arguments: list[str], sentence: str
) -> None:
    code, out, err = plot(decaying.directory, *arguments)
    assert (code, out) == (ExitCode.USAGE, "")
    assert sentence in err
    assert "Traceback" not in err


def test_plot_needs_a_run(plot: Plot, tmp_path: Path) -> None:
    code, _, err = plot()
    assert code == ExitCode.USAGE
    assert "give the RUN" in err
    code, _, err = plot(tmp_path / "nowhere", "energy")
    assert code == ExitCode.USAGE
    assert "there is no run here" in err
