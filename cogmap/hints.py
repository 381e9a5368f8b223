"""What was meant by a word that is not known."""

from __future__ import annotations

import difflib
from collections.abc import Iterable


def nearest(word: str, known: Iterable[str]) -> str:
    """Return the known word that is most like `word`; an empty string if none is like it."""
    close = difflib.get_close_matches(word, [str(each) for each in known], 1)
    return close[0] if close else ""


def did_you_mean(word: str, known: Iterable[str], otherwise: str) -> str:
    """Return the end of a sentence about an unknown `word`; `otherwise` if none is like it."""
    meant = nearest(word, known)
    return f"did you mean {meant!r}?" if meant else otherwise
