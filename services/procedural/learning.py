"""How reliable schemes are: whether what they were expected to bring about came true. Pure."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import msgspec

from cogmap.schemas.cognition import Action, Behaviour
from cogmap.services.procedural.patterns import Active
from cogmap.services.procedural.schemes import Scheme


@dataclass
class Record:
    """How often a scheme was executed and judged, and how often its results came true."""

    executions: int = 0
    successes: int = 0


@dataclass(frozen=True)
class Execution:
    """A scheme in execution, the nodes that its variables stand for, and until when its results
    are awaited.
    """

    scheme: Scheme
    bindings: Mapping[str, str]
    until_ns: int


class Reliability:
    """Judges each execution by the situations after it.

    It is a success where all results have come true in time, and a failure where they have not. One
    that another scheme interrupts is not counted, nor one that was expected to bring about nothing.
    A scheme that is chosen again before it is judged continues.
    """

    def __init__(self, schemes: Iterable[Scheme]) -> None:
        self._schemes = {scheme.name: scheme for scheme in schemes}
        self._records = {name: Record() for name in self._schemes}
        self._running: Execution | None = None

    def restore(self, behaviours: Iterable[Behaviour]) -> None:
        """Continue with the counts that were published last."""
        for behaviour in behaviours:
            if behaviour.scheme in self._records:
                record = Record(behaviour.executions, behaviour.successes)
                self._records[behaviour.scheme] = record

    def on_action(self, action: Action) -> None:
        """Note that a scheme is executed from now on."""
        if not action.scheme:
            return

        running = self._running
        if running is not None and running.scheme.name == action.scheme:
            return

        self._running = None
        scheme = self._schemes.get(action.scheme)
        if scheme is not None and scheme.adding:
            until_ns = action.stamp_ns + round(scheme.within_s * 1e9)
            chosen = (each for each in action.behaviours if each.scheme == action.scheme)
            bindings = next((behaviour.bindings for behaviour in chosen), {})
            self._running = Execution(scheme, bindings, until_ns)

    def judge(self, nodes: Sequence[Active], stamp_ns: int) -> None:
        """Judge whether what is executed has had its results, in the situation of a time."""
        running = self._running
        if running is None:
            return

        has_come_true = running.scheme.has_come_true(nodes, running.bindings)
        if not has_come_true and stamp_ns <= running.until_ns:
            return

        record = self._records[running.scheme.name]
        record.executions += 1
        record.successes += has_come_true
        self._running = None

    def noted(self, behaviour: Behaviour) -> Behaviour:
        """Return a behaviour with the reliability of its scheme."""
        record = self._records[behaviour.scheme]
        reliability = self._schemes[behaviour.scheme].base_level
        if record.executions:
            reliability = record.successes / record.executions
        return msgspec.structs.replace(
            behaviour,
            reliability=reliability,
            executions=record.executions,
            successes=record.successes,
        )
