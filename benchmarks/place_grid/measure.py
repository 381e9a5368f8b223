"""The metrics of place_grid: a map of half a million place nodes, and a change of one tile."""

from __future__ import annotations

import statistics
import time
import tracemalloc

import numpy as np

from benchmarks.benchmark import Setting
from benchmarks.map_size.maps import Size, cognitive_map
from benchmarks.report import Metrics
from benchmarks.threshold import at_most
from cogmap.bus.codec import decode, encode
from cogmap.graph.graph import Graph
from cogmap.schemas import topics
from cogmap.schemas.array import Array
from cogmap.schemas.codelets import Proposal
from cogmap.schemas.graph import Cells, Delta, Operation, Phase, Snapshot
from cogmap.schemas.nodes import TILE_SIDE, PlaceColumn
from cogmap.services.workspace.public import Ledger

THRESHOLDS = {
    "nodes_500k_commit_ms": at_most(5.0),
    "bytes_per_node": at_most(64.0),
}
SIZE = Size(objects=0, places=500_000)
CHANGES = 200
CODELET = "boundary"
TILE = (3, -4)


def measure(setting: Setting) -> Metrics:
    """Measure a change of a tile on a map of 500,000 place nodes, and what these take in a replica.

    The change writes every column of every cell of the tile: it is validated, committed and encoded
    as the workspace does it, and decoded and applied as a replica does. Takes a few seconds.
    """
    setting.announce(f"making a map of {SIZE.places} place nodes")
    snapshot = decode(topics.SNAPSHOT, encode(cognitive_map(SIZE)))
    assert isinstance(snapshot, Snapshot)
    tracemalloc.start()
    try:
        before, _ = tracemalloc.get_traced_memory()
        replica = Graph()
        replica.load(snapshot)
        after, _ = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()

    bytes_per_node = (after - before) / (len(replica.places.tiles) * TILE_SIDE**2)
    ledger = Ledger({CODELET: lambda written: True})
    ledger.restore(snapshot)

    setting.announce(f"committing {CHANGES} changes of a tile")
    rng = np.random.default_rng(SIZE.places)
    commit_ms = []
    apply_ms = []
    delta_bytes = 0
    for number in range(CHANGES):
        proposal = _proposal(number, ledger.graph.version, rng)
        began_s = time.perf_counter()
        (valid,) = ledger.validate([proposal])
        payload = encode(ledger.commit(0, 1, Phase.OBJECTS, valid.operations, [valid.task_id]))
        committed_s = time.perf_counter()
        delta = decode(topics.DELTA, payload)
        assert isinstance(delta, Delta)
        replica.apply(delta)
        applied_s = time.perf_counter()

        commit_ms.append(1e3 * (committed_s - began_s))
        apply_ms.append(1e3 * (applied_s - committed_s))
        delta_bytes = len(payload)

    both_ms = np.add(commit_ms, apply_ms)
    return {
        "nodes_500k_commit_ms": float(np.median(both_ms)),
        "bytes_per_node": bytes_per_node,
        "workspace_ms": statistics.median(commit_ms),
        "replica_ms": statistics.median(apply_ms),
        "commit_ms_p99": float(np.percentile(both_ms, 99)),
        "tile_delta_bytes": float(delta_bytes),
    }


def _proposal(number: int, base_version: int, rng: np.random.Generator) -> Proposal:
    """Make a proposal of new values of every column of every cell of a tile."""
    inside = np.argwhere(np.ones((TILE_SIDE, TILE_SIDE), bool))
    cells = inside + np.array(TILE) * TILE_SIDE

    operations: list[Operation] = []
    for column in PlaceColumn:
        values = rng.random(len(cells), np.float32)
        operation = Cells(
            column=column,
            cells=Array.of(cells, "<i4"),
            values=Array.of(values),
            cycle=number,
        )
        operations.append(operation)

    return Proposal(
        task_id=f"{number}/{CODELET}",
        codelet=CODELET,
        base_version=base_version,
        operations=operations,
    )
