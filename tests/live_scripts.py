"""The scripts of the live page in V8, without a browser."""

from __future__ import annotations

import json
from typing import Any

from javascript import JavaScript

from snooker_cli import config as configs
from snooker_cli.live_page.page import (
    LIVE,
    SHOWING,
    measuring_source,
    own_start,
    presets,
    report_scene,
)
from snooker_cli.pages.html_page import PAGES, SHARED, text_of


class LiveScripts(JavaScript):
    """What simulates, measures, draws and runs a gas; ``configOf`` a scene, ``own``."""

    def __init__(self) -> None:
        super().__init__()
        shown = text_of(LIVE, *SHOWING[:-1])  # the last one needs a page
        scripts = measuring_source() + text_of(PAGES, *SHARED) + shown
        self.context.eval(f'"use strict"; {scripts}')
        scenes = json.dumps({scene["name"]: scene["config"] for scene in presets()})
        self.context.eval(f"const configOf = (name) => ({scenes})[name];")
        start = json.dumps(own_start(configs.load(report_scene()).config))
        self.context.eval(f"const own = ownStart({start}, configOf('report'));")

    def value(self, expression: str, **given: Any) -> Any:
        """The value of an expression, in which names have values; what is not finite is None."""
        names, values = ", ".join(given), ", ".join(map(json.dumps, given.values()))
        return self.answer(f"JSON.stringify((({names}) => ({expression}))({values}))")
