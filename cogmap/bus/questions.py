"""Asks on the bus: whose answer counts, and which answers do not."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable

import zenoh

from cogmap.bus.incarnations import HOLD_S
from cogmap.bus.interface import Answer, Incarnation
from cogmap.bus.samples import encoding, envelope_of
from cogmap.errors import NoAnswerError
from cogmap.schemas.topics import Topic

log = logging.getLogger("cogmap")
POLL_S = 0.05
# After an answer, whoever else answers is heard for so long: the router says when all have.
OTHERS_S = 0.1
OTHERS_POLL_S = 0.001


class Questions:
    """What a session asks, as `agent`. An answer counts if it is of one of `incarnations`, of those
    that are on the bus.
    """

    def __init__(
        self, session: zenoh.Session, agent: str, incarnations: Callable[[], list[Incarnation]]
    ) -> None:
        self._session = session
        self._agent = agent
        self._incarnations = incarnations
        self._doubted = 0
        self._last_doubt = ""

    def notes(self) -> list[str]:
        """Return how many answers did not count, and why the last one."""
        if not self._doubted:
            return []
        return [f"{self._doubted} answers did not count, the last: {self._last_doubt}"]

    def ask(self, request: Topic, payload: bytes, timeout_s: float) -> Answer:
        """Return the first answer that counts. Raises NoAnswerError if there is none, or if nobody
        can tell which one is true.
        """
        replies = self._session.get(
            request.key(self._agent),
            payload=payload,
            encoding=encoding(request),
            consolidation=zenoh.ConsolidationMode.NONE,
            timeout=timeout_s,
        )
        reason = (
            f"nobody answers {request.name} within {timeout_s:g} s: "
            f"is the module that does running?"
        )
        unknown = []
        for reply in replies:
            if reply.ok is not None:
                answer = Answer(bytes(reply.ok.payload), envelope_of(reply.ok))
                if self._first_known([answer]) is None:
                    unknown.append(answer)
                    continue
                self._check_others(request, answer, [*unknown, *_others(replies)])
                return answer
            if reply.err is not None:
                said = bytes(reply.err.payload).decode(errors="replace")
                reason = f"{request.name}: {said}"
        if not unknown:
            raise NoAnswerError(reason)

        # While the tokens that this session watches are on their way, none may be listed.
        until_s = time.monotonic() + HOLD_S
        while time.monotonic() < until_s:
            known = self._first_known(unknown)
            if known is not None:
                self._check_others(request, known, unknown)
                return known
            time.sleep(POLL_S)
        raise NoAnswerError(f"{request.name} was answered by somebody who is not on the bus")

    def _check_others(self, request: Topic, answer: Answer, others: list[Answer]) -> None:
        """Say who else answers that is not on the bus. Raises NoAnswerError if somebody in the same
        name answers something else: nobody can tell which answer is true.
        """
        for other in others:
            source = "nobody" if other.envelope is None else other.envelope.source
            if self._first_known([other]) is None:
                self._doubt(f"{request.name}: {source} is not on the bus")
            elif _voice(other) == _voice(answer) and other.payload != answer.payload:
                conflict = f"{request.name}: {source} gives unlike answers, somebody in its name"
                self._doubt(conflict)
                raise NoAnswerError(conflict)

    def _doubt(self, reason: str) -> None:
        self._doubted += 1
        self._last_doubt = reason
        log.warning("an answer does not count: %s", reason)

    def _first_known(self, answers: list[Answer]) -> Answer | None:
        """Return the first answer of an incarnation that is on the bus, None if none is."""
        present = {(each.source, each.number) for each in self._incarnations()}
        for answer in answers:
            if _voice(answer) in present:
                return answer
        return None


def _voice(answer: Answer) -> tuple[str, int] | None:
    """Return as who an answer is given: every module may answer for its settings."""
    envelope = answer.envelope
    return None if envelope is None else (envelope.source, envelope.incarnation)


def _others(replies: zenoh.handlers.Handler[zenoh.Reply]) -> list[Answer]:
    """Return what else is answered soon."""
    found = []
    until_s = time.monotonic() + OTHERS_S
    while time.monotonic() < until_s:
        try:
            reply = replies.try_recv()
        except zenoh.ZError:
            break  # all have answered
        if reply is None:
            time.sleep(OTHERS_POLL_S)
        elif reply.ok is not None:
            found.append(Answer(bytes(reply.ok.payload), envelope_of(reply.ok)))
    return found
