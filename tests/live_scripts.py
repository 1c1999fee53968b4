"""The scripts of the live page in V8, without a browser."""

from __future__ import annotations

import json
from typing import Any, Self

from py_mini_racer import MiniRacer

from snooker_cli.live_page.page import LIVE, SHARED, SHOWING, presets, theory_numbers, worker_source
from snooker_cli.pages.html_page import text_of


class LiveScripts:
    """A context that simulates, measures and runs a gas, with ``configOf`` a scene and ``fluid``.

    Close it: Python does not end while one is open.
    """

    def __init__(self) -> None:
        self.engine = MiniRacer()
        self.engine.eval(worker_source() + text_of("snooker_cli.pages", *SHARED))
        self.engine.eval(text_of(LIVE, *SHOWING[:-1]))  # the last one needs a page
        configs = json.dumps({scene["name"]: scene["config"] for scene in presets()})
        self.engine.eval(f"const configOf = (name) => ({configs})[name];")
        self.engine.eval(f"const fluid = new Fluid({json.dumps(theory_numbers())});")

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_error: object) -> None:
        self.engine.close()

    def value(self, expression: str, **given: Any) -> Any:
        """The value of an expression, in which names have values; what is not finite is None."""
        names, values = ", ".join(given), ", ".join(map(json.dumps, given.values()))
        text = self.engine.eval(f"JSON.stringify((({names}) => ({expression}))({values}))")
        return json.loads(text)
