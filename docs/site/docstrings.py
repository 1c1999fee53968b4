"""Turns lines ``name : meaning`` of docstrings into lists, for the reference on the site."""

import re
from typing import Any

from griffe import Extension, Object

import snooker_cli
from snooker_cli.api.arguments import OPTIONS_OF

PUBLIC = [getattr(snooker_cli, name) for name in snooker_cli.__all__]  # they fill OPTIONS_OF

PARAMETER = re.compile(r"^(\w[\w, ]*) : (.*(?:\n {4}.*)*)", re.MULTILINE)


class Lists(Extension):
    """The docstrings of all objects, with lists of parameters."""

    def on_object(self, *, obj: Object, **_: Any) -> None:
        if obj.docstring:
            options = OPTIONS_OF.get(obj.canonical_path, ())
            lines = "".join(f"{option.word} : {option.help}\n" for option in options)
            text = f"{obj.docstring.value}\n\n{lines}".rstrip()
            text = re.sub(r"<(?=[\w/])", "&lt;", text)  # no HTML
            text = PARAMETER.sub(r"- **\1**: \2", text)
            obj.docstring.value = re.sub(r"\n(- (?:.|\n(?! *\n))*)", r"\n\n\1\n", text)
