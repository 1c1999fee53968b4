"""Errors that end a command with a sentence for the user."""

from __future__ import annotations


class SceneError(ValueError):
    """A scene that cannot exist; ``key`` names the config key to change, ``ball`` who is wrong."""

    def __init__(self, key: str, message: str, ball: int | None = None) -> None:
        super().__init__(message)
        self.key = key
        self.ball = ball


class JammedError(Exception):
    """Balls that found no room; ``packing`` is what they reached."""

    def __init__(self, packing: float) -> None:
        super().__init__(packing)
        self.packing = packing


class StoreError(Exception):
    """A result file that cannot be read or trusted; one sentence."""


class AbsentError(StoreError):
    """A result file that is not there, or that cannot be written; one sentence."""


class RunError(Exception):
    """A run's folder that cannot be used; one sentence."""


class DamagedError(RunError):
    """A run of which what it is cannot be read."""


class ClusterError(RunError):
    """Workers that cannot be had; one sentence."""


class FigureError(Exception):
    """A picture that a run cannot give; one sentence that says why and what to do."""


class FilmError(Exception):
    """A film that cannot be made of a repeat; one sentence."""


class MovieError(Exception):
    """A movie that cannot be written; one sentence."""


class ExportError(Exception):
    """A file that cannot be made; one sentence."""


class RenderingError(Exception):
    """A report that cannot be laid out; one sentence."""


class UserError(Exception):
    """A wrong argument that the parser could not see; one sentence."""
