"""A bag of ROS 1 or ROS 2, or an MCAP file with messages of ROS 2, read by the library rosbags."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

from cogmap.data.bags import unpacking
from cogmap.data.bags.order import stamp_ns_of
from cogmap.errors import UsageError

GIVE = "a bag of ROS 1, the folder of a bag of ROS 2, or an MCAP file of ROS 2"


class Place(NamedTuple):
    """Where a message is in a bag: its stamp, and when it was recorded."""

    stamp_ns: int
    log_ns: int


class Bag:
    """An open bag. `topics` are the types of its messages, such as `nav_msgs/msg/Odometry`, by
    topic.
    """

    def __init__(self, path: Path) -> None:
        """Open a bag. Raises UsageError if it is none, is damaged, or rosbags is not installed."""
        any_reader, store = _library()
        self.path = path
        if not path.exists():
            raise UsageError(f"there is no file or folder {path}: give {GIVE}")
        unpacking.check_databases(path)
        unpacking.check_metadata(path)
        with self._whole():
            self._reader = any_reader([path], default_typestore=store)
            self._reader.open()
        self.topics: dict[str, str] = {
            each.topic: each.msgtype for each in self._reader.connections
        }

    def of_kind(self, *kinds: str) -> list[str]:
        """Return the topics of these types, in order of their names."""
        return sorted(name for name, kind in self.topics.items() if kind in kinds)

    def messages(self, topic: str) -> Iterator[tuple[Place, Any]]:
        """Yield the messages of a topic in the order in which they were recorded. Raises UsageError
        if the bag is damaged.
        """
        with self._whole():
            for log_ns, message in self._between(topic, None, None):
                yield Place(stamp_ns_of(message) or log_ns, log_ns), message

    def unstamped(self, topic: str) -> Iterator[Any]:
        """Yield the messages of a topic without stamps. Raises UsageError as `messages` does."""
        with self._whole():
            for _, message in self._between(topic, None, None):
                yield message

    def first(self, topic: str) -> Any:
        """Return the first message of a topic. Raises UsageError if there is none."""
        for _, message in self.messages(topic):
            return message
        raise self.wrong(f"has no message on {topic}", "record that topic, too")

    def message(self, topic: str, place: Place) -> Any:
        """Return the message at `place`. Raises UsageError if it cannot be read."""
        with self._whole():
            for _, message in self._between(topic, place.log_ns, place.log_ns + 1):
                if place.stamp_ns == (stamp_ns_of(message) or place.log_ns):
                    return message
        raise UsageError(f"{self.path}: a message on {topic} is gone: leave the bag as it is")

    def setting(self, name: str) -> str:
        """Return how a user gives a topic, such as that of the `left` images."""
        return f"--set player.{name}_topic=TOPIC"

    def wrong(self, what: str, remedy: str) -> UsageError:
        """Make the error for a bag of which something is not as it must be."""
        listed = [f"{name} ({kind})" for name, kind in sorted(self.topics.items())]
        return UsageError(f"{self.path} {what}; it has {', '.join(listed) or 'nothing'}: {remedy}")

    def _between(
        self, topic: str, start_ns: int | None, stop_ns: int | None
    ) -> Iterator[tuple[int, Any]]:
        connections = [each for each in self._reader.connections if each.topic == topic]
        if not connections:
            return
        for connection, log_ns, content in self._reader.messages(connections, start_ns, stop_ns):
            yield log_ns, self._reader.deserialize(content, connection.msgtype)

    @contextmanager
    def _whole(self) -> Iterator[None]:
        """Raise UsageError for whatever the library raises where a bag is damaged: it has no
        exception of its own for all of that.
        """
        try:
            yield
        except UsageError:
            raise
        except Exception as error:
            words = " ".join(str(error).split()).rstrip(".") or type(error).__name__
            raise UsageError(
                f"{self.path} is no whole bag ({words}): give {GIVE}; what was cut off may be "
                "mended by `ros2 bag reindex`, `rosbag reindex` or `mcap recover`"
            ) from None


def _library() -> tuple[Any, Any]:
    """Return the reader of rosbags, and the types of bags that do not describe theirs."""
    try:
        from rosbags.highlevel import AnyReader
        from rosbags.rosbag1 import reader as reader1
        from rosbags.rosbag2 import reader as reader2
        from rosbags.rosbag2 import storage_mcap
        from rosbags.typesys import Stores, get_typestore
    except ImportError:
        raise UsageError(
            "bags need the library rosbags: install it by `pip install 'cogmap[bags]'`"
        ) from None
    unpacking.bound(reader1, reader2, storage_mcap)
    return AnyReader, get_typestore(Stores.LATEST)
