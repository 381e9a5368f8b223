"""Attention codelets: they bring salient content of the workspace to the global workspace as
coalitions.
"""

from __future__ import annotations

from schemas.base import Scalar
from schemas.cognition import Coalition, Coalitions, Task
from schemas.graph import Node
from services.codelets.config import Config

NOVEL_SIGHTINGS = 5


def coalition_activation(content: list[Node], base_level: float) -> float:
    """base-level x sum(total activation + |incentive salience|) / 2n, as in LIDA's framework."""
    total = sum(
        min(1.0, node.base_level + node.activation)
        + abs(float(node.attributes.get("salience", 0.0)))
        for node in content
    )
    return min(1.0, base_level * total / (2 * len(content)))


def attend(task: Task, config: Config) -> Coalitions:
    """What two attention codelets find: where the agent is among what it sees, and what is new to
    it.
    """
    own = [_copy(node) for node in task.nodes if node.kind == "self"]
    objects = [_copy(node) for node in task.nodes if node.kind == "object"]
    novel = [
        _salient(node)
        for node in objects
        if int(node.attributes.get("sightings", 0)) <= NOVEL_SIGHTINGS
    ]
    found = {"whereabouts": own + objects, "novelty": own + novel if novel else []}
    return Coalitions(
        stamp_ns=task.stamp_ns,
        cycle=task.cycle,
        coalitions=[
            Coalition(
                codelet=name,
                activation=coalition_activation(content, config.attention_base_level),
                content=content,
            )
            for name, content in found.items()
            if content
        ],
    )


def _copy(node: Node, **more: Scalar) -> Node:
    """The node with `more` attributes and without samples, which nobody needs to be conscious of."""
    attributes = node.attributes | more
    return Node(
        id=node.id,
        kind=node.kind,
        activation=node.activation,
        base_level=node.base_level,
        attributes=attributes,
    )


def _salient(node: Node) -> Node:
    """A new object is salient in proportion to how little it has been seen."""
    sightings = int(node.attributes.get("sightings", 0))
    return _copy(node, salience=1.0 - sightings / (NOVEL_SIGHTINGS + 1))
