"""Examples of tasks, leases, proposals and offers."""

from __future__ import annotations

from cogmap.schemas.base import Message
from cogmap.schemas.codelets import Assignment, Leases, Offer, Proposal, Task
from cogmap.schemas.examples import cognition, graph, nodes, sensing
from cogmap.schemas.examples.arrays import ramp


def proposal() -> Proposal:
    """A codelet's answer, with all that one may hold."""
    return Proposal(
        task_id="6/localization",
        codelet="localization",
        base_version=41,
        operations=graph.operations(),
        coalitions=[cognition.coalition()],
        events=[cognition.replay(), cognition.route_replay()],
        failure="too few samples",
    )


def messages() -> list[Message]:
    """A task, the leases of tasks, and an offer."""
    assignment = Assignment(
        task_id="6/localization",
        worker="codelets-2",
        attempt=1,
        version=41,
    )
    return [
        _task(),
        Leases(assignments=[assignment]),
        Offer(cycle=5, operations=[nodes.unknown_kind()]),
    ]


def _task() -> Task:
    return Task(
        task_id="6/localization",
        codelet="localization",
        cycle=6,
        version=41,
        about=["self"],
        percepts=[sensing.percept()],
        matches=[sensing.place_match()],
        motions=ramp(4, 3, dtype="<f8"),
        road_m=ramp(3, 2, dtype="<f4"),
        road_boundary_m=ramp(2, 2, dtype="<f4"),
        scan=ramp(4, 2, dtype="<f4"),
    )
