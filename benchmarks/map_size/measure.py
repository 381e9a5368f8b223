"""The metrics of map_size: a large map against a small one, in one run."""

from __future__ import annotations

from benchmarks.benchmark import Setting
from benchmarks.map_size import cycles, join
from benchmarks.map_size.maps import LARGE, SMALL, cognitive_map
from benchmarks.report import Metrics
from benchmarks.threshold import at_most

THRESHOLDS = {
    "cycle_ratio": at_most(1.3),
    "delta_bytes_ratio": at_most(1.3),
    "task_bytes_p99": at_most(65536),
    "join_s": at_most(3.0),
    "memory_mb": at_most(300.0),
}
REPEATS = 3


def measure(setting: Setting) -> Metrics:
    """Measure the cycle, its deltas and tasks, a late worker and a replica, on a map of 100,000
    objects.

    The cognitive modules run on the in-memory bus with percept-level sensing, once on a map of 100
    objects and 1,000 place nodes, once on one of 100,000 and 500,000. A worker of its own process
    then joins over Zenoh. Takes about two minutes.
    """
    announce = setting.announce
    announce(f"making maps of {SMALL.objects} and of {LARGE.objects} objects")
    small_map = cognitive_map(SMALL)
    large_map = cognitive_map(LARGE)

    # The slowest of several workers counts: each must join in time.
    announce("a worker joins")
    joined = max(join.join(large_map) for _ in range(REPEATS))
    memory_mb = join.replica_memory_mb(large_map)

    # The least time of several drives, in turn, counts: other jobs of the machine only add to it.
    small = []
    large = []
    for number in range(1, REPEATS + 1):
        announce(f"cycles on both maps, {number} of {REPEATS}")
        small.append(cycles.drive(small_map))
        large.append(cycles.drive(large_map))

    small_s = min(each.mean_cpu_s for each in small)
    large_s = min(each.mean_cpu_s for each in large)
    # Repeats differ in their times alone.
    small_bytes = small[0].mean_delta_bytes
    large_bytes = large[0].mean_delta_bytes

    return {
        "cycle_ratio": large_s / small_s,
        "delta_bytes_ratio": large_bytes / small_bytes,
        "task_bytes_p99": large[0].task_bytes_p99,
        "cycle_cpu_ms": 1e3 * large_s,
        "cycle_cpu_small_ms": 1e3 * small_s,
        "delta_bytes": large_bytes,
        "join_s": joined.join_s,
        "memory_mb": memory_mb,
        "worker_memory_mb": joined.worker_memory_mb,
    }
