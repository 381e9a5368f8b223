"""Who names a lie: logs, the health of processes, a doctor."""

from __future__ import annotations

import re

from benchmarks.forge.cases import Case, Kind
from benchmarks.forge.driving import Driving, Sentences
from benchmarks.forge.lies import STRANGER

FOLLOWER = "follower"


class Names:
    """What the processes of a drive have written and reported until now, to be compared with what
    they do later.
    """

    def __init__(self, driving: Driving, case: Case) -> None:
        self._driving = driving
        self._case = case
        self._words = [case.subject, STRANGER]
        if case.kind is Kind.GHOST:
            self._words = [f"{case.subject}-ghost"]
        self._sizes = driving.system.sizes()
        self._notes = self._all_notes()
        self._counts = self._all_counts()

    def since(self, doctor: Sentences) -> Sentences:
        """Return what has been said since that names the lie; `doctor` has its findings."""
        lines = self._driving.system.lines_since(self._sizes)
        found = [line for line in lines if self._is_about(line)]
        for name, count in self._all_counts().items():
            if count > self._counts.get(name, 0):
                found.append(f"health: {name} {count}")
        found += [f"health: {note}" for note in self._all_notes() - self._notes]
        return found + [sentence for sentence in doctor if self._is_about(sentence)]

    def _is_about(self, sentence: str) -> bool:
        return any(word in sentence for word in self._words)

    def _all_notes(self) -> set[str]:
        """Return all that is reported in words, without its numbers."""
        notes = set()
        for instance, reports in self._driving.listener.health.items():
            if reports:
                notes |= {f"{instance}: {_plain(note)}" for note in reports[-1][1].notes}
        followed = self._driving.replica.notes
        return notes | {f"{FOLLOWER}: {_plain(note)}" for note in followed}

    def _all_counts(self) -> dict[str, int]:
        """Return what was rejected of the topic and what was lost, by instance."""
        counts = {}
        for instance, reports in self._driving.listener.health.items():
            if reports:
                health = reports[-1][1]
                name = self._case.subject
                counts[f"{instance} rejected"] = health.rejected.get(name, 0)
                counts[f"{instance} lost"] = health.gaps.get(name, 0)
        return counts


def _plain(note: str) -> str:
    return re.sub(r"\d+", "#", note)
