"""The engine in JavaScript, for the live page: its scripts, in an order in which they can run."""

from pathlib import Path

ENGINE_SCRIPTS = (
    "collision.js",
    "boundaries.js",
    "all_pairs.js",
    "cells.js",
    "sliding.js",
    "simulation.js",
    "random_numbers.js",
    "places.js",
    "start.js",
)


def engine_source() -> str:
    """The scripts of the engine and of the start, one after the other."""
    folder = Path(__file__).parent
    return "\n".join((folder / name).read_text("utf-8") for name in ENGINE_SCRIPTS)
