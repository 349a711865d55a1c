"""The streams a command prints to: they take any text, and no text repaints the terminal."""

from __future__ import annotations

import codecs
import os
import sys
import unicodedata

_PLAIN_SIGNS = {
    "µ": "u", "μ": "u", "−": "-", "–": "-", "°": " deg", "×": "x", "·": ".", "²": "^2", "³": "^3", "ⁿ": "^n",
    "…": "...", "≤": "<=", "≥": ">=", "±": "+-", "→": "->", "ω": "omega", "█": "#", "░": ".", "┃": "|",
    "▲": "^", "☐": "-",
}  # fmt: skip
"""What a terminal shows in place of signs its encoding lacks."""


def open_streams() -> None:
    """Make standard output and error take any text, whatever their encoding, also where they are closed."""

    def plain_signs(error: UnicodeError) -> tuple[str, int]:
        assert isinstance(error, UnicodeEncodeError)
        signs = error.object[error.start : error.end]
        without_accents = (unicodedata.normalize("NFKD", sign).encode("ascii", "ignore") for sign in signs)
        shown = zip(signs, without_accents, strict=True)
        return "".join(_PLAIN_SIGNS.get(sign) or plain.decode() or "?" for sign, plain in shown), error.end

    codecs.register_error("plain signs", plain_signs)
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if stream is None:
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))  # noqa: SIM115, PTH123
        elif hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="plain signs")


def printable(text: str) -> str:
    """Text whose control characters, which a name from a file could use to repaint the terminal, are gone."""
    return "".join(
        "\N{REPLACEMENT CHARACTER}" if unicodedata.category(sign)[0] == "C" and sign != "\n" else sign
        for sign in text
    )
