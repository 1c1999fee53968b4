"""Turns lines ``name : meaning`` of docstrings into lists, for the reference on the site."""

import re
from typing import Any

from griffe import Extension, Object

PARAMETER = re.compile(r"^(\w[\w, ]*) : (.*(?:\n {4}.*)*)", re.MULTILINE)


class Lists(Extension):
    """The docstrings of all objects, with lists of parameters."""

    def on_object(self, *, obj: Object, **_: Any) -> None:
        if obj.docstring:
            text = re.sub(r"<(?=[\w/])", "&lt;", obj.docstring.value)  # no HTML
            text = PARAMETER.sub(r"- **\1**: \2", text)
            obj.docstring.value = re.sub(r"\n(- (?:.|\n(?! *\n))*)", r"\n\n\1\n", text)
