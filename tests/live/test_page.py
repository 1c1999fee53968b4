"""``snooker live`` and ``snooker.live``: what is on the page, and what is refused."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from javascript import scene_of
from live_scripts import LiveScripts
from moving_pictures import films
from py_mini_racer import JSEvalException
from scenes import gas

import snooker_cli as snooker
from snooker_cli import config as configs
from snooker_cli.analysis import diffusion
from snooker_cli.animation import page as film_page
from snooker_cli.config import Config
from snooker_cli.config.template_configs import templates
from snooker_cli.engine import simulate
from snooker_cli.live_page.page import CONTROLS, MOST_BYTES, presets
from snooker_cli.pages.html_page import PAGES, text_of
from snooker_cli.placement.starting_scene import starting_scene
from snooker_cli.trace import event_hashes

SCENES = presets()
GAS: dict[str, Any] = {
    "container": {"radius": 10.0},
    "balls": {"count": 20, "radius": 0.5, "speed": 10.0},
    "cor": 0.9,
    "collisions": 100,
}


def data_of(page: str) -> dict[str, Any]:
    """What the page knows from Python."""
    found = re.search(r'<script type="application/json" id="data">(.*?)</script>', page, re.S)
    assert found
    return dict(json.loads(found[1]))


def test_a_page_is_small_and_has_no_network() -> None:
    page = snooker.live().html
    row = [
        {"position": [0.01 * k, -2 / 3], "velocity": [1 / 3, -1e-7], "radius": 1e-3 / 3}
        for k in range(-100, 100)
    ]
    largest = snooker.live(GAS | {"balls": {"list": row}}).html
    assert max(len(page.encode()), len(largest.encode())) <= MOST_BYTES
    assert "default-src 'none'" in page
    assert not re.search(r"(?:src|href)=|@import|url\(|fetch\(|XMLHttpRequest", page)
    assert page == snooker.live().html
    assert [scene["name"] for scene in data_of(page)["scenes"]] == [s["name"] for s in SCENES]


def test_the_script_of_a_page_is_a_module_with_no_name_twice(javascript: LiveScripts) -> None:
    """There, a second declaration of a name is a syntax error, as in a block of strict code."""
    pages = {"live": snooker.live().html, "film": film_page(films()["fixed"])}
    for name, made in pages.items():
        script = r'<script type="(?!application/json)(.*?)".*?>(.*?)</script>'
        ((kind, text),) = re.findall(script, made, re.DOTALL)
        assert kind == "module", name
        block = f"'use strict'; {{ {text} }}"
        assert javascript.value("typeof new Function(text)", text=block) == "function", name
        with pytest.raises(JSEvalException, match="already been declared"):
            javascript.value("new Function(text)", text=block[:-1] + "function short() {} }")


def test_the_first_scene_is_that_of_the_config() -> None:
    """Of a sweep it is the first point. Its title cannot break the page."""
    title = "</script><b>{{data}}"
    page = snooker.live(GAS | {"title": title}, {"cor": [0.7, 0.8]}).html
    own, *others = data_of(page)["scenes"]
    assert (own["config"]["cor"], own["title"]) == (0.7, title)
    assert [scene["name"] for scene in others] == [scene["name"] for scene in SCENES]
    assert page.count("</script>") == 3


@pytest.mark.parametrize(
    ("change", "key", "needs"),
    [
        ({"balls.count": 2001}, "balls", "at most 2,000 balls"),
        ({"seed": 2**53}, "seed", "seeds up to 9007199254740991"),
        ({"balls.radius": 9.0}, "balls.radius", "packing"),
    ],
)
def test_what_a_page_cannot_show_is_refused(change: Any, key: str, needs: str) -> None:
    with pytest.raises(snooker.ConfigError, match=f"{key}.*{needs}"):
        snooker.live(GAS, change)


def test_a_notebook_shows_the_page(tmp_path: Path) -> None:
    page = snooker.live(GAS)
    assert "<iframe" in page._repr_html_()
    assert page.save(tmp_path / "gas.html").read_text(encoding="utf-8") == page.html


@pytest.mark.parametrize("name", [scene["name"] for scene in SCENES])
def test_the_program_gives_the_hash_of_the_page(name: str, javascript: LiveScripts) -> None:
    """Of the first 1,000 collisions, or of all, from the text of the config on the page."""
    config = next(scene["config"] for scene in SCENES if scene["name"] == name)
    defaults = data_of(snooker.live().html)["defaults"]
    text, shown = javascript.value(
        """(() => {
          const gas = new Gas(config);
          gas.advance(Infinity, 1000);
          return [yamlOf(gas.program, defaults), gas.simulation.eventHash()];
        })()""",
        config=config,
        defaults=defaults,
    )
    valid_config = configs.parse(text, overrides=["collisions=1000"]).config
    events = simulate(
        starting_scene(valid_config, 0), collisions=1000, time=valid_config.time
    ).events
    assert events is not None
    assert event_hashes([events])[-1][1] == shown


@pytest.mark.parametrize(
    ("time", "collapse"),
    [(5.0, "stop"), (7.3, "stop"), (7.0, "slide")],
)
def test_a_time_decides_what_is_a_trap(time: float, collapse: str, javascript: LiveScripts) -> None:
    """A ball is trapped only if its bounces end before: the page ends as the program does."""
    config = next(scene["config"] for scene in SCENES if scene["name"] == "trap")
    config = config | {"time": time, "collapse": collapse}
    seen = javascript.value(
        """(() => {
          const gas = new Gas(config);
          gas.advance(Infinity);
          return [gas.stop.reason, gas.time, gas.hashes[0]];
        })()""",
        config=config,
    )
    valid_config = configs.validated(config)
    limits = {"collisions": valid_config.collisions, "time": time}
    trace = simulate(starting_scene(valid_config, 0), **limits)
    assert trace.events is not None
    assert seen == [trace.stop.reason, trace.stop.time, list(event_hashes([trace.events])[-1])]


def test_the_config_on_the_page_is_that_of_the_scene(javascript: LiveScripts) -> None:
    """Read by `snooker run`, its text gives the same digest; also with numbers of all sizes."""
    config = next(scene["config"] for scene in SCENES if scene["name"] == "heated")
    config = config | {"cor": 1e-7, "seed": 2**53 - 1, "time": 1e22}
    defaults = data_of(snooker.live().html)["defaults"]
    text = javascript.value("yamlOf(config, defaults)", config=config, defaults=defaults)
    known = Config.model_validate_json(json.dumps(config))
    assert configs.digest(configs.parse(text).config) == configs.digest(known)


CHANNEL = {"shape": "channel", "width": 30.0, "height": 20.0}
SPECIES = [
    {"count": 20, "radius": 0.5, "speed": 10.0},
    {"count": 5, "radius": 0.9, "mass": 4.0, "speed": 5.0, "start": "random"},
]

CONTROLLED: dict[str, dict[str, Any]] = {
    "rings": {"container": {"radius": 10.0}, "balls": {"rings": 2, "radius": 0.5, "speed": 10.0}},
    "packed": {"container": {"packing": 0.1}, "balls": SPECIES[0]},
    "slide": {"container": {"radius": 10.0}, "balls": SPECIES[0], "collapse": "slide"},
    "warm": {"container": {"radius": 10.0}, "balls": SPECIES, "wall_temperature": 50.0},
    "two temperatures": {
        "container": CHANNEL,
        "balls": SPECIES,
        "wall_temperature": {"left": 20.0, "right": 80.0},
    },
    "driven sides": {
        "container": CHANNEL | {"shape": "box"},
        "balls": SPECIES,
        "wall_speed": {"left": 1.0, "top": 2.0},
    },
    "slow at the wall": {
        "container": CHANNEL,
        "balls": [{"position": [0.0, 0.0], "velocity": [0.0, 0.0], "radius": 2.0}, SPECIES[0]],
        "wall_cor_speed": 5.0,
    },
    "one large": {
        "container": CHANNEL | {"shape": "box"},
        "balls": [{"position": [0.0, 0.0], "velocity": [0.0, 0.0], "radius": 2.0}, SPECIES[0]],
    },
    "periodic": {"container": CHANNEL | {"shape": "periodic"}, "balls": SPECIES},
    "rough": {
        "container": {"radius": 10.0},
        "balls": SPECIES,
        "tangential_cor": 0.5,
        "friction": 0.3,
        "wall_friction": 0.8,
    },
    "rough beside a warm wall": {
        "container": CHANNEL | {"shape": "box"},
        "balls": SPECIES,
        "tangential_cor": 0.5,
        "wall_temperature": {"left": 20.0, "right": 80.0},
    },
    "rough, slide": {
        "container": {"radius": 10.0},
        "balls": SPECIES[0],
        "tangential_cor": 0.5,
        "wall_tangential_cor": -1,
        "collapse": "slide",
    },
}

USED = """
controlsOf(config).flatMap((control) => {
  const options = Object.keys(control.choices?.(config) ?? {});
  const values = options.length ? options : [0.3, 0.6].map((part) => valueOnSlider(control, part));
  return [...values, ...(control.none ? [null] : [])].map((value) => {
    const changed = JSON.parse(JSON.stringify(config));
    control.write(changed, value, config);
    return [control.id, value, control.read(changed), yamlOf(changed, defaults),
      controlsOf(changed).map(({ id }) => id)];
  });
})
"""


@pytest.mark.parametrize("name", CONTROLLED)
def test_each_control_makes_a_config_of_the_program(name: str, javascript: LiveScripts) -> None:
    """Whatever one moves, `snooker run` accepts the text; what it reads is what was set."""
    config = configs.validated(CONTROLLED[name] | {"cor": 0.9, "collisions": 10})
    page = json.loads(configs.to_json(config))
    defaults = data_of(snooker.live().html)["defaults"]
    used = javascript.value(USED, config=page, defaults=defaults)
    for control, value, read, text, _ in used:
        assert read == value, control
        configs.parse(text)
    seen = {control for control, *_ in used}
    if "species" in name or CONTROLLED[name]["balls"] is SPECIES:
        names = ("count", "radius", "mass", "speed")
        assert seen >= {f"{name}-{k}" for name in names for k in (1, 2)}
    if name == "two temperatures":
        assert seen >= {"wall-temperature-left", "wall-temperature-right"}
        assert "wall-cor" not in seen
    if name == "driven sides":
        assert seen >= {"wall-speed-left", "wall-speed-top", "wall-cor"}
    after = {value: ids for control, value, _, _, ids in used if control == "wall"}
    assert ("sides" in after) == (
        CONTROLLED[name]["container"] in (CHANNEL, CHANNEL | {"shape": "box"})
    )
    if "sides" in after and "wall_speed" not in CONTROLLED[name]:
        assert {"wall-temperature-left", "wall-temperature-right"} <= set(after["sides"])


def test_the_controls_have_these_names(javascript: LiveScripts) -> None:
    """Those that ``--controls`` knows are those of the page."""
    gases = [configs.validated(gas | {"cor": 0.9, "collisions": 10}) for gas in CONTROLLED.values()]
    pages = [json.loads(configs.to_json(gas)) for gas in gases]
    pages += [scene["config"] for scene in SCENES]
    names = javascript.value("all.flatMap(controlsOf).map(({ id }) => nameOf(id))", all=pages)
    assert set(names) == set(CONTROLS)


def test_an_unknown_control_is_refused() -> None:
    with pytest.raises(snooker.UserError, match=r"^controls: .*'cors'.*cor, wall-cor"):
        snooker.live(controls=["cors"])


REACHED = """
(() => {
  const scene = { name: "own", config }, plain = JSON.stringify(config), links = [], failed = [];
  const owned = new Map(controlsOf(config).map(({ id, read }) => [id, read(config)]));
  const check = (changed) => {
    const link = linkOf(scene, changed, null), found = readLink(link, [scene]);
    links.push(link);
    const isSame = JSON.stringify(found.config) === JSON.stringify(changed);
    if (!isSame) failed.push([link, found.mistake]);
  };
  const moved = (from, names, parts) => controlsOf(from).flatMap((control) => {
    if (names && !names.includes(control.id)) return [];
    const options = control.choices && Object.keys(control.choices(from));
    const values = options ?? parts.map((part) => valueOnSlider(control, part));
    if (owned.has(control.id) && !options) values.push(owned.get(control.id));
    return values.map((value) => {
      const changed = copyOf(from);
      control.write(changed, value, copyOf(config));
      return changed;
    });
  });
  const twice = moved(config, null, [0, 0.6]);
  [config, ...twice, ...twice.flatMap((one) => moved(one, null, [0, 0.6]))].forEach(check);
  const reached = new Map([[plain, config]]);
  for (const from of reached.values()) {
    for (const one of moved(from, ["cor", "wall-cor", "container-mass", "wall"], [0.3, 1])) {
      if (!reached.has(JSON.stringify(one))) reached.set(JSON.stringify(one), one);
    }
  }
  reached.forEach(check);
  check({ ...config, seed: 2 ** 53 - 1 });
  return [failed, links, reached.size, JSON.stringify(config) === plain];
})()
"""


def config_of(name: str) -> dict[str, Any]:
    """The complete config of one of ``CONTROLLED``, or of a scene of the page."""
    if name not in CONTROLLED:
        return dict(next(scene["config"] for scene in SCENES if scene["name"] == name))
    gas = configs.validated(CONTROLLED[name] | {"cor": 0.9, "collisions": 10})
    return dict(json.loads(configs.to_json(gas)))


@pytest.mark.parametrize("name", [*CONTROLLED, "report", "galperin"])
def test_a_link_gives_the_config_back(name: str, javascript: LiveScripts) -> None:
    """All keys in their order, after each two changes, and after any number at the wall."""
    failed, links, reached, unchanged = javascript.value(REACHED, config=config_of(name))
    assert failed == []
    assert unchanged
    assert reached > 2
    assert all(re.fullmatch(r"[\w.=&+-]+", link) for link in links)  # nothing is percent-encoded
    if name == "galperin":
        assert "scene=own&mass=1" in links
    if name == "report":
        assert "scene=own&wall=warm" in links  # this fixes the container
    assert {"scene=own", f"scene=own&seed={2**53 - 1}"} <= set(links)


def test_a_link_has_what_controls_set(javascript: LiveScripts) -> None:
    """Contacts with a duration, which a button gives, and what then fits are not in it."""
    config = config_of("slide")
    found = javascript.value(
        "linkOf({ name: 'own', config }, { ...config, collapse: { tc: TC }, cor: 0.5,"
        " container: { ...config.container, mass: 5 } }, 'full')",
        config=config,
    )
    assert found == "scene=own&cor=0.5&wall-cor=0.5&view=full"


READ = "(({ config, mistake, scene }) => [config, mistake, scene.name])(readLink(text, all))"

BROKEN = {
    "scene=none": "no scene none",
    "scene=crowded&radius=1": "no control radius with the rest of this link",
    "scene=heated&wall=driven&wall-temperature=5": "no control wall-temperature",
    "__proto__=1": "no control __proto__",
    "=1": "no control",
    "cor": "cor= needs a number from 0 to 1",
    "cor=1.5": "cor=1.5 needs a number from 0 to 1",
    "cor=1=1": "cor=1=1 needs a number",
    "cor=%E0%A4%A": "cor=%E0%A4%A needs a number",
    "scene=crowded&count=2.5": "count=2.5 needs a whole number from 1 to 2000",
    "seed=9007199254740992": "needs a whole number from 0 to 9007199254740991",
    "container-mass=1e999": "needs a number from 1e-50 to 1e+50, or fixed",
    "wall=hot": "wall=hot needs one of passive, driven, warm",
    "wall=toString": "wall=toString needs",
    "scene=crowded&wall=sides": "wall=sides needs one of passive, driven, warm",
    "view=easy": "needs beginner or full",
}


@pytest.mark.parametrize("text", BROKEN)
def test_a_broken_link_gives_the_plain_scene_and_a_sentence(
    text: str, javascript: LiveScripts
) -> None:
    config, mistake, name = javascript.value(READ, text=text, all=SCENES)
    scene = next(scene for scene in SCENES if scene["name"] == name)
    named = re.match(r"scene=(\w+)", text)
    assert name == ("report" if named is None or named[1] == "none" else named[1])
    assert config == scene["config"]
    assert BROKEN[text] in mistake


REFUSED = """(() => {
  const control = controlsOf(config).find(({ id }) => id === name);
  control.write(config, value);
  try {
    startingScene(config, 0);
  } catch (error) {
    return refusalOf(error, config);
  }
})()"""


@pytest.mark.parametrize(
    ("config", "control", "value", "sentence"),
    [
        (
            "packed",
            "packing",
            0.85,
            "20 balls fit only with radii of at most 0.8689 of these: lower “packing”.",
        ),
        (
            "warm",
            "count-1",
            1000,
            "1,000 balls fit only with radii of at most 0.5874 of these: lower “balls” or “radius”,"
            " or raise “container’s radius”.",
        ),
        (
            "one large",
            "container-width",
            3.0,
            "Ball 0 sticks out of the container by 0.5 m: raise “container’s width”.",
        ),
        (
            "rings",
            "container-radius",
            1e50,
            "A length or a mass is not from 1e-50 to 1e+50: give one nearer to 1.",
        ),
    ],
)
def test_a_refusal_names_the_controls_that_help(
    config: str, control: str, value: float, sentence: str, javascript: LiveScripts
) -> None:
    """Each sentence has controls of this scene only, by the names that they have on the page."""
    valid_config = configs.validated(CONTROLLED[config] | {"cor": 0.9, "collisions": 10})
    page = json.loads(configs.to_json(valid_config))
    given = {"config": page, "name": control, "value": value}
    assert javascript.value(REFUSED, **given) == sentence
    labels = javascript.value("controlsOf(config).map(({ label }) => label)", config=page)
    named = set(re.findall("“(.*?)”", sentence))
    assert named <= {label.split(",")[0] for label in labels}


WATCHED = """(() => {
  const gas = new Gas(configOf("heated")), events = [];
  const advance = (until) => {
    while (gas.time < until) gas.advance(Math.min(gas.time + 0.07, until));
  };
  advance(1);
  gas.startWatch(2);
  advance(2);
  const running = gas.watched;
  advance(4);
  const over = gas.watched;
  gas.startWatch();
  advance(4.5);
  gas.stopWatch();
  advance(5);
  const simulation = new Simulation(startingScene(configOf("heated"), 0));
  while (simulation.time < 5) {
    simulation.advance(1);
    events.push([simulation.time, simulation.eventJ(0)]);
  }
  return [running, over, gas.watched, events];
})()"""


def test_a_stopwatch_counts_the_collisions_of_its_time(javascript: LiveScripts) -> None:
    """Exactly those between its start and its end, whenever frames are; the gas runs on."""
    *watched, events = javascript.value(WATCHED)
    assert [watch["isOver"] for watch in watched] == [False, True, True]
    for watch, (begin, end) in zip(watched, [(1, 2), (1, 3), (4, 4.5)], strict=True):
        during = [other for time, other in events if begin < time <= end]
        assert watch["time"] == pytest.approx(end - begin, rel=1e-12)
        assert watch["wallEvents"] == sum(other < 0 for other in during) > 0
        assert watch["pairEvents"] == sum(other >= 0 for other in during) > 0


def test_balls_of_one_radius_and_mass_are_a_species(javascript: LiveScripts) -> None:
    config = json.loads(
        configs.to_json(configs.validated(CONTROLLED["one large"] | {"cor": 1, "time": 1}))
    )
    species = javascript.value("speciesIn(startingScene(config, 0))", config=config)
    assert species == [
        {"radius": 2.0, "mass": 1.0, "balls": [0]},
        {"radius": 0.5, "mass": 1.0, "balls": list(range(1, 21))},
    ]


DRAWN = """(() => {
  const gas = new Gas(configOf(name)), lines = [];
  gas.advance(0.5);
  const arena = Object.assign(Object.create(Arena.prototype), {
    gas, view: viewOf(gas.scene.container), shades: [], colours: null, drawn: [],
  });
  const pen = {
    beginPath() {}, arc() {}, fill() {}, stroke() {},
    moveTo: (x, y) => lines.push([x, y]), lineTo: (x, y) => lines[lines.length - 1].push(x, y),
  };
  arena.balls(pen, (x) => x, (y) => -y, 1, gas.time, [0, 0], 1);
  const { simulation: now, time } = gas, balls = [...gas.radii.keys()];
  return [lines, balls.map((ball) => [...gas.place(ball, time), now.angleOf(ball, time)])];
})()"""


def test_a_rough_ball_has_a_mark_at_its_angle(javascript: LiveScripts) -> None:
    """From its centre to its rim; y is downwards on the screen. A smooth ball has none."""
    lines, balls = javascript.value(DRAWN.replace("name)", "'rough')"))
    expected = [
        [x, -y, x + 0.4 * math.cos(angle), -y - 0.4 * math.sin(angle)] for x, y, angle in balls
    ]
    assert len({angle for *_, angle in balls}) > 100
    assert lines == [pytest.approx(line, rel=1e-12) for line in expected]
    assert javascript.value(DRAWN.replace("name)", "'heated')"))[0] == []


@pytest.mark.parametrize("name", ["the template", "the scene of the page"])
def test_marks_of_rough_balls_are_large_enough_to_see(name: str) -> None:
    """Of a picture that is 500 px wide, such a ball covers ten."""
    given = templates()["rough"] if name == "the template" else config_of("rough")
    scene = starting_scene(configs.load(given).config, 0)
    assert 500 * 2 * np.min(scene.radii) / max(scene.container.size) >= 10


COURSE = """(() => {
  const gas = new Gas({ time: null }, null, SCENE), lines = [], [size] = gas.scene.container.size;
  gas.tag(0);
  gas.advance(Infinity, 100);
  const arena = Object.create(Arena.prototype);
  Object.assign(arena, { gas, view: viewOf(gas.scene.container) });
  const pen = {
    beginPath() {}, stroke() {},
    moveTo: (x, y) => lines.push([x, y]), lineTo: (x, y) => lines[lines.length - 1].push(x, y),
  };
  arena.course(pen, (x) => x / size, (y) => y / size, gas.time, [0, 0]);
  return lines;
})()"""


@pytest.mark.parametrize("shape", ["periodic", "channel"])
def test_a_path_goes_on_at_the_other_side(shape: str, javascript: LiveScripts) -> None:
    """All parts are inside, and they are as long as the ball's way."""
    scene = gas(shape, 20, 0.01, cor=0.9)
    trace = simulate(scene, collisions=100)
    until, size = trace.stop.time, scene.container.size[0]
    assert trace.events is not None
    time = [0.0, *trace.events.time[(trace.events.i == 0) | (trace.events.j == 0)], until]
    way, _ = diffusion.path(trace, 0, np.array(time))
    found = javascript.value(COURSE.replace("SCENE", scene_of(scene)))
    lines = np.array(found).reshape(-1, 2, 2)
    assert len(lines) > len(time)  # it leaves the box several times
    assert np.max(np.abs(lines)) <= 0.5 + 1e-9
    length = np.sum(np.hypot(*np.diff(lines, axis=1)[:, 0].T))
    assert length == pytest.approx(np.sum(np.hypot(*np.diff(way, axis=0).T)) / size, rel=1e-9)


PRESSURES = """(() => {
  const gas = new Gas(configOf("cooling")), charts = Object.create(GasCharts.prototype);
  gas.advance(Infinity, collisions);
  Object.assign(charts, { isBrief: false, gases: [gas], gas, low: 0 });
  const { seen, rows, pressures } = charts.courseOf(gas, 0);
  const after = rows.findIndex(({ wallEvents, pairEvents }) => wallEvents + pairEvents > 100);
  return [roomy(Math.max(...seen)), pressures.map(({ dash, values }) => values[dash ? 1 : after])];
})()"""


@pytest.mark.parametrize("collisions", [300, 6000])
def test_the_axis_of_pressure_has_the_beginning_of_a_cooling_gas(
    collisions: int, javascript: LiveScripts
) -> None:
    """Theory from the first collision on, and what is measured after a hundred."""
    top, beginning = javascript.value(PRESSURES, collisions=collisions)
    assert len(beginning) == 4
    assert max(beginning) <= top < 4 * max(beginning)


TURNED = """(() => {
  const gas = new Gas(configOf("rough")), { simulation } = gas;
  const balls = [...gas.radii.keys()];
  const angles = () => balls.map((ball) => simulation.angleOf(ball, simulation.time));
  gas.advance(Infinity, 1200);
  const first = angles();
  gas.advance(Infinity, 1500);
  gas.goTo(1200);
  const again = angles(), spins = [...simulation.spins], { energy, totalEnergy } = gas.meter;
  const energies = [energy + simulation.spinEnergy(), totalEnergy];
  gas.setLaws({ ...gas.config, tangential_cor: -1 });
  gas.advance(Infinity, 500);
  return [first, again, energies, spins, [...simulation.spins], FACTS.elastic(traitsOf(gas.scene))];
})()"""


def test_a_gas_that_goes_back_has_its_angles_and_a_smooth_one_keeps_its_spins(
    javascript: LiveScripts,
) -> None:
    first, again, energies, spins, kept, keeps_energy = javascript.value(TURNED)
    assert again == first
    assert energies[1] == pytest.approx(energies[0], rel=1e-12)
    assert kept == spins
    assert len(set(spins)) > 100
    assert not keeps_energy  # its CoR is below 1


@pytest.mark.parametrize(
    ("cor", "friction", "keeps"), [(1, None, True), (-1, 0.5, True), (1, 0.5, False), (0, 0, True)]
)
def test_which_surfaces_keep_the_energy(
    cor: float, friction: float | None, keeps: bool, javascript: LiveScripts
) -> None:
    """Of elastic balls: smooth ones, and perfectly rough ones that do not slip."""
    config = {"cor": 1, "tangential_cor": cor, "friction": friction}
    scene = "startingScene({ ...configOf('rough'), ...config }, 0)"
    assert javascript.value(f"FACTS.elastic(traitsOf({scene}))", config=config) is keeps


def luminance(colour: str) -> float:
    """Relative luminance of #rrggbb or #rgb, as WCAG 2.2 defines it."""
    digits = colour[1:] if len(colour) == 7 else "".join(2 * digit for digit in colour[1:])
    parts = [int(digits[at : at + 2], 16) / 255 for at in (0, 2, 4)]
    red, green, blue = [
        part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts
    ]
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue


def contrast(first: str, second: str) -> float:
    dark, bright = sorted(map(luminance, (first, second)))
    return (bright + 0.05) / (dark + 0.05)


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_colours_contrast_with_what_is_behind_them(theme: str, javascript: LiveScripts) -> None:
    """WCAG 2.2: 4.5 for text, 3 for what has a meaning; pale balls have a dark rim."""
    style = text_of(PAGES, "page.css")
    light, dark = re.findall(r":root \{ (color-scheme.*?|--ink.*?)\}", style, re.S)
    colours = dict(re.findall(r"--(\w+): (#\w+)", light))
    if theme == "dark":
        colours |= dict(re.findall(r"--(\w+): (#\w+)", dark))
    rim, path = javascript.value("[RIM, VIOLET]")
    texts = ("ink", "soft", "warn", "first", "second", "third", "fourth")
    pairs = [(colours[text], colours["paper"], 4.5) for text in texts]
    pairs += [(colours[text], colours["tint"], 4.5) for text in ("ink", "soft")]
    pairs += [(colours["edge"], colours[behind], 3) for behind in ("paper", "tint")]
    pairs += [(colours["blue"], colours["paper"], 3), ("#ffffff", colours["blue"], 4.5)]
    pairs += [(drawn, colours["floor"], 3) for drawn in (rim, path)]
    pairs += [(colours["contact"], colours[behind], 3) for behind in ("paper", "floor")]
    poor = [(*pair, contrast(*pair)) for *pair, least in pairs if contrast(*pair) < least]
    assert poor == []


@pytest.mark.parametrize(("scene", "known"), [("rough", False), ("cooling", True)])
def test_the_table_has_theories_of_smooth_balls_only(
    scene: str, known: bool, javascript: LiveScripts
) -> None:
    config = {"collisions": 500}
    row = "tableRow(config, [measureRepeat(config, 0)])"
    found = javascript.value(
        f"((config) => {{ const {{ traits }} = {row};"
        " return ['ratio', 'alpha'].map((name) => applies(THEORIES[name].finite, traits)); })"
        f"({{ ...configOf('{scene}'), ...changes }})",
        changes=config,
    )
    assert found == [known, known]
