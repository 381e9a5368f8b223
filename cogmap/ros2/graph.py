"""Which topics a robot publishes, and which of them are its senses. Pure."""

from __future__ import annotations

from typing import Any, NamedTuple

from cogmap.data.bags.topics import (
    LASER_SCAN,
    Topics,
    camera_info,
    has_pair,
    odometry_of,
    pair_of_topics,
    scans_of,
    set_pair,
)
from cogmap.errors import UsageError
from cogmap.ros2.rmw.keys import End, Seen

SETTLED_NS = 1_000_000_000
"""Time without a change after which a robot counts as started."""


class RosGraph:
    """The publishers and subscriptions there are, as nodes announce them. It has topics as a bag
    does.
    """

    def __init__(self) -> None:
        self._ends: dict[str, Seen] = {}

    def update(self, seen: Seen, is_there: bool) -> None:
        """Take account of an end that came, or went."""
        if is_there:
            self._ends[seen.token] = seen
        else:
            self._ends.pop(seen.token, None)

    @property
    def topics(self) -> dict[str, str]:
        """Return the types of what is published, by topic."""
        return {each.stream.topic: each.stream.kind for each in self._of(End.PUBLISHER)}

    def subscribed(self, topic: str) -> list[Seen]:
        """Return the subscriptions of a topic."""
        return [each for each in self._of(End.SUBSCRIPTION) if each.stream.topic == topic]

    def of_kind(self, *kinds: str) -> list[str]:
        """Return the topics of these types, in order of their names."""
        return sorted(name for name, kind in self.topics.items() if kind in kinds)

    def first(self, topic: str) -> Any:
        """Raise UsageError: nothing is received before topics are chosen by their names."""
        what = "has no two topics of images that differ in left and right"
        raise self.wrong(what, set_pair(self))

    def setting(self, name: str) -> str:
        """Return the option by which a user gives a topic, such as that of the `left` images."""
        return f"--{name}-topic TOPIC"

    def wrong(self, what: str, remedy: str) -> UsageError:
        """Make the error for a robot of which something is not as it must be."""
        listed = [f"{name} ({kind})" for name, kind in sorted(self.topics.items())]
        return UsageError(f"the robot {what}; it has {', '.join(listed) or 'nothing'}: {remedy}")

    def _of(self, end: End) -> list[Seen]:
        return [each for each in self._ends.values() if each.end is end]


class Chosen(NamedTuple):
    """The topics of a robot's senses: images and what describes the cameras, left and right, or
    scans; and odometry. Empty where there are none.
    """

    images: tuple[str, str] = ("", "")
    infos: tuple[str, str] = ("", "")
    odometry: str = ""
    scan: str = ""


def chosen(graph: RosGraph, given: Topics, odometry_kind: str) -> Chosen:
    """Choose the topics of a robot's senses: those that are given, else those that can be meant.

    Odometry is of type `odometry_kind`, empty if there is none. Raises UsageError if there is
    neither a pair of cameras with their calibration nor a laser, if odometry is missing, or if
    several can be meant.
    """
    odometry = ""
    if odometry_kind:
        odometry = odometry_of(graph, given.odometry, odometry_kind)
    if odometry_kind and not odometry:
        raise graph.wrong(
            f"publishes no {odometry_kind}",
            "start what does, or leave it out by --no-odometry: views tell the motion then",
        )
    if (given.scan or graph.of_kind(LASER_SCAN)) and not has_pair(graph, given):
        if not odometry:
            raise graph.wrong("has laser scans, and no odometry", "leave --no-odometry out")
        return Chosen(odometry=odometry, scan=scans_of(graph, given.scan))

    left, right = pair_of_topics(graph, given)
    infos = camera_info(graph, left), camera_info(graph, right)
    return Chosen((left, right), infos, odometry)
