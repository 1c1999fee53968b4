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

from javascript import (  # noqa: E402  # after the path
    HELPERS,
    JavaScript,
    answer_of,
    modules_source,
)
from test_bits import CASES  # noqa: E402
from test_engine import is_simulated  # noqa: E402
from test_start import START  # noqa: E402

from snooker_cli.config import to_json, validated  # noqa: E402
from snooker_cli.engine import simulate  # noqa: E402
from snooker_cli.live_page.page import STARTING, engine_source, stored_start  # noqa: E402

COMPARE = """
function compared() {
  const different = [];
  for (const { name, start, limits, answer } of CASES) {
    const found = simulated(storedScene(start), limits);
    if (JSON.stringify(JSON.parse(found)) !== JSON.stringify(answer)) different.push(name);
  }
  const equal = CASES.length - different.length;
  const verdict = `${equal} of ${CASES.length} scenes have the program's bits.`;
  const isSame = JSON.parse(startOfRepeat(START, 0)).bits === START_BITS;
  return `${verdict} ${different.join(", ")} The start is ${isSame ? "the same" : "different"}.`;
}
if (typeof document === "undefined") print(compared());
else document.body.textContent = compared();
"""


def case(name: str) -> dict[str, object]:
    """A golden scene, and the program's events, ending and final state."""
    scene, limits = CASES[name].scene(), {"collisions": CASES[name].collisions}
    answer = answer_of(simulate(scene, **limits))
    return {"name": name, "start": stored_start(scene), "limits": limits, "answer": answer}


def start() -> str:
    """A config, and the bits of its start in V8."""
    config = to_json(validated(START))
    with JavaScript() as engine:
        bits = engine.answer(f"startOfRepeat({config}, 0)")["bits"]
    return f"const START = {config}, START_BITS = {json.dumps(bits)};"


def main(path: Path) -> None:
    cases = (
        f"const CASES = {json.dumps([case(name) for name in CASES if is_simulated(CASES[name])])};"
    )
    engine = engine_source(*STARTING)
    script = "\n".join([engine, modules_source(), HELPERS, cases, start(), COMPARE])
    if path.suffix == ".html":
        script = script.replace("</", "<\\/")
        script = f'<!doctype html><meta charset="utf-8"><body><script>{script}</script>'
    path.write_text(script, encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
