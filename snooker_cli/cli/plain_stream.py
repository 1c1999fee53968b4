"""Streams for terminals and files whose encoding lacks some of the characters that are printed."""

import io

from snooker_cli.formatting import in_encoding


class PlainStream(io.TextIOWrapper):
    """A text stream that writes plain words for what its encoding lacks.

    As it takes any text, its ``encoding`` is UTF-8: Typer would write bytes of UTF-8 past it if it
    were ASCII.
    """

    encoding = "utf-8"

    def __init__(self, stream: io.TextIOWrapper) -> None:
        lines = stream.line_buffering
        super().__init__(stream.buffer, stream.encoding, "backslashreplace", line_buffering=lines)
        self._written_in, self._owner = stream.encoding, stream  # which else closes the buffer

    def write(self, text: str) -> int:
        """Write text, and return its number of characters."""
        super().write(in_encoding(text, self._written_in))
        return len(text)
