"""Makes one module do what it did in a log, and compares what it publishes."""

from __future__ import annotations

from cogmap.bus.codec import encode
from cogmap.errors import LogError, MessageError
from cogmap.recording.replaying import compare
from cogmap.recording.replaying.logged_graph import LoggedGraph
from cogmap.recording.replaying.outcome import Outcome
from cogmap.recording.replaying.plan import Job, Kind, Step
from cogmap.recording.storage.reader import LogReader, Record
from cogmap.runtime.module import Module
from cogmap.schemas import topics
from cogmap.schemas.base import Message
from cogmap.schemas.graph import Delta

SIDES = ("the log", "the replay")


class ModuleRun:
    """`module` on its way through `job`, whose messages `reader` holds."""

    def __init__(self, reader: LogReader, job: Job, module: Module) -> None:
        self._reader = reader
        self._job = job
        self._module = module
        self._logged_graph = LoggedGraph(reader)
        self._untimed = 0
        self._refusals: list[str] = []
        self._published: dict[str, set[int]] = {name: set() for name in job.expected}
        self.outcome = Outcome(
            module=job.module,
            instance=job.instance,
            incarnation=job.number,
            missing_inputs=dict(job.missing),
        )

    def replay(self) -> Outcome:
        """Do every step, compare every output, and count those that are missing.

        Raises LogError if the log lacks deltas of the graph that the module follows.
        """
        # The module begins with the journal that it had when it was started.
        restore = self._module.restore
        past = [one for one in self._job.earlier if one.topic is self._module.journal]
        if past and restore is not None:
            restore(self._reader.message(record) for record in past)

        for step in self._job.steps:
            for message in self._do(step):
                self._compare(message)

        # The outputs that are in the log alone.
        missing: list[Record] = []
        for name, expected in self._job.expected.items():
            published = self._published[name]
            missing += [record for seq, record in expected.items() if seq not in published]

        self.outcome.missing_outputs = len(missing)
        if missing and not self.outcome.first:
            first = min(missing, key=lambda one: (one.log_time_ns, one.channel, one.sequence))
            title = compare.title(first.topic, self._reader.message(first))
            log, replay = SIDES
            self._differ(f"{title} is in {log} and not published in {replay}")

        self.outcome.notes += self._notes()
        return self.outcome

    def _do(self, step: Step) -> list[Message]:
        """Return what the module publishes at a step. An exception is a difference: then it had
        none.
        """
        try:
            if step.record is not None:
                return self._feed(step.record)
            if step.kind is Kind.SNAPSHOT:
                graph = self._module.graph
                if graph is None:
                    raise MessageError("it does not follow the graph")
                graph.load(self._logged_graph.at(step.version, step.at_ns))
                return self._module.loaded()
            if step.kind is Kind.START:
                start = self._module.start
                return [] if start is None else self._module.stamp(start())

            timers = self._module.timers
            if len(timers) == 1:
                return self._module.stamp(timers[0].handler(step.at_ns))
            self._untimed += 1
            return []
        except LogError:
            raise
        except Exception as error:
            name = step.kind.name.lower() if step.record is None else step.record.topic.name
            reason = f"{type(error).__name__}: {error}"
            refusal = f"{name}: {self._job.instance} refuses what it received: {reason}"
            if self._job.exact:
                self._differ(refusal)
            else:
                self._refusals.append(refusal)
            return []

    def _feed(self, record: Record) -> list[Message]:
        """Feed a message. Raises LogError if the module's graph lacks deltas before this one."""
        if record.topic not in self._module.handlers:
            if self._job.exact:
                raise MessageError("it does not handle this topic")
            return []

        self.outcome.fed += 1
        message = self._reader.message(record)
        published = self._module.feed(message)
        graph = self._module.graph
        if isinstance(message, Delta) and graph is not None and graph.version < message.version:
            raise LogError(
                f"{self._reader.path}: {self._job.instance} follows the graph, and the log lacks "
                f"the deltas {graph.version + 1} to {message.version - 1}: "
                f"record from the start of the workspace"
            )
        return published

    def _compare(self, message: Message) -> None:
        """Compare what was published with the message of that number in the log."""
        topic = topics.of(message)
        expected = self._job.expected.get(topic.name)
        if expected is None:
            return

        self._published[topic.name].add(message.seq)
        record = expected.get(message.seq)
        if record is None:
            self.outcome.extra_outputs += message.seq < max(expected)
            return

        payload = encode(message)
        recorded = self._reader.payload(record)
        if payload == recorded:
            self.outcome.same += 1
            return
        self.outcome.different += 1
        if not self.outcome.first:
            self._differ(compare.describe(topic, recorded, payload, SIDES))

    def _notes(self) -> list[str]:
        """Return what else is to be known before the outcome is judged."""
        notes = []
        if self.outcome.missing_inputs:
            missing = sorted(self.outcome.missing_inputs.items())
            listed = ", ".join(f"{number} of {name}" for name, number in missing)
            notes.append(f"inputs that the log lacks: {listed}")
        if self.outcome.extra_outputs:
            notes.append(f"{self.outcome.extra_outputs} outputs that the log lacks")
        if not self._job.exact:
            notes.append("the log has no envelopes: inputs were fed in the order of the log")
        if self._refusals:
            notes.append(f"{len(self._refusals)} inputs refused, the first: {self._refusals[0]}")
        if self._untimed:
            timers = len(self._module.timers)
            notes.append(
                f"{self._untimed} calls of a timer left out: the module has {timers} timers"
            )
        expected = self._job.expected
        late = sorted(name for name in expected if self._job.exact and min(expected[name]) > 0)
        if late:
            notes.append(
                f"the log begins after the module did: "
                f"its first of {', '.join(late)} is not number 0"
            )
        return notes

    def _differ(self, sentence: str) -> None:
        if not self.outcome.first:
            self.outcome.first = sentence
