"""``snooker run --dry-run`` and ``--engine``: what would be done, and with which engine."""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from snooker_cli import runs, store
from snooker_cli.cli.run_command import _duration
from snooker_cli.formatting import size

Snooker = Callable[..., Any]

GAS = """\
container: {radius: 10.0}
balls: {count: 100, radius: 0.3, speed: 10}
cor: 0.9
collisions: 5000
repeats: 2
"""


def tree(folder: Path) -> dict[str, bytes]:
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file()
    }


def planned(snooker: Snooker, *arguments: str) -> dict[str, Any]:
    ended = snooker("run", *arguments, "--dry-run", "--json")
    assert ended.code == 0, ended.err
    return dict(json.loads(ended.out))


# --dry-run


def test_a_dry_run_writes_and_simulates_nothing(here: Path, snooker: Snooker) -> None:
    ended = snooker("run", "small.yaml", "--dry-run", "-j", "2")
    assert (ended.code, ended.err) == (0, "")
    assert list(here.iterdir()) == [here / "small.yaml"]
    assert ended.out == (
        "2 points, 3 repeats each: 0 stored in runs/small, 6 to do\n"
        "\n"
        "cor=0.85: 7 balls, 3 to do\n"
        "  engine    allpairs: few balls in a circle\n"
        "  records   events\n"
        "  modelled  moving container, losses between balls, losses at the wall, wall traps and "
        "collapse\n"
        "  left out  cells, balls sorted by cells, straight walls, periodic images, "
        "unequal balls, sliding along the wall, lasting contacts and slow collisions elastic\n"
        "\n"
        "cor=1.0: 7 balls, 3 to do\n"
        "  engine    allpairs: few balls in a circle\n"
        "  records   events\n"
        "  modelled  moving container and collapse\n"
        "  left out  cells, balls sorted by cells, straight walls, periodic images, unequal "
        "balls, sliding along the wall, losses between balls, losses at the wall, wall traps, "
        "lasting contacts and slow collisions elastic\n"
        "\n"
        "at most 900 collisions: about a second on 2 threads, about 130 kB\n"
    )


def test_a_dry_run_tells_the_same_as_json(here: Path, snooker: Snooker) -> None:
    told = planned(snooker, "small.yaml", "-j", "2")
    assert set(told) == {
        "run",
        "points",
        "repeats",
        "cached",
        "to_do",
        "kinds",
        "collisions",
        "threads",
        "seconds",
        "cools_out",
        "bytes",
        "free_bytes",
    }
    assert [told[name] for name in ("points", "repeats", "cached", "to_do")] == [2, 3, 0, 6]
    assert (told["collisions"], told["threads"]) == (900, 2)
    lossy, elastic = told["kinds"]
    assert (lossy["points"], elastic["points"]) == ([{"cor": 0.85}], [{"cor": 1.0}])
    for kind in (lossy, elastic):
        assert (kind["balls"], kind["shape"], kind["engine"]) == ([7], "circle", "allpairs")
        assert (kind["to_do"], kind["collisions"]) == (3, 450)
    differing = {
        name for name in lossy["models"] if lossy["models"][name] != elastic["models"][name]
    }
    assert differing == {"losses between balls", "losses at the wall", "wall traps"}
    assert sum(kind["bytes"] for kind in told["kinds"]) == told["bytes"]
    spent = sum(kind["processor_seconds"] for kind in told["kinds"])
    assert told["seconds"] == pytest.approx(spent / 2)


def test_a_dry_run_counts_what_is_there(finished: Path, snooker: Snooker) -> None:
    before = tree(finished)
    told = planned(snooker, "small.yaml")
    assert (told["cached"], told["to_do"], told["collisions"], told["bytes"]) == (6, 0, 0, 0)
    assert snooker("run", "small.yaml", "--dry-run").out.endswith("\n\nnothing to do\n")
    assert planned(snooker, "small.yaml", "-o", "repeats=5")["to_do"] == 4
    assert planned(snooker, "small.yaml", "--fresh")["to_do"] == 6
    assert tree(finished) == before
    (finished / "point-0001" / "repeat-0002.h5").write_bytes(b"")
    told = planned(snooker, "small.yaml")
    assert [kind["to_do"] for kind in told["kinds"]] == [0, 1]


def test_a_dry_run_has_the_errors_of_a_run(finished: Path, snooker: Snooker) -> None:
    before = tree(finished)
    for arguments, code in (
        (["-o", "seed=2"], 2),
        (["-o", "balls.radius=3.0"], 3),
        (["-o", "cor=2"], 3),
        (["--out", "runs"], 2),
    ):
        dry = snooker("run", "small.yaml", *arguments, "--dry-run")
        wet = snooker("run", "small.yaml", *arguments)
        assert (dry.code, dry.err) == (code, wet.err)
        assert dry.out == ""
    assert tree(finished) == before


def test_a_dry_run_tells_why_an_engine_is_chosen(here: Path, snooker: Snooker) -> None:
    Path("gas.yaml").write_text(GAS)
    box, periodic = (f"container={{shape: {shape}, width: 20}}" for shape in ("box", "periodic"))
    for arguments, engine, because in (
        ([], "cells", "many balls in a circle"),
        (["-o", "balls.count=20"], "allpairs", "few balls in a circle"),
        (["-o", "container.mass=1", "-o", "balls.count=150"], "allpairs", "few balls in a circle"),
        (["-o", "collapse=slide"], "allpairs", "balls slide"),
        (["-o", box], "cells", "a box"),
        (["-o", periodic], "cells", "a periodic box"),
        (["--engine", "allpairs"], "allpairs", "as --engine allpairs says"),
        (["--engine", "cells", "-o", "balls.count=7"], "cells", "as --engine cells says"),
    ):
        (kind,) = planned(snooker, "gas.yaml", *arguments)["kinds"]
        assert (kind["engine"], kind["because"]) == (engine, because)


def test_what_ends_at_a_time_cannot_be_estimated(here: Path, snooker: Snooker) -> None:
    Path("gas.yaml").write_text(GAS.replace("collisions: 5000", "time: 3"))
    told = planned(snooker, "gas.yaml")
    assert [told[name] for name in ("collisions", "seconds", "bytes")] == [None, None, None]
    summary = planned(snooker, "gas.yaml", "-o", "record=summary")
    assert summary["seconds"] is None
    assert summary["bytes"] > 0
    assert "\nno estimate of the time" in snooker("run", "gas.yaml", "--dry-run").out


def test_a_gas_that_cools_until_it_drifts_as_a_whole_may_take_longer(
    here: Path, snooker: Snooker
) -> None:
    """Speeds are 10⁻¹⁶ of what they were after 36 · 2N / (1 − CoR²) collisions."""
    Path("gas.yaml").write_text(
        "container: {shape: periodic}\ncor: 0.999\n"
        "balls: {count: 217, packing: 0.1, radius: 1.0, speed: 10.0}\n"
    )
    for more, longer in (
        (["collisions=7.8e6"], False),
        (["collisions=7.9e6"], True),
        (["collisions=7.9e6", "cor=1"], False),
        (["collisions=7.9e6", "collapse={elastic_below: 0.01}"], False),
        (["collisions=7.9e6", "container.shape=circle"], False),
    ):
        arguments = ["gas.yaml", *(f"--override={each}" for each in more)]
        assert planned(snooker, *arguments)["cools_out"] == longer, more
        said = snooker("run", *arguments, "--dry-run").out.splitlines()[-1]
        assert ("(much more if balls cool" in said) == longer


@pytest.mark.parametrize("record", ["events", "summary"])
@pytest.mark.parametrize("collisions", [500, 50_000])
def test_files_are_about_as_large_as_estimated(
    record: str, collisions: int, here: Path, snooker: Snooker
) -> None:
    Path("gas.yaml").write_text(GAS)
    keys = [f"collisions={collisions}", f"record={record}", "cor=1", "balls.count=37"]
    arguments = ["gas.yaml", *(f"--override={key}" for key in keys)]
    told = planned(snooker, *arguments)
    assert snooker("run", *arguments, "--no-progress").code == 0
    size = sum(path.stat().st_size for path in Path("runs/gas").glob("point-*/*.h5"))
    assert size / 2 < told["bytes"] < 2 * size


def test_estimates_are_rounded_for_people() -> None:
    assert [
        _duration(seconds) for seconds in (0.001, 1.04, 17.2, 119.0, 130.0, 9e4, 2e6, 1e12)
    ] == [
        "a second",
        "1 s",
        "17 s",
        "120 s",
        "2.2 minutes",
        "25 hours",
        "23 days",
        "32,000 years",
    ]
    assert [size(number) for number in (10, 999_999, 1.35e9, 2.7e12)] == [
        "10 bytes",
        "1 MB",
        "1.4 GB",
        "2.7 TB",
    ]


# What is too much


def test_a_dry_run_of_very_much_tells_its_cost(here: Path, snooker: Snooker) -> None:
    told = planned(snooker, "small.yaml", "-o", "repeats=5e5", "-o", "collisions=1e12")
    assert (told["to_do"], told["cached"], told["collisions"]) == (10**6, 0, 10**18)
    assert told["bytes"] > 1e19 > told["free_bytes"]
    ended = snooker("run", "small.yaml", "-j", "2", "-o", "collisions=1e12", "--dry-run")
    assert re.search(
        r"\nat most 6,000,000,000,000 collisions: about .* days on 2 threads, "
        r"about 87 TB, but only \S+ \S+ are free\n$",
        ended.out,
    )
    assert list(here.iterdir()) == [here / "small.yaml"]


@pytest.mark.parametrize("more", [["collisions=1e12"], ["collisions=1e13", "record=summary"]])
def test_a_run_of_very_much_is_not_begun(more: list[str], here: Path, snooker: Snooker) -> None:
    """Eighty terabytes; and months, which need no disk."""
    arguments = ["small.yaml", *(f"--override={each}" for each in more), "-j", "2"]
    last = snooker("run", *arguments, "--dry-run").out.splitlines()[-1]
    ended = snooker("run", *arguments)
    assert (ended.code, ended.out) == (2, "")
    assert ended.err.startswith(f"snooker: {last}; ")
    assert list(here.iterdir()) == [here / "small.yaml"]


def test_a_run_is_begun_on_a_full_disk_if_it_is_meant(
    here: Path, snooker: Snooker, monkeypatch: pytest.MonkeyPatch
) -> None:
    full = shutil.disk_usage(here)._replace(free=50_000)
    monkeypatch.setattr("shutil.disk_usage", lambda _: full)
    arguments = ("run", "small.yaml", "-j", "2", "--no-progress")
    refused = snooker(*arguments)
    assert refused.code == 2
    assert ", about 130 kB, but only 50 kB are free; " in refused.err
    assert snooker(*arguments, "--yes").code == 0
    # What is there asks for nothing more, and two repeats for less than is free.
    assert snooker(*arguments).code == 0
    assert snooker(*arguments, "-o", "repeats=4").code == 0
    assert snooker(*arguments, "-o", "repeats=6").code == 2


def test_a_zip_is_planned_run_and_extended(here: Path, snooker: Snooker) -> None:
    text = (here / "small.yaml").read_text().partition("sweep")[0]
    Path("zip.yaml").write_text(text + "sweep: {zip: {cor: [0.9, 1.0], collisions: [9, 20]}}\n")
    kinds = sorted(planned(snooker, "zip.yaml")["kinds"], key=str)
    assert [kind["points"] for kind in kinds] == [
        [{"cor": 0.9, "collisions": 9}],
        [{"cor": 1.0, "collisions": 20}],
    ]
    told = json.loads(snooker("run", "zip.yaml", "--json").out)
    assert [point["collisions"] for point in told["points"]] == [27, 60]
    longer = snooker("run", "zip.yaml", "--dry-run", "-o", "collisions=9,30")
    assert longer.err.startswith(
        "snooker: this extends runs/zip: collisions from [9, 20] to [9, 30]; "
    )
    assert "3 stored in runs/zip, 3 to do" in longer.out


@pytest.mark.parametrize("name", ["..yaml", "...yaml"])
def test_a_config_whose_name_is_no_folder_is_refused(
    name: str, here: Path, snooker: Snooker
) -> None:
    (here / "small.yaml").rename(here / name)
    for dry in ([], ["--dry-run"]):
        ended = snooker("run", name, *dry)
        assert (ended.code, ended.out) == (2, "")
        assert ended.err == (
            f"snooker: {name}: its name gives no folder name; give --out, or rename it\n"
        )
    assert list(here.iterdir()) == [here / name]


# --engine


@pytest.fixture
def fixed(here: Path) -> Path:
    """The small config with a fixed wall: cells in a free circle are a kind more to compile."""
    config = here / "small.yaml"
    config.write_text(config.read_text().replace("mass: 1.0e7", "mass: .inf"))
    return here


@pytest.mark.usefixtures("fixed")
def test_a_forced_engine_has_results_of_its_own(snooker: Snooker) -> None:
    assert snooker("run", "small.yaml", "--engine", "cells", "--no-progress").code == 0
    assert json.loads(Path("runs/small/run.json").read_text())["engine"] == "cells"
    run = runs.open_run("small")
    assert run.engine == "cells"
    told = store.check(run.path(0, 0)).provenance
    assert told.engine == "cells"
    for others in ([], ["--engine", "allpairs"]):
        refused = snooker("run", "small.yaml", *others)
        assert refused.code == 2
        assert re.fullmatch(
            r"snooker: runs/small: holds results of another --engine, whose "
            r"bits differ; give --fresh .*\n",
            refused.err,
        )
    again = json.loads(snooker("run", "small.yaml", "--engine", "cells", "--json").out)
    assert [point["cached"] for point in again["points"]] == [3, 3]
    assert snooker("fit", "small").code == 0


def test_results_without_a_forced_engine_are_as_before(finished: Path, snooker: Snooker) -> None:
    assert "engine" not in json.loads((finished / "run.json").read_text())
    run = runs.open_run(finished)
    assert run.engine is None
    assert store.check(run.path(0, 0)).provenance.engine is None
    assert snooker("run", "small.yaml", "--engine", "allpairs").code == 2


@pytest.mark.usefixtures("fixed")
def test_files_of_a_forced_engine_are_not_taken_for_others(snooker: Snooker) -> None:
    for folder, forced in (("cells", ["--engine", "cells"]), ("own", [])):
        arguments = ["--out", folder, "--no-progress", *forced]
        assert snooker("run", "small.yaml", *arguments).code == 0
    name = Path("point-0001") / "repeat-0001.h5"
    (Path("own") / name).write_bytes((Path("cells") / name).read_bytes())
    told = json.loads(snooker("run", "small.yaml", "--out", "own", "--json").out)
    assert [point["cached"] for point in told["points"]] == [3, 2]


def test_all_pairs_in_a_box_are_refused_in_a_sentence(here: Path, snooker: Snooker) -> None:
    Path("box.yaml").write_text(GAS.replace("{radius: 10.0}", "{shape: box, width: 20}"))
    for dry in ([], ["--dry-run"]):
        ended = snooker("run", "box.yaml", "--engine", "allpairs", *dry)
        assert (ended.code, ended.out) == (3, "")
        assert re.fullmatch(
            r"snooker: box.yaml:1:\d+: container.shape: the engine allpairs knows no box: .*\n",
            ended.err,
        )
    assert not Path("runs").exists()
    assert snooker("run", "box.yaml", "--engine", "quick").code == 2


# What the engine did


@pytest.mark.parametrize("engine", ["allpairs", "cells"])
def test_run_tells_what_the_engine_did(engine: str, here: Path, snooker: Snooker) -> None:
    Path("gas.yaml").write_text(GAS.replace("cor: 0.9", "cor: 1"))
    told = json.loads(snooker("run", "gas.yaml", "--json", "--engine", engine).out)
    (point,) = told["points"]
    work = point["work"]
    assert set(work) == {"predictions", "crossings", "queue_updates"}
    traces = list(runs.open_run("gas").traces(runs.open_run("gas").points[0]))
    collided = sum(trace.wall_events + 2 * trace.pair_events for trace in traces)
    assert point["collisions"] == sum(trace.collisions for trace in traces) == 10_000
    # Each ball that collides and each that crosses is entered anew; the others were stale.
    stale = work["queue_updates"] - collided / 10_000 - work["crossings"]
    assert 0 < stale < 1
    if engine == "allpairs":
        assert work["crossings"] == 0
        assert work["predictions"] == pytest.approx(100 * work["queue_updates"])
    else:
        assert work["crossings"] > 0
        assert work["predictions"] < 100
    assert np.isfinite(list(work.values())).all()
