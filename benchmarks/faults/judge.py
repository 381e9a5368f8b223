"""What a drive under attack has lost: compares what was seen with what is left."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import NamedTuple

from benchmarks.faults.attack import JOURNAL, Attacked, Kill
from benchmarks.faults.parts import RECORDER
from benchmarks.faults.witness import WATCHED, Identity, identity
from cogmap.bus.codec import decode, encode
from cogmap.cli.launch.plan import MEMORY_NAME
from cogmap.errors import LogError
from cogmap.graph.graph import Graph
from cogmap.recording.storage.reader import LogReader
from cogmap.runtime.state.journal import Journal
from cogmap.runtime.state.store import Store
from cogmap.schemas import topics
from cogmap.schemas.graph import Delta

AROUND_NS = 2_000_000_000
"""What is missing so close to a recorder's absence is due to that."""


class Lost(NamedTuple):
    """What a drive has lost of `deltas` and `records`.

    Of deltas: those that the workspace's journal and graph lack, and those that no log holds.
    `wrong_graphs` counts the graphs, as followed and as in the logs, that differ from the
    workspace's; `unlogged` are the messages that no log holds, by topic, and `unsaid` how many of
    them the summary does not state. `log_loss_s` is the longest time of which a recorder's death
    left something out of the logs.
    """

    deltas: int
    records: int
    lost_deltas_graph: int
    lost_deltas_log: int
    lost_records: int
    wrong_graphs: int
    unlogged: Counter[str]
    unsaid: int
    log_loss_s: float


class Logged:
    """What the logs of a drive hold, all together: which messages, and the deltas by version."""

    def __init__(self, paths: list[Path]) -> None:
        self.messages: set[Identity] = set()
        self.deltas: dict[int, bytes] = {}
        for path in paths:
            self._read(path)

    def _read(self, path: Path) -> None:
        try:
            reader = LogReader(path)
        except LogError:
            return  # nothing had been written

        for record in reader.records(WATCHED):
            if record.envelope is not None:
                self.messages.add(identity(record.topic, record.envelope))
            if record.topic is topics.DELTA:
                payload = reader.payload(record)
                self.deltas[_delta(payload).version] = payload


def judged(attacked: Attacked) -> Lost:
    """Compare all that was seen in a drive with what is left of it."""
    seen = attacked.seen
    logged = Logged(attacked.logs)
    journal_path = attacked.folder.parent / JOURNAL
    journaled, oldest = _journaled(journal_path)

    acknowledged = seen.deltas | journaled
    not_kept = [
        version
        for version, payload in seen.deltas.items()
        if version >= oldest and journaled.get(version) != payload
    ]
    not_logged = acknowledged.keys() - logged.deltas.keys()

    missing = seen.received_ns.keys() - logged.messages
    unlogged = Counter(name for name, *_ in missing)
    said = Counter(_said(attacked))
    return Lost(
        deltas=len(acknowledged),
        records=sum(len(stored.records) for stored in seen.stored),
        lost_deltas_graph=len(not_kept),
        lost_deltas_log=len(not_logged),
        lost_records=_lost_records(attacked),
        wrong_graphs=_wrong_graphs(attacked, logged),
        unlogged=unlogged,
        unsaid=(unlogged - said).total(),
        log_loss_s=max(_log_losses_s(attacked, missing), default=0.0),
    )


def _delta(payload: bytes) -> Delta:
    delta = decode(topics.DELTA, payload)
    assert isinstance(delta, Delta)
    return delta


def _journaled(path: Path) -> tuple[dict[int, bytes], int]:
    """Return the deltas in a workspace's journal by version, and the first version that it must
    hold: those before are in its snapshot.
    """
    found: dict[int, bytes] = {}
    oldest = 1
    if not path.is_file():
        return found, oldest

    with closing(Journal(path)) as journal:
        for message in journal.messages():
            if isinstance(message, Delta):
                found[message.version] = encode(message)
            else:
                oldest = message.version + 1  # type: ignore[attr-defined]
    return found, oldest


def _said(attacked: Attacked) -> dict[str, int]:
    """Return how many messages of each topic are in no log, as the drive's summary states."""
    log = attacked.summary.get("log") or {}
    said: dict[str, int] = log.get("lost", {})
    return said


def _wrong_graphs(attacked: Attacked, logged: Logged) -> int:
    """Count the graphs that differ from the workspace's in the end; it has one that answers."""
    wrong = int(attacked.followed_digest != attacked.graph_digest)
    graph = Graph()
    for version in range(1, attacked.graph_version + 1):
        payload = logged.deltas.get(version)
        if payload is None:
            break  # counted as a delta that was lost
        graph.apply(_delta(payload))
    else:
        wrong += graph.digest() != attacked.graph_digest

    return wrong


def _lost_records(attacked: Attacked) -> int:
    """Count the records that long-term memory had stored and its database does not hold."""
    expected: dict[str, bytes] = {}
    for stored in attacked.seen.stored:
        expected |= {record.key: encode(record) for record in stored.records}
        for key in stored.forgotten:
            expected.pop(key, None)

    path = attacked.folder / MEMORY_NAME
    if not expected or not path.is_file():
        return len(expected)
    with closing(Store(path)) as store:
        held = {record.key: encode(record) for record in store.restored().records}
    return sum(held.get(key) != payload for key, payload in expected.items())


def _log_losses_s(attacked: Attacked, missing: set[Identity]) -> Iterator[float]:
    """Yield the time between the first and the last message that is in no log, for each death of
    the recorder that left one out.
    """
    received_ns = sorted(attacked.seen.received_ns[each] for each in missing)
    for death in attacked.kills:
        if death.part != RECORDER:
            continue
        lost_ns = [each for each in received_ns if _is_around(death, each)]
        if lost_ns:
            yield (lost_ns[-1] - lost_ns[0]) / 1e9


def _is_around(death: Kill, received_ns: int) -> bool:
    return death.at_ns - AROUND_NS <= received_ns <= death.returned_ns + AROUND_NS
