"""Makes the gallery of the site: small runs, their figures, and the page docs/gallery.md."""

from pathlib import Path
from typing import Any

import snooker_cli as snooker
from snooker_cli.figures.registry import FIGURES

DOCS = Path(__file__).parents[1]
ROOT = DOCS.parent

FIGURES_OF: dict[str, tuple[dict[str, Any], dict[str, dict[str, Any]]]] = {
    "configs/decay": (
        {},
        {
            "cooling": {"cor": 0.8},
            "energy": {},
            "event-decay": {},
            "pressure": {},
        },
    ),
    "configs/restitution": ({"repeats": 10}, {"decay-against-cor": {}}),
    "sweep": ({"repeats": 10}, {"swept-key": {}}),
    "configs/temperature": ({}, {"gas-law": {}, "speeds": {"balls.speed": 20}}),
    "configs/area": ({}, {"van-der-waals": {"balls.radius": 0.1}}),
    "configs/radius": ({}, {"equation-of-state": {}}),
    "brownian": (
        {},
        {"tagged-path": {}, "mean-squared-displacement": {}, "velocity-autocorrelation": {}},
    ),
    "configs/mixture": (
        {"repeats": 2},
        {"species-temperature": {}, "a2": {}},
    ),
    "rough": ({}, {"rotation": {}}),
    "heat": ({}, {"profiles": {}, "heat-flux": {}}),
    "driven": (
        {"balls.radius": 0.4},
        {"stationary": {}, "energy-balance": {"cor": 0.9}},
    ),
    "dense": (
        {"balls.count": 400, "collisions": 40000, "record": "events"},
        {"pair-correlation": {}, "hexatic-order": {}},
    ),
    "configs/large": (
        {"balls.count": 4000, "collisions": 400000},
        {
            "snapshot": {},
            "cluster-growth": {},
            "structure-factor": {},
            "velocity-tails": {},
        },
    ),
}
"""For each config of `snooker init`: changed keys, and figures with the points that they show."""

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
        name, folder = Path(config).name, "" if "/" in config else "snooker_cli/config/templates"
        source = ROOT / folder / f"{config}.yaml"
        run = snooker.run(source, changes, out=ROOT / "build" / "gallery" / name, fresh=True)
        options = "".join(f" -o {key}={value}" for key, value in changes.items())
        for figure, where in figures.items():
            title, chosen = (
                FIGURES[figure].title,
                "".join(f" --where {k}={where[k]}" for k in where),
            )
            run.plot(figure, **where).savefig(DOCS / "gallery" / f"{figure}.png", dpi=110)
            page.append(
                f"## {title}\n\n```console\n$ snooker init {config}\n"
                f"$ snooker run {name}.yaml{options}\n$ snooker plot {name} {figure}{chosen}\n"
                f"```\n\n![{title}](gallery/{figure}.png)\n"
            )
    (DOCS / "gallery.md").write_text("\n".join(page), encoding="utf-8")


if __name__ == "__main__":
    main()
