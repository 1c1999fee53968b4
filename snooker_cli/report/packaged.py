"""Files of this package: templates, figures, printed values and saved measurements."""

from importlib.resources import files


def packaged(name: str) -> str:
    """The text of a file."""
    return (files("snooker_cli.report") / name).read_text(encoding="utf-8")
