"""Makes the gallery of the site: small runs, their figures, and the page docs/gallery.md."""

from pathlib import Path
from typing import Any

import snooker_cli as snooker
from snooker_cli.figures import FIGURES

DOCS = Path(__file__).parents[1]
RUNS = DOCS.parent / "build" / "gallery"

FIGURES_OF: dict[str, tuple[dict[str, Any], dict[str, dict[str, Any]]]] = {
    "configs/decay": (
        {},
        {
            "energy-fit": {"cor": 0.8},
            "energy": {},
            "haff-time": {},
            "event-decay": {},
            "pressure": {},
            "pressure-fit": {"cor": 0.8},
            "central-distances": {"cor": 0.8},
            "momentum-x": {},
        },
    ),
    "configs/restitution": ({"repeats": 10}, {"decay-against-cor": {}}),
    "configs/temperature": ({}, {"pressure-temperature": {}, "speeds": {"balls.speed": 20}}),
    "configs/area": ({}, {"pressure-area": {}, "van-der-waals": {"balls.radius": 0.1}}),
    "configs/number": ({}, {"pressure-number": {}}),
    "configs/radius": ({}, {"temperature-ratio": {}}),
    "templates/brownian": (
        {},
        {"tagged-path": {}, "mean-squared-displacement": {}, "velocity-autocorrelation": {}},
    ),
    "configs/mixture": ({"repeats": 2}, {"species-temperature": {}, "a2": {}, "local-energy": {}}),
    "templates/dense": (
        {"balls.count": 400, "collisions": 40000, "record": "events"},
        {"pair-correlation": {}, "hexatic-order": {}},
    ),
}
"""For each config: keys that are changed, and the figures, each with the points that it shows."""

HEAD = """\
# Gallery

Each figure is below the commands that make it. `snooker plot RUN --list` lists all figures and what
each needs.
"""


def main() -> None:
    """Simulate, draw and write the page."""
    (DOCS / "gallery").mkdir(exist_ok=True)
    page = [HEAD]
    for config, (changes, figures) in FIGURES_OF.items():
        folder, name = config.split("/")
        init = config if folder == "configs" else name
        source = DOCS.parent / ("configs" if folder == "configs" else "snooker_cli/cli/templates")
        run = snooker.run(source / f"{name}.yaml", changes, out=RUNS / name, progress=False)
        options = "".join(f" -o {key}={value}" for key, value in changes.items())
        for figure, where in figures.items():
            image = f"gallery/{figure}.png"
            run.plot(figure, **where).savefig(DOCS / image, dpi=110)
            chosen = "".join(f" --where {key}={value}" for key, value in where.items())
            page += [f"## {FIGURES[figure].title}\n", "```console", f"$ snooker init {init}"]
            page += [
                f"$ snooker run {name}.yaml{options}",
                f"$ snooker plot {name} {figure}{chosen}",
            ]
            page += ["```\n", f"![{FIGURES[figure].title}]({image})\n"]
    (DOCS / "gallery.md").write_text("\n".join(page), encoding="utf-8")


if __name__ == "__main__":
    main()
