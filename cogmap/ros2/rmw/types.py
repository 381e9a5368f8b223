"""Types of messages: the hash of each, and messages as CDR, by the library rosbags."""

from __future__ import annotations

from typing import Any

from cogmap.errors import MessageError, UsageError
from cogmap.recording.exporting.ros_messages import RosMessages

NO_HASH = "TypeHashNotSupported"
"""What stands for the hash of a type in ROS 2 Humble, which has none."""

HUMBLE = "humble"
DISTROS = (HUMBLE, "iron", "jazzy", "kilted")
NEWEST = DISTROS[-1]


class Types:
    """The types of the messages of a distribution of ROS 2; `messages` makes some."""

    def __init__(self, distro: str) -> None:
        """Load the types. Raises UsageError if the libraries are not installed."""
        try:
            import xxhash  # noqa: F401
            from rosbags.typesys import Stores, get_typestore
        except ImportError:
            raise UsageError(
                "robots need the libraries rosbags and xxhash: install them by "
                "`pip install 'cogmap[ros2]'`"
            ) from None

        self._store: Any = get_typestore(Stores[f"ROS2_{distro.upper()}"])
        self._has_hashes = distro != HUMBLE
        self.messages = RosMessages(self._store)

    def hash_of(self, kind: str) -> str:
        """Return the hash of a type: RIHS01_, and 64 hexadecimal digits."""
        return str(self._store.hash_rihs01(kind)) if self._has_hashes else NO_HASH

    def encoded(self, message: Any) -> bytes:
        """Return a message as CDR, with the four bytes before it that say so."""
        return bytes(self._store.serialize_cdr(message, message.__msgtype__))

    def decoded(self, content: bytes, kind: str) -> Any:
        """Read a message of a type. Raises MessageError if it is none."""
        try:
            return self._store.deserialize_cdr(content, kind)
        except Exception as error:  # the library has no exception of its own for broken content
            words = " ".join(str(error).split()) or type(error).__name__
            raise MessageError(f"{len(content)} bytes are no {kind} ({words})") from None
