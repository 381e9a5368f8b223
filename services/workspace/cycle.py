"""The cognitive cycle in the workspace: percepts in, codelets' proposals collected, deltas out."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import msgspec

from cogmap.errors import MessageError
from cogmap.runtime.codelet import ConfiguredCodelet, CycleContext
from cogmap.runtime.run import Run
from cogmap.schemas.base import Message
from cogmap.schemas.codelets import Offer, Proposal
from cogmap.schemas.cognition import Broadcast, Competition
from cogmap.schemas.graph import Delta, Operation, Phase, Snapshot, SnapshotRequest
from cogmap.schemas.process import Clock, Presence
from cogmap.schemas.sensing import Energy, Percepts, RangeScan, SelfMotion
from cogmap.services.workspace.association.individuals import Individuals, as_entered
from cogmap.services.workspace.commit import Ledger, coalitions_of
from cogmap.services.workspace.config import Config
from cogmap.services.workspace.forgetting import Forgetting
from cogmap.services.workspace.ingress import (
    check_percepts,
    first_goals,
    first_operations,
    percept_operations,
)
from cogmap.services.workspace.learning.base_level import learned_operations
from cogmap.services.workspace.learning.consciousness import Consciousness
from cogmap.services.workspace.offers import OFFERING, Offers
from cogmap.services.workspace.senses import Sensed
from cogmap.services.workspace.tasks.answer_delay import AnswerDelay
from cogmap.services.workspace.tasks.dispatch import MAX_ATTEMPTS, Dispatch
from cogmap.services.workspace.tasks.lane import Lanes
from cogmap.services.workspace.tasks.late_tasks import LateTasks
from cogmap.services.workspace.view_order import ViewOrder

WORKERS = "codelets"
COMPETITION = "global_workspace"
PHASES = (Phase.CORRECTION, Phase.LOCALIZATION, Phase.OBJECTS, Phase.ATTENTION)
LANES_BEGIN = Phase.ATTENTION
# Where a cycle continues after a commit of each phase; lanes are committed after the last one.
PLACE_OF = {phase: place for place, phase in enumerate(PHASES)} | {
    Phase.BACKGROUND: len(PHASES) - 1
}


class Workspace:
    """One cycle for each view: a state machine that messages drive, the only writer of its graph.

    Each phase gives its codelets' tasks to workers and ends with a commit of their answers.
    """

    def __init__(self, config: Config, codelets: Sequence[ConfiguredCodelet], run: Run) -> None:
        self._config = config
        self._codelets = codelets
        self._is_lockstep = run.lockstep

        writers = {codelet.name: codelet.codelet.may_write for codelet in codelets}
        self._ledger = Ledger(writers)
        self._lanes = Lanes(codelets, config, run)
        self._delay = AnswerDelay(config)
        self._dispatch = Dispatch(self._delay.lease_ns, self._lanes.dispatches)
        self._forgetting = Forgetting()
        self._individuals = Individuals(self._ledger.graph)
        offering = [name for name in OFFERING if run.has_any(name)]
        self._offers = Offers(offering if run.lockstep else (), len(config.goals))
        self._consciousness = Consciousness(run.lockstep and run.has_any(COMPETITION))

        self._sensed = Sensed(run)
        self._waiting: Percepts | None = None
        self._is_repeated = False
        self._context: CycleContext | None = None
        self._phase = 0
        self._late_tasks = LateTasks()
        self._now_ns = 0
        self._begun_ns = -1
        self._view_order = ViewOrder()

    def restore(self, past: Iterable[Message]) -> None:
        """Restore the graph as it was left.

        A cycle that was interrupted continues from its last commit when its percepts come again.
        """
        for message in past:
            if isinstance(message, Snapshot | Delta):
                self._ledger.restore(message)
                self._begun_ns = max(self._begun_ns, message.stamp_ns)

        self._forgetting.restore(self._ledger.graph)
        self._individuals.known.restore()
        self._offers.restore(self._ledger.graph.cycle)
        self._consciousness.restore(self._ledger.graph.cycle)

    def snapshot(self, request: SnapshotRequest | None = None) -> Snapshot:
        """Return the whole graph.

        Raises MessageError if `request` asks for a version that is not committed yet.
        """
        graph = self._ledger.graph
        if request is not None and request.at_least > graph.version:
            raise MessageError(
                f"version {request.at_least} is not committed yet: the graph is at {graph.version}"
            )
        return msgspec.structs.replace(graph.snapshot(), stamp_ns=max(0, self._begun_ns))

    def notes(self) -> list[str]:
        """Return what its health reports in words."""
        notes = []
        if not self._is_lockstep:
            notes += [*self._delay.notes(), *self._dispatch.notes(self._now_ns)]
        return [*notes, *self._view_order.notes()]

    def on_motion(self, motion: SelfMotion) -> list[Message]:
        """Keep what moved until a cycle moves the self node by it."""
        self._sensed.put_motion(motion, self._moved_until_ns)
        return self._begin()

    def on_scan(self, scan: RangeScan) -> list[Message]:
        """Keep a range scan for the cycle of its view."""
        self._sensed.put_scan(scan)
        return self._begin()

    def on_energy(self, energy: Energy) -> list[Message]:
        """Keep what the body senses of its energy for the cycle of its view."""
        self._sensed.put_energy(energy)
        return self._begin()

    def on_percepts(self, percepts: Percepts) -> list[Message]:
        """Begin a cycle with the view's percepts, as soon as the one before has ended.

        In lockstep percepts that are repeated while they wait begin it without the competition of
        the cycle before, which was lost with a process that was killed. While a cycle runs they
        have its tasks given once more, and those of one that ended without moving the self node
        begin another. Late ones are ignored.
        """
        check_percepts(percepts)
        if self._view_order.is_late(percepts.stamp_ns, self._begun_ns):
            return []
        waiting = self._waiting
        is_waiting = waiting is not None and waiting.stamp_ns == percepts.stamp_ns
        is_again = percepts.stamp_ns == self._begun_ns
        if self._context is not None and (is_again or is_waiting):
            return self._repeat()
        has_moved = self._moved_until_ns >= self._begun_ns
        if is_again and has_moved and not self._is_interrupted(percepts):
            return []

        self._is_repeated = is_again or is_waiting
        self._waiting = percepts
        return self._begin()

    def on_competition(self, competition: Competition) -> list[Message]:
        """Note that a competition for consciousness has ended. Raises MessageError if its cycle
        has not begun.
        """
        self._check_begun(competition)
        self._consciousness.on_competition(competition)
        return self._begin()

    def on_broadcast(self, broadcast: Broadcast) -> list[Message]:
        """Keep what is conscious until the next cycle learns from it. Raises MessageError if its
        cycle has not begun.
        """
        self._check_begun(broadcast)
        self._consciousness.on_broadcast(broadcast)
        return self._begin()

    def on_offer(self, offer: Offer) -> list[Message]:
        """Keep an offer until the next cycle begins. Raises MessageError if it is of a cycle that
        has not begun, or one too many.
        """
        self._check_begun(offer)
        self._offers.put(offer)
        return self._begin()

    def on_proposal(self, proposal: Proposal) -> list[Message]:
        """Collect an answer.

        One that comes after its cycle has ended is committed now if it still applies. If it does
        not, it is rejected, and the next delta counts it. Raises MessageError if its task was never
        given to who answers it.
        """
        if self._dispatch.answer(proposal) or self._lanes.answer(proposal):
            self._delay.answer(proposal.task_id, self._now_ns)
            return self._continue_if_complete([])

        if not self._late_tasks.answer(proposal):
            return []

        self._delay.answer(proposal.task_id, self._now_ns)
        if not self._ledger.validate([proposal]):
            return []
        if proposal.coalitions:
            # Its codelet would keep that it has brought them.
            self._ledger.reject(f"the coalitions of {proposal.task_id} came after its cycle")
            return []

        graph = self._ledger.graph
        delta = self._ledger.commit(
            proposal.stamp_ns, graph.cycle, Phase.LATE, proposal.operations, [proposal.task_id]
        )
        self._note(delta)
        return [delta, *proposal.events]

    def on_presence(self, presence: Presence) -> list[Message]:
        """Note that a worker came or went; the cycle continues without a task that has failed."""
        self._offers.presence(presence.instance, presence.alive)
        if presence.module != WORKERS:
            return []

        worker = presence.instance
        is_alive = presence.alive
        version = self._ledger.graph.version
        published = self._lanes.presence(worker, is_alive, version, self._now_ns)
        published += self._dispatch.presence(worker, is_alive, self._now_ns)
        return self._continue_if_complete(published)

    def on_clock(self, clock: Clock) -> list[Message]:
        """Revoke leases that have ended, end a cycle at its deadline, and begin one that waited for
        its scan: in real time alone. The first two follow the delay of answers.

        Each clock counts, even if earlier than the one before: else, after one that ran far ahead,
        no later deadline would be kept.
        """
        self._now_ns = clock.stamp_ns
        if self._is_lockstep:
            return []

        published = self._lanes.expire(self._ledger.graph.version, self._now_ns)
        if self._context is None:
            return [*published, *self._begin()]

        if self._now_ns > self._delay.deadline_ns(self._context.stamp_ns):
            published += self._commit_answers()
            published += self._lanes.begin(self._context, self._ledger, self._now_ns)
            return [*published, *self._end(is_cut=True)]

        published += self._dispatch.expire(self._now_ns)
        return self._continue_if_complete(published)

    @property
    def _awaits_answers(self) -> bool:
        """Return whether the phase waits for answers: in lockstep for those of lanes too, so that
        these read the graph as it was when their tasks began.
        """
        awaited = [self._dispatch]
        if self._is_lockstep:
            awaited += self._lanes.dispatches()
        return not all(dispatch.complete for dispatch in awaited)

    @property
    def _moved_until_ns(self) -> int:
        agent = self._ledger.graph.agent
        if agent is None:
            return -1
        return agent.stamp_ns

    def _check_begun(self, message: Competition | Broadcast | Offer) -> None:
        """Raise MessageError if a message is of a cycle that has not begun: nobody can know more
        of it than the workspace.
        """
        cycle = self._ledger.graph.cycle
        if message.cycle > cycle:
            name = type(message).__name__.lower()
            raise MessageError(
                f"{name} of {message.source} is of cycle {message.cycle}, and the newest is {cycle}"
            )

    def _repeat(self) -> list[Message]:
        """Give the tasks of the cycle that runs once more, in lockstep: its view is shown again
        because nothing came of it.
        """
        if not self._is_lockstep:
            return []
        published: list[Message] = []
        for dispatch in [self._dispatch, *self._lanes.dispatches()]:
            published += dispatch.repeat(self._now_ns)
        return published

    def _is_interrupted(self, percepts: Percepts) -> bool:
        """Decide whether those are the percepts of a cycle that ended before its last phase."""
        if self._context is not None or percepts.stamp_ns != self._begun_ns:
            return False
        return self._ledger.graph.phase is not Phase.END

    def _begin(self) -> list[Message]:
        """Begin a cycle if none runs, a view waits, and all that was sensed for it has come."""
        percepts = self._waiting
        if self._context is not None or percepts is None:
            return []

        moved_ns = self._moved_until_ns
        if not self._sensed.is_complete(percepts.stamp_ns, moved_ns, self._now_ns):
            return []

        graph = self._ledger.graph
        if self._is_interrupted(percepts):
            self._waiting = None
            entered = as_entered(percepts, graph)
            self._context = self._sensed.context(entered, moved_ns, graph.cycle, graph.version)
            self._phase = PLACE_OF.get(graph.phase, -1)
            self._delay.begin(percepts.stamp_ns, self._now_ns)
            return self._next_phase()

        # A cycle that a kill interrupted, and whose view will not come again, ends.
        ended: list[Message] = []
        if graph.phase is not Phase.END:
            ended = [self._ledger.commit(max(0, self._begun_ns), graph.cycle, Phase.END, [])]
        cycle = graph.cycle
        is_known = self._is_repeated or self._consciousness.complete(cycle)
        if not is_known or not self._offers.complete(cycle, self._is_repeated):
            return ended
        return [*ended, *self._begin_cycle(percepts)]

    def _begin_cycle(self, percepts: Percepts) -> list[Message]:
        graph = self._ledger.graph
        self._waiting = None
        before_ns = self._begun_ns
        self._begun_ns = percepts.stamp_ns
        moved_ns = self._moved_until_ns
        motions = self._sensed.motions(percepts.stamp_ns, moved_ns)
        entered, waiting = self._individuals.labelled(percepts, motions)
        context = self._sensed.context(entered, moved_ns, graph.cycle + 1, graph.version)
        self._context = replace(context, waiting=waiting)
        self._delay.begin(percepts.stamp_ns, self._now_ns)
        self._phase = -1
        self._is_repeated = False

        entering = first_operations(graph, self._config)
        conscious = self._consciousness.take(graph.cycle)
        entering += learned_operations(conscious, graph, self._context.cycle)
        entering += first_goals(self._config, before_ns, self._begun_ns)
        entering += percept_operations(graph, self._context)
        entering += self._sensed.needs(percepts.stamp_ns, self._context.cycle)
        entering += self._offers.take(self._ledger, entering, self._context.cycle)
        return [self._commit(Phase.PERCEPTS, entering), *self._next_phase()]

    def _commit(
        self, phase: Phase, operations: list[Operation], tasks: list[str] | None = None
    ) -> Delta:
        if self._context is None:
            raise MessageError("nothing is committed between cycles")

        delta = self._ledger.commit(
            self._context.stamp_ns, self._context.cycle, phase, operations, tasks
        )
        self._note(delta)
        return delta

    def _note(self, delta: Delta) -> None:
        """Keep up with what a commit has changed."""
        self._forgetting.note(delta, self._ledger.graph)
        self._individuals.known.note(delta)

    def _next_phase(self) -> list[Message]:
        """Give out the next phase's tasks; after the last, end the cycle."""
        self._phase += 1
        if self._context is None or self._phase == len(PHASES):
            return self._end()

        phase = PHASES[self._phase]
        graph = self._ledger.graph
        context = replace(self._context, version=graph.version)
        self._context = context
        beside: list[Message] = []
        if phase is LANES_BEGIN:
            beside = self._lanes.begin(context, self._ledger, self._now_ns)

        tasks = []
        for codelet in self._codelets:
            if codelet.codelet.phase is phase:
                tasks += codelet.due(context, graph)

        self._delay.ask(phase, [task.task_id for task in tasks], self._now_ns)
        self._dispatch.lease_ns = self._delay.lease_ns
        published = self._dispatch.begin(tasks, self._now_ns)
        return self._continue_if_complete([*published, *beside])

    def _continue_if_complete(self, published: list[Message]) -> list[Message]:
        """Add the next phase to `published`, if no answer is waited for in this one."""
        if self._context is None or self._awaits_answers:
            return published
        return [*published, *self._commit_answers(), *self._next_phase()]

    def _commit_answers(self) -> list[Message]:
        """Commit the answers of the current phase; unanswered tasks may be answered later."""
        self._reject_failed(self._dispatch.failed)
        answers, unanswered = self._dispatch.collect()
        self._late_tasks.put(unanswered)
        return self._commit_proposals(PHASES[self._phase], answers)

    def _commit_proposals(self, phase: Phase, proposals: list[Proposal]) -> list[Message]:
        """Commit valid proposals, then publish their events.

        Coalitions, of ATTENTION, are published before the commit, in which their codelets keep that
        they have brought them: a restart between the two brings them again.
        """
        if self._context is None:
            return []

        valid = self._ledger.validate(proposals)
        operations: list[Operation] = []
        for proposal in valid:
            operations += proposal.operations

        published: list[Message] = []
        if phase is Phase.ATTENTION:
            published.append(coalitions_of(self._context, valid))
        if operations:
            tasks = [proposal.task_id for proposal in valid]
            published.append(self._commit(phase, operations, tasks))

        for proposal in valid:
            published += proposal.events
        return published

    def _end(self, *, is_cut: bool = False) -> list[Message]:
        """Commit what lanes have answered, forget what has decayed, and begin the next cycle. The
        cycle `is_cut` if answers of it had not come.
        """
        context = self._context
        if context is None:
            return []

        self._delay.end(self._now_ns, context.stamp_ns, is_cut=is_cut)
        published: list[Message] = []
        for answers, failed in self._lanes.collect(context.cycle):
            self._reject_failed(failed)
            published += self._commit_proposals(Phase.BACKGROUND, answers)

        published.append(self._commit(Phase.END, [*self._forgetting.due(self._ledger.graph)]))
        self._sensed.discard(self._moved_until_ns)
        self._context = None
        return [*published, *self._begin()]

    def _reject_failed(self, tasks: list[str]) -> None:
        for name in tasks:
            self._ledger.reject(
                f"task {name} was given to {MAX_ATTEMPTS} workers and lost each time"
            )
