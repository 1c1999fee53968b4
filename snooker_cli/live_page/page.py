"""A config -> the live page: the gas of its first point, which the browser simulates."""

import json
import zlib
from base64 import b64encode
from collections.abc import Sequence, Set
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray

from snooker_cli import config as configs
from snooker_cli import options
from snooker_cli.config import BallList, Config, Loaded
from snooker_cli.containers import Circle, Container, Rectangle
from snooker_cli.engine import webassembly
from snooker_cli.engine.page_kernels import boundaries_of, boundary_names
from snooker_cli.errors import SceneError, UserError
from snooker_cli.fields import carried_fields
from snooker_cli.laws import RULES, Law, keeps_slip, law_of_pairs, law_of_wall, surface_of
from snooker_cli.live_page.javascript import Formulas
from snooker_cli.live_page.page_theories import theories_source
from snooker_cli.pages.html_page import (
    PAGES,
    SHARED,
    SPEED_COLOURS,
    Words,
    html_page,
    script_data,
    script_of,
    text_of,
    translated_script,
)
from snooker_cli.placement.starting_scene import starting_scene
from snooker_cli.scene import Scene

MOST_BALLS = 2000  # so that a page shows 60 frames a second
MOST_SEED = 2**53 - 1  # the largest that JavaScript's numbers have exactly
MOST_BYTES = 250_000  # of a page, which teachers send by mail

LIVE = "snooker_cli.live_page"
ENGINE_SCRIPTS = ("engine.js", "hashes.js", "scene.js")
STARTING = ("start.js",)
"""The engine, and new starts, in an order in which they can run."""

PACKED = ("sliding_circle", "periodic", "fixed_circle", "box", "channel", "free_circle")
"""The modules in the order in which they deflate best: each is similar to the one before."""

MEASURING = ("theory.js", "measurements.js")
SHOWING = ("gas.js", "yaml.js", "charts.js", "table.js", "controls.js", "link.js", "live.js")

CONTROLS = (
    *("cor", "wall-cor", "tangential-cor", "friction", "wall-tangential-cor", "wall-friction"),
    *("rings", "count", "radius", "mass", "speed", "packing"),
    *("container-radius", "container-width", "container-mass"),
    *("wall", "wall-speed", "wall-temperature"),
)
"""The names of the controls of controls.js; one of several species or walls has that of all."""

LANGUAGES = ("en", "de")
"""English, and languages that have a table of words in languages/."""

OWN = "own scene"
FROM_CONFIG = "The scene of the config that this page was made from."
FIRST_POINT = "The first of {} points of the config that this page was made from."


def live_page(
    loaded: Loaded,
    *,
    controls: Sequence[str] | None = None,
    beginner: bool = False,
    language: str = "en",
) -> str:
    """The page that simulates the first point of a config; the same bytes for the same config.

    controls : names of ``CONTROLS`` that the page shows; ``None`` for all
    beginner : whether the page leaves out virial, momentum, config and hashes
    language : one of ``LANGUAGES``

    Raises ``ConfigError`` for a scene that cannot exist, or that the page cannot show, and
    ``UserError`` for a name that no control or language has.
    """
    for name in controls or ():
        if name not in CONTROLS:
            known = ", ".join(CONTROLS)
            raise UserError(
                f"{options.CONTROLS}: there is no control {name!r}; give some of {known}"
            )
    words = words_of(language)
    points = loaded.points()
    config = points[0].config
    for key, number in (("seed", config.seed), ("wall_key", config.wall_key or 0)):
        if number > MOST_SEED:
            sentence = f"the live page has {key}s up to {MOST_SEED}; give a smaller one"
            raise loaded.error(key, sentence)
    number = config.number
    if number > MOST_BALLS:
        sentence = f"the live page shows at most {MOST_BALLS:,} balls, not {number:,}; give fewer"
        raise loaded.error("balls", sentence)
    try:
        check_shape(starting_scene(config, 0).container)
    except SceneError as error:
        raise loaded.error(error.key, str(error)) from None
    own = {
        "name": "own",
        "title": config.title or words.get(OWN, OWN),
        "about": words.get(FROM_CONFIG, FROM_CONFIG)
        if len(points) == 1
        else words.get(FIRST_POINT, FIRST_POINT).format(f"{len(points):,}"),
        # A run of it has hashes of its collisions only if they are recorded.
        "config": json.loads(configs.to_json(config)) | {"record": "events"},
    }
    scenes = presets()
    is_own = own["config"] != scenes[0]["config"]
    scenes = [own] * is_own + [_translated(scene, words) for scene in scenes]
    laws = config.collision_rules.laws
    data = {
        "start": own_start(config),
        "scenes": [scene | {"config": _short(scene["config"])} for scene in scenes],
        "defaults": _defaults(),
        "controls": controls,
        "view": "beginner" if beginner else "full",
        "colours": SPEED_COLOURS,
    }
    parts = {
        "data": script_data(data),
        "modules": script_data(packed_modules(_boundaries(scenes), laws)),
        "engine": translated_script(worker_source(laws), words),
        "script": translated_script(script_of(PAGES, *SHARED) + script_of(LIVE, *SHOWING), words),
    }
    title = own["title"] if is_own else "snooker live"
    return html_page(LIVE, "live", title, parts, simulates=True, language=language, words=words)


def check_shape(container: Container) -> None:
    """Raise ``UserError`` for a container that the scripts of a page cannot draw."""
    if not isinstance(container, Circle | Rectangle):
        raise UserError(
            f"a page shows circles and rectangles, not a {container.title}",
            "give a film a name in .gif or .mp4, or add the shape to viewOf in pages/arena.js",
        )


def words_of(language: str) -> Words:
    """The texts of the page in a language, by the English ones; none for English.

    Raises ``UserError`` for an unknown language.
    """
    if language not in LANGUAGES:
        known = ", ".join(LANGUAGES)
        raise UserError(
            f"{options.LANGUAGE}: there is no language {language!r}; give one of {known}"
        )
    if language == "en":
        return {}
    table: Words = yaml.safe_load(text_of(LIVE, f"languages/{language}.yaml"))
    return table


def report_scene() -> dict[str, Any]:
    """The config of the page without a config: the source report's scene."""
    config: dict[str, Any] = presets()[0]["config"]
    return config


def presets() -> list[dict[str, Any]]:
    """The scenes that every page has: name, title, a sentence about it, and its complete config."""
    scenes = []
    for scene in yaml.safe_load(text_of(LIVE, "presets.yaml")):
        config = configs.load(scene["config"] | {"title": scene["title"]}).config
        scenes.append(scene | {"config": json.loads(configs.to_json(config))})
    return scenes


def _translated(scene: dict[str, Any], words: Words) -> dict[str, Any]:
    """A scene of ``presets`` with title and sentence in other words."""
    title, about = (words.get(scene[key], scene[key]) for key in ("title", "about"))
    return scene | {"title": title, "about": about, "config": scene["config"] | {"title": title}}


def engine_source(*more: str, laws: Sequence[Law] = ()) -> str:
    """The engine and more scripts, in strict mode; not the compiled modules.

    laws : of packages, that scenes can have
    """
    layout = script_data(webassembly.description(laws))
    code = script_of(LIVE, *ENGINE_SCRIPTS, *more)
    return f'"use strict";\nconst ENGINE = {layout};\n{laws_source()}{code}'


def laws_source() -> str:
    """The functions of ``laws.py`` that say what collisions do, as a script."""
    formulas = Formulas()
    names = ", ".join(map(formulas.name_of, (law_of_pairs, law_of_wall, surface_of, keeps_slip)))
    return f"const {{ {names} }} = (() => {{\n{formulas.text}return {{ {names} }};\n}})();\n"


def packed_modules(boundaries: Set[str], laws: Sequence[Law] = ()) -> dict[str, Any]:
    """The compiled engine: the modules of boundaries, deflated, in base64; and their lengths.

    laws : of packages, that scenes can have

    They are compiled if the cache of kernels lacks them.
    """
    order = dict.fromkeys((*PACKED, *boundary_names()))
    codes = webassembly.modules([name for name in order if name in boundaries], laws)
    packed = b64encode(zlib.compress(b"".join(codes.values()), 9)).decode()
    return {"lengths": {name: len(code) for name, code in codes.items()}, "packed": packed}


def worker_source(laws: Sequence[Law] = ()) -> str:
    """What simulates and measures without a page: one script for pages, workers and tests."""
    return engine_source(*STARTING, laws=laws) + measuring_source()


def measuring_source() -> str:
    """What measures, with the theories."""
    return script_of(LIVE, *MEASURING) + theories_source()


def own_start(config: Config) -> dict[str, Any] | None:
    """The program's start of the first repeat, for ``ownStart`` of start.js; none if listed."""
    start = starting_scene(config, 0)
    if isinstance(config.balls, BallList) and start.wall_key is None:
        return None
    rows = _packed(start.positions, start.velocities, start.radii, *_carried(start))
    return {"size": start.container.size, **rows, "key": _key(start)}


def stored_start(scene: Scene) -> dict[str, Any]:
    """A scene for ``storedScene`` of start.js, relative to the centre of a fixed container."""
    centre = np.zeros(2) if scene.free else scene.container_position
    check_shape(scene.container)
    return {
        **_packed(
            scene.positions - centre,
            scene.velocities,
            scene.radii,
            scene.masses,
            *_carried(scene),
        ),
        "key": _key(scene),
        "container": {"shape": scene.container.name, "size": scene.container.size},
        "containerMass": scene.container_mass if scene.free else None,
        "containerPosition": (scene.container_position - centre).tolist(),
        "containerVelocity": scene.container_velocity.tolist(),
        "pairLaw": scene.pair_law.as_json(),
        "wallLaw": scene.wall_law.as_json(),
        "contactDuration": scene.contact_duration,
        "elasticBelow": scene.elastic_below,
        "slides": scene.slides,
        "surface": RULES.dump_python(scene.rules, mode="json")["surface"],
    }


def _carried(scene: Scene) -> list[NDArray[np.float64]]:
    """What balls have beside their motion, as CARRIED of engine.js names it."""
    return [getattr(scene, field.name) for field in carried_fields(scene)]


def _packed(*columns: NDArray[np.float64]) -> dict[str, Any]:
    """Columns of balls for ``unpacked`` of scene.js: doubles in base64, and the number of balls."""
    rows = b"".join(column.astype("<f8").tobytes() for column in columns)
    return {"number": len(columns[0]), "rows": b64encode(rows).decode()}


def _key(scene: Scene) -> str | None:
    """The key of a thermal wall, which may be too large for a number of JavaScript."""
    return None if scene.wall_key is None else str(scene.wall_key)


def _boundaries(scenes: list[dict[str, Any]]) -> set[str]:
    """The boundaries that scenes have, or get by controls."""
    return boundaries_of({configs.validated(scene["config"]).container.shape for scene in scenes})


def _short(config: dict[str, Any]) -> dict[str, Any]:
    """The config without defaults, with listed balls as rows of values below one row of keys."""
    known, balls = _defaults(), config["balls"]
    config = {key: value for key, value in config.items() if value != known[key]}
    if not isinstance(balls, dict) or balls.get("list") is None:
        return config
    keys = list({key: None for ball in balls["list"] for key in ball})
    rows = [[ball.get(key) for key in keys] for ball in balls["list"]]
    return config | {"balls": balls | {"list": [keys, *rows]}}


def _defaults() -> dict[str, Any]:
    """The keys of a config in their order, with what they are if left out; needed ones are null."""
    fields = Config.model_fields.items()
    values = {key: None if field.is_required() else field.default for key, field in fields}
    return values | {"sweep": {}}
