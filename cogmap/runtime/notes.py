"""Notes: what a process's health says in words, each with its remedy if it has one."""

from __future__ import annotations

LATE_ANSWERS = "answers come"
"""How the note begins that answers to the workspace are late: a doctor blames no machine then."""
_REMEDY = ": to mend it, "


def note(wrong: str, remedy: str) -> str:
    """Return the note that something is `wrong`, and what to do about it."""
    return f"{wrong}{_REMEDY}{remedy}"


def wrong_and_remedy(text: str) -> tuple[str, str]:
    """Return what a note says is wrong, and what to do about it: empty if it does not say."""
    wrong, _, remedy = text.partition(_REMEDY)
    return wrong, remedy
