"""Key expressions of rmw_zenoh: those of data, and the liveliness tokens that make up the graph.

https://github.com/ros2/rmw_zenoh/blob/rolling/docs/design.md
"""

from __future__ import annotations

import enum
from typing import NamedTuple

TOKENS = "@ros2_lv"
NODE = "NN"
MAX_DOMAIN = 232
"""The greatest number of a domain that every middleware of ROS 2 takes."""


class End(enum.StrEnum):
    """What a token announces: a publisher, or a subscription."""

    PUBLISHER = "MP"
    SUBSCRIPTION = "MS"


class Quality(NamedTuple):
    """Quality of service: whether all messages are to come, whether a late subscription gets the
    last `depth` ones, and how many a subscription keeps that was not served yet.
    """

    is_reliable: bool = True
    is_latched: bool = False
    depth: int = 10

    @property
    def encoded(self) -> str:
        """Return it as in a token: what is the default of ROS is left out."""
        reliability = "" if self.is_reliable else "2"
        durability = "1" if self.is_latched else ""
        return f"{reliability}:{durability}:,{self.depth}:,:,:,,"


USUAL = Quality()
LATCHED = Quality(is_latched=True, depth=1)
SENSOR = Quality(is_reliable=False, depth=5)


class Node(NamedTuple):
    """A node: its domain, the id of its Zenoh session, its number there, namespace and name."""

    domain: int
    session: str
    number: int
    namespace: str
    name: str

    @property
    def token(self) -> str:
        """Return the key of the token that announces it."""
        return f"{self._begin(self.number)}/{NODE}/{self._end}"

    def token_of(self, number: int, end: End, stream: Stream, quality: Quality) -> str:
        """Return the key of the token that announces an end of a stream, which has a number."""
        name = _mangled(stream.topic)
        types = f"{dds_name(stream.kind)}/{stream.type_hash}"
        return f"{self._begin(number)}/{end}/{self._end}/{name}/{types}/{quality.encoded}"

    def _begin(self, number: int) -> str:
        return f"{TOKENS}/{self.domain}/{self.session}/{self.number}/{number}"

    @property
    def _end(self) -> str:
        """Return what follows the kind: the enclave, of which there is none, and the name."""
        return f"{_mangled('')}/{_mangled(self.namespace.rstrip('/'))}/{_mangled(self.name)}"


class Stream(NamedTuple):
    """A topic, such as `/cmd_vel`, the type of its messages, and the hash of that type."""

    topic: str
    kind: str
    type_hash: str

    def key(self, domain: int) -> str:
        """Return the key of its messages."""
        return f"{domain}/{self.topic.strip('/')}/{dds_name(self.kind)}/{self.type_hash}"


class Seen(NamedTuple):
    """What the token of that key says: `node` has an end of `stream`."""

    token: str
    node: str
    end: End
    stream: Stream


def every_end(domain: int) -> str:
    """Return the keys of the tokens of all publishers and subscriptions."""
    return f"{TOKENS}/{domain}/**"


def seen(token: str) -> Seen | None:
    """Read the key of a token; None if it announces neither publisher nor subscription."""
    match token.split("/"):
        case [_, _, _, _, _, (End.PUBLISHER | End.SUBSCRIPTION) as end, _, _, node, *stream]:
            topic, kind, type_hash, *_ = [*stream, "", "", ""]
            named = Stream(topic.replace("%", "/"), ros_name(kind), type_hash)
            return Seen(token, node, End(end), named)
    return None


def dds_name(kind: str) -> str:
    """Return the name by which DDS knows a type: `std_msgs::msg::dds_::String_`."""
    package, folder, name = kind.split("/")
    return f"{package}::{folder}::dds_::{name}_"


def ros_name(dds: str) -> str:
    """Return the name by which ROS knows a type: `std_msgs/msg/String`."""
    package, _, name = dds.partition("::dds_::")
    return f"{package.replace('::', '/')}/{name.removesuffix('_')}"


def absolute(topic: str, namespace: str) -> str:
    """Return the whole name of a topic: one that does not begin with / is in the namespace."""
    if topic.startswith("/"):
        return topic
    return f"{namespace.rstrip('/')}/{topic}"


def _mangled(name: str) -> str:
    """Return a name as a part of a key: with % for /, and for nothing."""
    return name.replace("/", "%") or "%"
