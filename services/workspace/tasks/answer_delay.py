"""How long after their tasks answers come: deadline and lease follow what is measured."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from statistics import median

from cogmap.runtime.notes import LATE_ANSWERS, note
from cogmap.schemas.graph import Phase
from cogmap.services.workspace.config import Config

WINDOW = 50
"""So many cycles, ten seconds of them, are what it goes by and tells of."""
MIN_MEASURED = 5
"""One answer that was late is a stray, so many are a delay."""
OFTEN = 0.2
"""The share of cycles beyond which it is told that they end without answers, or wait for long. What
the others take is usual.
"""
MARGIN = 1.25
"""How many times the usual delay a phase may take, and a worker."""
WORKING = (Phase.LOCALIZATION, Phase.OBJECTS, Phase.ATTENTION)
"""The phases of each cycle that have tasks."""
MAX_ROUNDS = 256
STEP_MS = 100
MS_NS = 1_000_000


@dataclass
class _Round:
    """The tasks of a phase that were given out together at `given_ns`, and how many are open."""

    phase: Phase
    given_ns: int
    open: int


class AnswerDelay:
    """Measures the delay of answers by the clocks that the workspace receives. A phase takes until
    the last answer to it comes, in time or late.
    """

    def __init__(self, config: Config) -> None:
        self._deadline_ns = config.deadline_ms * MS_NS
        self._longest_ns = max(config.deadline_ms, config.longest_deadline_ms) * MS_NS
        self._lease_ns = config.lease_ms * MS_NS
        self._rounds: dict[str, _Round] = {}
        self._took_ns: dict[Phase, deque[int]] = {}
        self._ages_ns: deque[int] = deque(maxlen=WINDOW)
        self._began_ns = 0
        self._without: deque[bool] = deque(maxlen=WINDOW)
        self._waited: deque[bool] = deque(maxlen=WINDOW)

    def begin(self, stamp_ns: int, now_ns: int) -> None:
        """Note that a cycle begins at `now_ns`, with a view of `stamp_ns`."""
        self._began_ns = max(stamp_ns, now_ns)
        self._ages_ns.append(self._began_ns - stamp_ns)

    def ask(self, phase: Phase, tasks: Iterable[str], now_ns: int) -> None:
        """Note that these tasks of a phase are given out."""
        names = list(tasks)
        asked = _Round(phase, now_ns, len(names))
        self._rounds |= dict.fromkeys(names, asked)
        while len(self._rounds) > MAX_ROUNDS:
            del self._rounds[next(iter(self._rounds))]

    def answer(self, task: str, now_ns: int) -> None:
        """Note an answer: the first to a task counts."""
        asked = self._rounds.pop(task, None)
        if asked is None:
            return
        asked.open -= 1
        if asked.open == 0:
            took_ns = self._took_ns.setdefault(asked.phase, deque(maxlen=WINDOW))
            took_ns.append(max(0, now_ns - asked.given_ns))

    def end(self, now_ns: int, stamp_ns: int, *, is_cut: bool) -> None:
        """Note that the cycle ends, and whether it `is_cut`: answers had not come."""
        self._without.append(is_cut)
        self._waited.append(now_ns - stamp_ns > self._deadline_ns)

    def deadline_ns(self, stamp_ns: int) -> float:
        """Return when the cycle ends: at the view's age that is set, or later where answers usually
        take longer.
        """
        wanted_ns = self._began_ns - stamp_ns + self._expected_ns
        return stamp_ns + max(self._deadline_ns, min(self._longest_ns, wanted_ns))

    @property
    def lease_ns(self) -> int:
        """Return how long a worker may take: the time that is set, or longer where even the fastest
        phase takes longer.
        """
        usual_ns = self._usual_ns
        if not usual_ns:
            return int(self._lease_ns)
        following_ns = MARGIN * min(usual_ns.values())
        return int(max(self._lease_ns, min(self._longest_ns, following_ns)))

    def notes(self) -> list[str]:
        """Say how late answers are, if many cycles ended without some or waited for long."""
        usual_ns = self._usual_ns
        cycles = len(self._without)
        without = sum(self._without)
        waited = sum(self._waited)
        often = OFTEN * WINDOW
        if not usual_ns or max(without, waited) < often:
            return []
        needed_ns = median(self._ages_ns) + self._expected_ns
        if needed_ns <= self._deadline_ns:
            return []

        remedy = "shorten the way between the workspace and its codelets, or end other programs"
        if without >= often and needed_ns > self._longest_ns:
            needed_ms = STEP_MS * math.ceil(needed_ns / MS_NS / STEP_MS)
            remedy = f"set workspace.longest_deadline_ms to {needed_ms}, or {remedy}"
        usual_ms = max(usual_ns.values()) / MS_NS
        wrong = (
            f"{LATE_ANSWERS} {usual_ms:.0f} ms after their tasks: of the last "
            f"{cycles} cycles {without} ended without them, and {waited} lasted longer than "
            f"workspace.deadline_ms"
        )
        return [note(wrong, remedy)]

    @property
    def _usual_ns(self) -> dict[Phase, int]:
        """Return how long each phase usually takes, of those that were measured often enough."""
        taken = self._took_ns.items()
        return {phase: _usual(took) for phase, took in taken if len(took) >= MIN_MEASURED}

    @property
    def _expected_ns(self) -> float:
        """Return how long the phases of a cycle may take together. One that was never measured,
        because none of its answers came, takes as long as the longest.
        """
        usual_ns = self._usual_ns
        if not usual_ns:
            return 0.0
        longest_ns = max(usual_ns.values())
        expected = dict.fromkeys(WORKING, longest_ns) | usual_ns
        return MARGIN * sum(expected.values())


def _usual(took_ns: Sequence[int]) -> int:
    """Return what all but the OFTEN longest took."""
    return sorted(took_ns)[int(len(took_ns) * (1 - OFTEN))]
