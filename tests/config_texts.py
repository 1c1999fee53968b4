"""Two configs that several tests of configs begin with."""

from snooker_cli.config import Config, parse

BASE = """\
# 37 balls
container: {radius: 10.0, mass: 1.0e7}
balls: {rings: 3, radius: 1.0, mass: 1.0, speed: 10.0, ring_extent: 0.8}
cor: 0.8
collisions: 500
"""

PAIR = """\
container: {radius: 10.0}
balls:
  list:
    - {position: [-1, 0], velocity: [2, 0.5], radius: 0.1}
    - position: [1.0, 0.25]
      velocity: [0, 0]
      radius: 0.2
      mass: 3
cor: 1
time: 2.5
"""


def config(text: str = BASE, *overrides: str) -> Config:
    return parse(text, "run.yaml", overrides).config
