"""Where a scene comes from: a running system, or a log."""

from __future__ import annotations

import threading
from typing import Protocol

import msgspec

from cogmap.cli.dashboard.scene import Scene
from cogmap.schemas.base import Coordinate, Name


class Playing(msgspec.Struct, kw_only=True):
    """How a log is played: at which time, of how much; `indexed_s` of it can be shown already.
    `failure` says why the rest cannot be, empty if it can.
    """

    at_s: float
    duration_s: float
    indexed_s: float
    is_playing: bool
    speed: float
    failure: str = ""


class Source(Protocol):
    """What the server shows: whoever looks at `scene` holds `lock`.

    `label` says what it is. A log is `playing`; it is None of a running system. `is_there` is
    whether the system runs; the scene of one that has ended is its last.
    """

    scene: Scene
    lock: threading.Lock
    label: str

    @property
    def is_there(self) -> bool:
        """Return whether there is something to show."""

    @property
    def playing(self) -> Playing | None:
        """Return how far a log is played."""

    def watched(self, by: int) -> None:
        """Learn that so many browsers watch."""

    def act(self, wish: Wish) -> str:
        """Do what a person wishes. Returns a sentence on what was done; raises UsageError if it
        cannot be.
        """

    def close(self) -> None:
        """End what goes on in the background."""


class Wish(msgspec.Struct, kw_only=True, forbid_unknown_fields=True):
    """What a person wants done; one of its fields is given.

    `goal` is an object's name or label, `place` x and y on the map, to go to; `clear` forgets all
    goals. `street` is to be `closed` or opened. `key` drives the robot as those of `cogmap teleop`
    do. `adds_worker` is for one more worker, `kill` the instance of one to kill. `play` is whether
    time is to pass, `step` asks for the next cycle alone, `resets` for the robot at its start
    again. Of a log: `seek_s` is a time to show, `speed` is how fast it plays.
    """

    goal: Name | None = None
    place: tuple[Coordinate, Coordinate] | None = None
    clear: bool = False
    street: str = ""
    closed: bool = True
    key: str | None = None
    adds_worker: bool = False
    kill: Name | None = None
    seek_s: float | None = None
    play: bool | None = None
    step: bool = False
    resets: bool = False
    speed: float | None = None
