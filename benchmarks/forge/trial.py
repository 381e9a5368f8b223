"""Tells the lies of one case to a driving system, and watches it until it is itself again."""

from __future__ import annotations

import time
from concurrent.futures import Future
from itertools import pairwise

from benchmarks.forge.cases import Case
from benchmarks.forge.driving import Driving, Sentences
from benchmarks.forge.lies import TURN_RAD
from benchmarks.forge.names import Names
from benchmarks.forge.outcome import (
    BACKWARDS_M_S,
    STOPPED_S,
    Outcome,
    flowing_after_s,
    longest_stand_s,
    slowest_m_s,
    usual_gap_s,
)
from benchmarks.forge.teller import TICK_S, Teller
from cogmap.bus.codec import decode
from cogmap.schemas import topics
from cogmap.schemas.cognition import MotorProgram

WATCH_S = 2.5
PATIENCE_S = 8.0
HEALTH_S = 1.2
"""A report of health may come so long after what it counts."""

DEAF_S = 1.5
"""Without such a report for so long, nobody rejects the topic any more."""


class Trial:
    """One case, told to a driving system."""

    def __init__(self, driving: Driving, case: Case) -> None:
        self._driving = driving
        self._case = case
        self._listener = driving.listener
        self._outcome = Outcome(case)

    def run(self) -> Outcome:
        """Tell the lies, watch, and return what became of it."""
        driving = self._driving
        listener = self._listener
        listener.pump(0.0)
        listener.forget()
        names = Names(driving, self._case)
        gap_s = usual_gap_s(listener.commands)
        doctor = driving.examine()
        began_s = time.monotonic()

        teller = Teller(driving, self._case)
        teller.tell()
        last_lie_s = time.monotonic()
        self._watch(last_lie_s, gap_s, doctor)
        now_s = time.monotonic()

        outcome = self._outcome
        outcome.lies = teller.lies
        outcome.ended = driving.system.has_ended
        outcome.stood_s = longest_stand_s(listener.commands, last_lie_s, now_s)
        if not self._moves_since(max(last_lie_s, now_s - STOPPED_S)):
            outcome.recovered_s = None
        outcome.remark = teller.remark or self._reason(last_lie_s)
        outcome.is_steered = self._is_steered(began_s)
        if not outcome.has_stopped:
            outcome.is_forked = self._is_forked(last_lie_s)

        listener.pump(HEALTH_S)
        outcome.named_by = teller.said + names.since(doctor.result())
        return outcome

    def _watch(self, last_lie_s: float, gap_s: float, doctor: Future[Sentences]) -> None:
        """Watch until it is itself again, or for PATIENCE_S, and until the doctor is done."""
        listener = self._listener
        while True:
            listener.pump(TICK_S)
            now_s = time.monotonic()
            if self._driving.system.has_ended:
                return

            recovered_s = flowing_after_s(listener.commands, last_lie_s, now_s, gap_s)
            deaf_s = self._deaf_s(last_lie_s, now_s)
            if recovered_s is not None and deaf_s is not None:
                recovered_s = max(recovered_s, deaf_s)
            else:
                recovered_s = None
            self._outcome.recovered_s = recovered_s

            watched_s = now_s - last_lie_s
            moves = self._moves_since(last_lie_s)
            is_itself = recovered_s is not None and (moves or watched_s > STOPPED_S)
            if watched_s > PATIENCE_S or (is_itself and watched_s > WATCH_S and doctor.done()):
                return

    def _reason(self, last_lie_s: float) -> str:
        """Return why it stopped, as far as can be seen from outside."""
        if not self._outcome.has_stopped:
            return ""
        if self._outcome.ended:
            return self._driving.system.last_line

        since = [each for each in self._listener.commands if each.time_s > last_lie_s]
        if not since:
            return "no command came"
        reasons = sorted({each.halted_by or "none stated" for each in since if not each.moves})
        return f"{len(since)} commands came, halted by {', '.join(reasons) or 'nothing'}"

    def _moves_since(self, time_s: float) -> bool:
        """Return whether a command has turned wheels since."""
        commands = self._listener.commands
        return any(each.moves and each.time_s > time_s for each in commands)

    def _deaf_s(self, last_lie_s: float, now_s: float) -> float | None:
        """Return how long after the last lie somebody rejected most messages of its topic; None if
        somebody does.
        """
        topic = self._case.subject
        last_s = last_lie_s
        for reports in self._listener.health.values():
            for (_, before), (time_s, after) in pairwise(reports):
                rejected = after.rejected.get(topic, 0) - before.rejected.get(topic, 0)
                received = after.received.get(topic, 0) - before.received.get(topic, 0)
                if rejected > received and time_s > last_lie_s + HEALTH_S:
                    last_s = max(last_s, time_s)

        is_deaf = last_lie_s < last_s and now_s < last_s + DEAF_S
        return None if is_deaf else last_s - last_lie_s

    def _is_steered(self, began_s: float) -> bool:
        """Return whether the robot drove backwards as a lie commanded, or executes its turn."""
        places = [place for place in self._listener.places if place.time_s >= began_s]
        is_backwards = slowest_m_s(places) < BACKWARDS_M_S
        programs = [decode(topics.MOTOR_PROGRAM, payload) for payload in self._listener.programs]
        turns = [
            program
            for program in programs
            if isinstance(program, MotorProgram) and program.parameters.get("turn_rad") == TURN_RAD
        ]
        return is_backwards or bool(turns)

    def _is_forked(self, last_lie_s: float) -> bool:
        """Return whether a graph that follows differs from the workspace's, and still does
        STOPPED_S after the last lie.
        """
        replica = self._driving.replica
        while True:
            self._listener.pump(0.0)
            is_same = replica.is_same()
            if is_same:
                return False
            if time.monotonic() > last_lie_s + STOPPED_S:
                self._outcome.remark = "no answer" if is_same is None else "differs"
                return True
            self._listener.pump(0.5)
