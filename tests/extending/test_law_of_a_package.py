"""A law of an installed package: from a config to a film, and where it is not installed."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from installed import YIELDING_GAS, Installed, with_yielding

MODULE = "snooker_yielding.py"
TWO = """\
container: {shape: circle, radius: 10}
collapse: {tc: 0.01}
balls:
  list:
    - {position: [-4, 0], velocity: [2, 0], radius: 1}
    - {position: [4, 0], velocity: [0, 0], radius: 1}
cor: 0.25
law: {name: yielding, yield_speed: 1}
wall_law: {name: yielding, yield_speed: 0.125}
wall_cor: 0.5
sweep: {law.yield_speed: [4, 2, 0.125, 0.024691358024691357, 0.0008]}
collisions: 2
"""
"""After their collision, ball 1 hits the wall."""


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Installed:
    """The package, and a run of a gas with its law."""
    return with_yielding(tmp_path_factory.mktemp("law"))


@contextmanager
def changed(installed: Installed, old: str = "", new: str = "") -> Iterator[None]:
    """Inside, the module has other sources; without texts, the package is not installed."""
    module, away = installed.site / MODULE, installed.site.parent / MODULE
    information = next(installed.site.glob("*.dist-info"))
    source = module.read_text("utf-8")
    if old:
        assert source.count(old) == 1
        module.write_text(source.replace(old, new), "utf-8")
    else:
        module.rename(away)
        information.rename(installed.site.parent / information.name)
    try:
        yield
    finally:
        if not old:
            away.rename(module)
            (installed.site.parent / information.name).rename(information)
        module.write_text(source, "utf-8")


def refused(installed: Installed, *arguments: str) -> str:
    """The sentence of a command that does not work, in one line."""
    done = installed.ended("-m", "snooker_cli", *arguments)
    assert done.returncode != 0, f"snooker {' '.join(arguments)} works: {done.stdout}"
    assert not {"Traceback", "unexpected"} & {*done.stderr.split()}, done.stderr
    return " ".join(done.stderr.split())


def value(installed: Installed, script: str) -> object:
    """The JSON that a script prints."""
    done = installed.ended("-c", "import json, snooker_cli\n" + script)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


BOX = TWO.replace("{shape: circle, radius: 10}", "{shape: box, width: 20}")


@pytest.mark.parametrize(("name", "text", "plain"), [("two", TWO, "0"), ("box", BOX, "1")])
def test_two_balls_and_a_wall_have_its_restitution(
    name: str, text: str, plain: str, installed: Installed, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Impulses are (1 + e) v/2 between balls of 1 kg, and (1 + e) v at the wall.

    Only the kernels of a circle are compiled, which another test has, too.
    """
    monkeypatch.setenv("NUMBA_DISABLE_JIT", plain)
    (installed.here / f"{name}.yaml").write_text(text)
    installed.snooker("run", f"{name}.yaml")
    impulses = value(
        installed,
        f"run = snooker_cli.open({name!r})\n"
        "print(json.dumps([run[k, 0].events.impulse.tolist() for k in range(5)]))",
    )
    for (between, at_wall), e in zip(impulses, (1, 1, 0.5, 1 / 3, 0.25), strict=True):
        assert between == pytest.approx(1 + e, rel=1e-15)
        speed = 1 + e  # of ball 1
        assert at_wall == pytest.approx((1 + max((0.125 / speed) ** 0.25, 0.5)) * speed, rel=1e-14)


def test_python_gives_the_bits_of_the_kernel(installed: Installed) -> None:
    script = """
import os
os.environ["NUMBA_DISABLE_JIT"] = "1"
repeat = snooker_cli.open("gas")[0, 0]
again = snooker_cli.simulate(repeat.scene, collisions=300)
print(json.dumps([repeat.hashes()[-1], again.hashes()[-1]]))
"""
    stored, again = value(installed, script)
    assert stored == again


def test_it_is_fitted_compared_verified_and_drawn(installed: Installed) -> None:
    """Theory has the mean loss of any e(v)."""
    rows = installed.rows("gas")
    assert ("energy left at the end", "Enskog rates, e(v)") in rows
    assert ("Haff's α", "Enskog rates at the start") not in rows
    records = json.loads(installed.snooker("fit", "gas", "--quantity", "kinetic_energy", "--json"))
    assert {record["model"] for record in records} == {"exponential", "haff"}
    verified = installed.ended("-m", "snooker_cli", "verify", "gas", "--replay")
    assert "3 complete repeats" in verified.stdout
    assert verified.stderr == "", "the stored kernels of the run fit"
    installed.snooker("plot", "gas", "event-decay")
    assert [*(installed.here / "runs/gas/figures").glob("event-decay*.svg")]


def test_a_repeat_is_continued_and_compared_beside_another_law(installed: Installed) -> None:
    (installed.here / "longer.yaml").write_text(YIELDING_GAS.replace("300", "200"))
    installed.snooker("run", "longer.yaml")
    (installed.here / "longer.yaml").write_text(YIELDING_GAS)
    installed.snooker("run", "longer.yaml")
    hashes = value(
        installed,
        "runs = [snooker_cli.open(name) for name in ('gas', 'longer')]\n"
        "print(json.dumps([run[0, 2].hashes()[-1] for run in runs]))",
    )
    assert hashes[0] == hashes[1]
    printed = installed.snooker("compare", "gas", "two")
    assert "gas" in printed
    assert "two" in printed


def test_worker_processes_have_it(installed: Installed) -> None:
    """Very many short repeats are simulated in processes."""
    short = YIELDING_GAS.replace("collisions: 300", "collisions: 20").replace(
        "repeats: 3", "repeats: 600"
    )
    (installed.here / "short.yaml").write_text(short)
    installed.snooker("run", "short.yaml")
    hashes = value(
        installed,
        "short = snooker_cli.open('short')[0, 599]\n"
        "again = snooker_cli.simulate(short.scene, collisions=20)\n"
        "print(json.dumps([short.hashes()[-1], again.hashes()[-1]]))",
    )
    assert hashes[0] == hashes[1]


def test_a_dask_worker_without_it_says_so(installed: Installed) -> None:
    """A law travels as its name, its numbers and its origin."""
    script = """
import pickle, sys
law = snooker_cli.open("gas")[0, 0].scene.pair_law
print(json.dumps(pickle.dumps(law).hex()))
"""
    pickled = value(installed, script)
    assert isinstance(pickled, str)
    unpickled = f"""
import pickle
law = pickle.loads(bytes.fromhex({pickled!r}))
print(json.dumps([type(law).__name__, law.problem, law.cor]))
"""
    assert value(installed, unpickled) == ["Yielding", "", 0.7]
    with changed(installed):
        name, problem, cor = value(installed, unpickled)
    assert (name, cor) == ("AbsentLaw", 0.7)
    assert problem == "the law yielding is of snooker-yielding 0.1, which is not installed"


@pytest.mark.long
def test_the_live_page_has_it(installed: Installed) -> None:
    """It compiles the modules of all its scenes with the law."""
    installed.snooker("live", "gas.yaml", "--out", "live.html")
    assert '"yielding"' in (installed.here / "live.html").read_text("utf-8")


def test_films_have_it(installed: Installed) -> None:
    """A page simulates with the same bits, in a module that has the law too."""
    installed.snooker("animate", "gas", "--out", "gas.html", "--collisions", "50")
    assert '"yielding"' in (installed.here / "gas.html").read_text("utf-8")
    tests = str(Path(__file__).parents[1])
    script = f"""
import sys
sys.path.insert(0, {tests!r})
from javascript import JavaScript, scene_of
repeat = snooker_cli.open("gas")[0, 0]
with JavaScript(["periodic"], repeat.scene.rules.laws) as page:
    arguments = scene_of(repeat.scene), json.dumps(dict(collisions=300))
    here = page.answer("simulated(%s, %s)" % arguments)
    config = json.dumps(snooker_cli.open("gas").config.model_dump(mode="json"))
    law = page.answer("JSON.stringify(rulesOf(%s).pairLaw)" % config)
print(json.dumps([here["hash"], repeat.hashes()[-1][1], law]))
"""
    here, stored, law = value(installed, script)
    assert here == stored
    assert (law["name"], law["cor"], law["yield_speed"]) == ("yielding", 0.7, 2)


def test_messages_and_the_schema_name_it(installed: Installed) -> None:
    for numbers, sentence in (
        ("yield_speed: -2", "law.yield_speed: a number above 0 (from 1e-150 to 1e150) is needed"),
        ("", "law.yield_speed: the law yielding needs it; it has yield_speed"),
        ("yield_speed: 2, speed: 1", "law.speed: the law yielding has no such number"),
    ):
        changed_config = YIELDING_GAS.replace("yielding, yield_speed: 2", f"yielding, {numbers}")
        (installed.here / "wrong.yaml").write_text(changed_config.replace(", }", "}"))
        assert sentence in refused(installed, "validate", "wrong.yaml")
    (installed.here / "wrong.yaml").write_text(
        YIELDING_GAS.replace("name: yielding", "name: yelding")
    )
    sentence = refused(installed, "validate", "wrong.yaml")
    assert "law.name: there is no law yelding; installed are yielding; install" in sentence
    (installed.here / "wrong.yaml").write_text(YIELDING_GAS + "cor_speed: 1\n")
    assert "law replaces cor_speed; remove one of them" in refused(
        installed, "validate", "wrong.yaml"
    )
    schema = json.loads(installed.snooker("schema"))
    law = schema["properties"]["law"]["anyOf"][0]["properties"]
    assert law["name"] == {"enum": ["yielding"]}
    assert law["yield_speed"]["type"] == "number"
    assert re.search("yielding +snooker-yielding 0.1", installed.snooker("init"))


def test_a_circle_and_the_exact_twin_refuse_it(installed: Installed) -> None:
    """It has no sums of infinitely many bounces, and no intervals."""
    circle = YIELDING_GAS.replace("{shape: periodic, width: 20}", "{shape: circle, radius: 12}")
    circle = circle.replace("law:", "wall_law:")
    (installed.here / "circle.yaml").write_text(circle)
    sentence = refused(installed, "run", "circle.yaml")
    assert "the yielding law has no sums; set another shape or collapse: {tc: 0.01}" in sentence
    (installed.here / "circle.yaml").write_text(circle + "collapse: {tc: 0.01}\n")
    installed.snooker("run", "circle.yaml", "--yes")
    assert "law: yielding" in refused(installed, "verify", "gas", "--exact")


def test_a_law_that_gives_energy_is_refused(installed: Installed) -> None:
    with changed(installed, "return 1.0", "return 1.5"):
        sentence = refused(installed, "run", "gas.yaml", "--out", "giving")
    assert "the law yielding of snooker-yielding has the CoR 1.5 at 1e-12 m/s" in sentence


def test_a_law_that_prints_is_refused(installed: Installed) -> None:
    """A compiled print waits for ever for what the thread that simulates holds."""
    with changed(installed, "return 1.0", "return print(speed) or 1.0"):
        sentence = refused(installed, "run", "gas.yaml", "--out", "printing")
    assert "the law yielding of snooker-yielding prints; remove it" in sentence


def test_swapped_arguments_are_refused(installed: Installed) -> None:
    with changed(
        installed, "speed: float, cor: float, yield_speed", "speed: float, other: float, cor"
    ):
        (problem,) = [row["problem"] for row in installed.plugins()]
        assert problem.startswith("restitution has the arguments speed, other, cor, not speed, cor")


def test_without_the_package_results_stay_readable(installed: Installed) -> None:
    with changed(installed):
        for command in ("show gas", "ls", "verify gas", "export gas --out events.csv"):
            installed.snooker(*command.split())
        assert (installed.here / "events.csv").read_text().count("\n") > 300
        sentence = refused(installed, "verify", "gas", "--replay")
        assert "snooker-yielding 0.1, which is not installed" in sentence
        sentence = refused(installed, "run", "gas.yaml")
        assert "law.name: there is no law yielding; no installed package adds a law" in sentence


def test_a_run_that_sweeps_its_number_stays_readable(installed: Installed) -> None:
    """Swept values may be whole numbers, which a law has as floats."""
    sweep = ["-o", "law.yield_speed=1,2", "-o", "repeats=1", "--out", "swept"]
    installed.snooker("run", "gas.yaml", *sweep)
    with changed(installed):
        for command in ("show swept", "verify swept", "export swept --out swept.csv"):
            installed.snooker(*command.split())
    with changed(installed, "return 1.0", "return 0.9"):
        assert "yielding" in refused(installed, "compare", "swept", "--where", "law.yield_speed=1")


def test_a_law_that_is_left_out_is_not_called_absent(installed: Installed) -> None:
    """Its package is there, so the sentences lead to the reason why it does not work."""
    with changed(installed, "import math\n", "import nothing_there\n"):
        sentence = refused(installed, "run", "gas.yaml")
        assert "install its package, or see in `snooker plugins` why it is left out" in sentence
        sentence = refused(installed, "verify", "gas", "--replay")
        assert "0.1, which is left out (`snooker plugins` has the reason)" in sentence
        script = (
            "try:\n    snooker_cli.check_config('gas.yaml')\n"
            "except Exception as error:\n    print(json.dumps(str(error)))"
        )
        assert "or see in snooker.plugin_list() why it is left out" in str(value(installed, script))
        assert "ModuleNotFoundError: No module named 'nothing_there'" in " ".join(
            installed.snooker("plugins").split()
        )


def test_results_of_other_sources_are_not_mixed(installed: Installed) -> None:
    """The digest of a point has the sources, so what is there is another point."""
    with changed(installed, "return max(", "return 0.0 + max("):
        sentence = refused(installed, "verify", "gas", "--replay")
        assert "snooker-yielding 0.1 with other sources than snooker-yielding 0.1" in sentence
        sentence = refused(installed, "run", "gas.yaml")
        assert "runs/gas: holds results of another config (law changed: " in sentence
        assert "snooker-yielding 0.1 with other sources" in sentence


def test_its_kernels_are_kept_for_its_sources(installed: Installed) -> None:
    """A change of the function changes the results of the next process."""
    script = """
again = snooker_cli.simulate(snooker_cli.new_scene(
    [[-4.0, 0.0], [4.0, 0.0]], [[2.0, 0.0], [0.0, 0.0]], 1.0,
    container=snooker_cli.PeriodicBox(20.0, 20.0), cor=0.1,
    law={"name": "yielding", "yield_speed": 0.125}), collisions=1)
print(json.dumps(float(again.events.impulse[0])))
"""
    assert value(installed, script) == pytest.approx(1.5, rel=1e-15)
    with changed(installed, "math.sqrt(math.sqrt(yield_speed / speed))", "yield_speed / speed"):
        assert value(installed, script) == pytest.approx(1.1, rel=1e-15)
    assert value(installed, script) == pytest.approx(1.5, rel=1e-15)
