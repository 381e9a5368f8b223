"""The feelings that make content matter to the agent, and the salience that follows from them."""

from __future__ import annotations

import enum
from collections.abc import Mapping


class Feeling(enum.StrEnum):
    """What the agent feels about the content of a coalition; NONE if it feels nothing.

    NOVELTY: it is new. SURPRISE: it was expected to be otherwise. NEED: it is needed, or satisfies
    a need. DANGER: the agent may run into something. LOST: the agent does not know where it is.
    """

    NONE = ""
    NOVELTY = "novelty"
    SURPRISE = "surprise"
    NEED = "need"
    DANGER = "danger"
    LOST = "lost"


UNPLEASANT = frozenset({Feeling.SURPRISE, Feeling.DANGER, Feeling.LOST})


def salience_of(feelings: Mapping[Feeling, float]) -> float:
    """Return the salience of what `feelings` are attached to, each with its activation, 0 to 1:
    that of the most active one, below 0 if it is unpleasant; 0 without any.

    Of equally active ones, the one that comes first in Feeling counts.
    """
    ordered = [feeling for feeling in Feeling if feeling in feelings]
    if not ordered:
        return 0.0

    strongest = max(ordered, key=lambda feeling: feelings[feeling])
    activation = feelings[strongest]
    return -activation if strongest in UNPLEASANT else activation
