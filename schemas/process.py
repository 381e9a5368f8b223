"""Messages about the processes themselves: the clock, who is there, how each fares."""

from __future__ import annotations

from cogmap.schemas.base import Count, Finite, Message, Name, Unit


class Clock(Message, kw_only=True, frozen=True):
    """The time that stamps messages. `rate` is its speed relative to wall time, 0 in lockstep."""

    rate: Finite = 1.0


class Pause(Message, kw_only=True, frozen=True):
    """Asks that the time of the simulation, or of the recording, stands after `views` more views;
    that it passes if `is_paused` is false.
    """

    is_paused: bool
    views: Count = 0


class Paused(Message, kw_only=True, frozen=True):
    """Whether time stands at the stamp, because somebody asked for it; said as that changes, and
    each second while it stands.
    """

    is_paused: bool


class Playback(Message, kw_only=True, frozen=True):
    """How much of a recording has been played until the stamp; `progress` is 1 once it is over.
    Observers only.

    `views` were published, and `skipped` could not be read: `reasons` has a sentence for each of
    these since the message before, and in the beginning for what else is not played.
    """

    recording: Name
    views: Count
    skipped: Count
    progress: Unit
    reasons: list[str] = []


class Presence(Message, kw_only=True, frozen=True):
    """That an instance of a module came or went, as `observer` saw it."""

    module: Name
    instance: Name
    alive: bool
    observer: Name


class Health(Message, kw_only=True, frozen=True):
    """How one process fares: counts since it started and, over the last second, what time and
    memory it took.
    """

    module: Name
    instance: Name
    ready: bool
    uptime_s: Finite
    received: dict[str, Count]
    emitted: dict[str, Count]
    rejected: dict[str, Count]
    superseded: dict[str, Count]
    gaps: dict[str, Count]
    queued: Count
    busy: Finite
    compute_p50_ms: Finite
    compute_p99_ms: Finite
    memory_mb: Finite
    notes: list[str] = []


class SettingsRequest(Message, kw_only=True, frozen=True):
    """Asks what settings the processes were started with: every one of them answers."""


class Settings(Message, kw_only=True, frozen=True):
    """The configuration that `instance` was started with, as the text of a TOML file; keys that are
    not in it have their default.
    """

    instance: Name
    toml: str
