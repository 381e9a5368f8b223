"""How the campaign that kills processes counts what that loses."""

from __future__ import annotations

import json
import math
from itertools import islice
from pathlib import Path
from random import Random

import pytest

from benchmarks.faults.attack import FOLDER, JOURNAL, Attacked, Kill
from benchmarks.faults.cuts import messages_in, recovered_share
from benchmarks.faults.judge import judged
from benchmarks.faults.measure import in_turn, p95_s
from benchmarks.faults.parts import RECORDER
from benchmarks.faults.witness import Seen, identity
from cogmap.bus.codec import Envelope, encode
from cogmap.cli.launch.watchdog import STALLED_S
from cogmap.graph.graph import Graph
from cogmap.recording.storage.writer import LogWriter
from cogmap.runtime.state.journal import Journal
from cogmap.schemas import topics
from cogmap.schemas.graph import Delta, Phase
from cogmap.schemas.nodes import Node

VERSIONS = range(1, 7)
PERIOD_NS = 500_000_000


def _delta(version: int, name: str = "") -> Delta:
    node = Node(id=name or f"node-{version}", kind="thing")
    return Delta(version=version, cycle=version, phase=Phase.END, operations=[node], seq=version)


class Drive:
    """What is left of a drive in which one delta came after the other, PERIOD_NS apart."""

    def __init__(self, folder: Path) -> None:
        self.attacked = Attacked(folder / FOLDER, is_lockstep=True, seen=Seen())
        self._folder = folder
        (folder / FOLDER).mkdir()
        graph = Graph()
        for version in VERSIONS:
            delta = _delta(version)
            graph.apply(delta)
            envelope = self._envelope(version)
            self.attacked.seen.deltas[version] = encode(delta)
            received_ns = self.attacked.seen.received_ns
            received_ns[identity(topics.DELTA, envelope)] = version * PERIOD_NS

        self.attacked.graph_digest = graph.digest()
        self.attacked.graph_version = graph.version
        self.attacked.followed_digest = graph.digest()

    def keep(self, *deltas: Delta) -> None:
        """Write the workspace's journal."""
        journal = Journal(self._folder / JOURNAL)
        for delta in deltas:
            journal.append(delta, encode(delta))
        journal.close()

    def record(self, *versions: int, name: str = "log.mcap") -> None:
        """Write a log."""
        path = self.attacked.folder / name
        writer = LogWriter(path, [topics.DELTA], {"agent": "a", "began_ns": "0"})
        for version in versions:
            payload = encode(_delta(version))
            writer.write(topics.DELTA, payload, self._envelope(version), version * PERIOD_NS)
        writer.close()

    def say(self, **lost: int) -> None:
        """Write the summary."""
        named = {name.replace("_", "/"): number for name, number in lost.items()}
        text = json.dumps({"log": {"lost": named}})
        (self.attacked.folder / "summary.json").write_text(text)

    @staticmethod
    def _envelope(version: int) -> Envelope:
        return Envelope("workspace", version, 1, version, version)


@pytest.fixture
def drive(tmp_path: Path) -> Drive:
    return Drive(tmp_path)


def test_a_drive_that_kept_and_recorded_all_has_lost_nothing(drive: Drive) -> None:
    drive.keep(*map(_delta, VERSIONS))
    drive.record(1, 2, 3)
    drive.record(4, 5, 6, name="log-2.mcap")

    lost = judged(drive.attacked)

    assert lost.deltas == len(VERSIONS)
    assert (lost.lost_deltas_graph, lost.lost_deltas_log) == (0, 0)
    assert (lost.wrong_graphs, lost.unlogged.total(), lost.log_loss_s) == (0, 0, 0.0)


def test_a_delta_that_the_journal_has_otherwise_or_not_at_all_is_lost(drive: Drive) -> None:
    drive.keep(*map(_delta, (1, 2, 3, 4)), _delta(5, "another"))
    drive.record(*VERSIONS)

    assert judged(drive.attacked).lost_deltas_graph == 2


def test_a_graph_that_differs_is_counted_as_followed_and_as_logged(drive: Drive) -> None:
    drive.keep(*map(_delta, VERSIONS))
    drive.record(*VERSIONS)
    drive.attacked.graph_digest = "another"

    assert judged(drive.attacked).wrong_graphs == 2


def test_what_no_log_holds_is_lost_and_unsaid_unless_the_summary_states_it(drive: Drive) -> None:
    drive.keep(*map(_delta, VERSIONS))
    drive.record(1, 2)
    drive.record(6, name="log-2.mcap")
    drive.attacked.kills.append(Kill(RECORDER, 3 * PERIOD_NS, 5 * PERIOD_NS, 0.1))

    lost = judged(drive.attacked)
    assert lost.lost_deltas_log == 3
    assert lost.unsaid == 3
    assert lost.log_loss_s == pytest.approx(1.0)

    drive.say(workspace_delta=2)
    assert judged(drive.attacked).unsaid == 1


def test_all_that_is_whole_in_a_cut_log_is_recovered(drive: Drive, tmp_path: Path) -> None:
    drive.record(*VERSIONS)
    (path,) = drive.attacked.logs

    assert messages_in(path).total() == 2 * len(VERSIONS)  # each with its envelope
    assert recovered_share(path, 5, Random(1), tmp_path) == 1.0


def test_each_part_has_its_turn_before_another_has_a_second() -> None:
    turns = list(islice(in_turn(("a", "b", "c"), Random(1)), 9))

    for round_begins in (0, 3, 6):
        assert sorted(turns[round_begins : round_begins + 3]) == ["a", "b", "c"]


def test_a_kill_that_stalled_the_drive_counts_as_its_bound() -> None:
    quick = [Kill("motor", 0, 1, 0.5)] * 3

    assert p95_s(quick) == 0.5
    assert p95_s([Kill("motor", 0, 1, math.inf)]) == STALLED_S
