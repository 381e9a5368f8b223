"""All that is sensed beside percepts, kept until the cycle of its view needs it."""

from __future__ import annotations

from cogmap.runtime.codelet import CycleContext
from cogmap.runtime.run import Run
from cogmap.schemas.array import Array
from cogmap.schemas.nodes import Need
from cogmap.schemas.sensing import Energy, Percepts, RangeScan, SelfMotion
from cogmap.services.workspace.body import Body
from cogmap.services.workspace.config import Config
from cogmap.services.workspace.senses import Scans, SelfMotions


class Sensed:
    """Self-motion, range scans, and what the body senses of itself. `moved_ns` is the time until
    when self-motion has moved the self node.
    """

    def __init__(self, config: Config, run: Run) -> None:
        self._motions = SelfMotions()
        self._scans = Scans(config, run)
        self._body = Body(run)

    def put_motion(self, motion: SelfMotion, moved_ns: int) -> None:
        """Keep self-motion. Raises MessageError where its rows are of another shape or dtype."""
        self._motions.put(motion, moved_ns)

    def put_scan(self, scan: RangeScan) -> None:
        """Keep a range scan. Raises MessageError where it is none, or too late."""
        self._scans.put(scan)

    def put_energy(self, energy: Energy) -> None:
        """Keep the body's energy."""
        self._body.put(energy)

    def is_complete(self, stamp_ns: int, moved_ns: int) -> bool:
        """Whether all that the cycle of the view at `stamp_ns` waits for has come."""
        has_motion = max(self._motions.newest_ns(), moved_ns) >= stamp_ns
        return has_motion and self._scans.has(stamp_ns) and self._body.has(stamp_ns)

    def motions(self, stamp_ns: int, moved_ns: int) -> Array:
        """The motions since the self node was moved last, up to `stamp_ns`."""
        return self._motions.rows(moved_ns, stamp_ns)

    def needs(self, stamp_ns: int, cycle: int) -> list[Need]:
        """The body's needs at the view at `stamp_ns`."""
        return self._body.needs(stamp_ns, cycle)

    def context(self, percepts: Percepts, motions: Array, cycle: int, version: int) -> CycleContext:
        """All that was sensed for the view of `percepts`, of which the scan is taken now."""
        scan = self._scans.take(percepts.stamp_ns)
        return CycleContext(cycle, percepts, motions, version, scan)

    def discard(self, moved_ns: int) -> None:
        """Discard what has moved the self node."""
        self._motions.discard(moved_ns)
