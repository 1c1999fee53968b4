"""Writes a page that compares the live page's engine with the program in any browser.

python tests/make_browser_check.py check.html, then open the page. The same script also runs in a
shell of a JavaScript engine: python tests/make_browser_check.py check.js, then jsc check.js.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

TESTS = Path(__file__).parent
sys.path[:0] = [str(TESTS / name) for name in ("", "engine", "live")]

from javascript import HELPERS, answer_of, modules_source  # noqa: E402  # after the path
from test_engine import GASES  # noqa: E402

from snooker_cli.config import to_json, validated  # noqa: E402
from snooker_cli.engine import simulate  # noqa: E402
from snooker_cli.live_page import engine_source  # noqa: E402
from snooker_cli.placement.starting_scene import starting_scene  # noqa: E402

COMPARE = """
function compared() {
  const different = [];
  for (const { name, scene, limits, answer } of CASES) {
    const found = simulated({ ...scene, containerMass: scene.containerMass ?? Infinity }, limits);
    if (JSON.stringify(JSON.parse(found)) !== JSON.stringify(answer)) different.push(name);
  }
  const equal = CASES.length - different.length;
  const start = bitsOf(startingScene(START, 0).positions);
  return `${equal} of ${CASES.length} scenes have the program's bits. ${different.join(", ")} Start: ${start}`;
}
if (typeof document === "undefined") print(compared());
else document.body.textContent = compared();
"""


def case(name: str) -> dict[str, object]:
    """A config, and the program's events, ending and final state."""
    experiment = validated(GASES[name])
    limits = {"collisions": experiment.collisions, "time": experiment.time}
    answer = answer_of(simulate(starting_scene(experiment, 0), **limits))
    config = json.loads(to_json(experiment))
    return {"name": name, "config": config, "limits": limits, "answer": answer}


def main(path: Path) -> None:
    cases = f"const CASES = {json.dumps([case(name) for name in GASES])};"
    script = "\n".join([engine_source(), modules_source(), HELPERS, cases, COMPARE])
    if path.suffix == ".html":
        script = script.replace("</", "<\\/")
        script = f'<!doctype html><meta charset="utf-8"><body><script>{script}</script>'
    path.write_text(script, encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
