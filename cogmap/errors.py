"""The tree of exceptions. Each message is one sentence: what is wrong, and the remedy."""

from __future__ import annotations


class CogmapError(Exception):
    """The base of every exception that this project raises on purpose."""


class UsageError(CogmapError):
    """What the user can mend: a wrong configuration, a missing file, a port in use. Exit code 2."""


class ConfigError(UsageError):
    """A configuration key or value is wrong."""


class NoRouterError(UsageError):
    """No Zenoh router answered in time."""


class AccessError(UsageError):
    """Keys are missing, wrong or expired, or do not allow what is asked for."""


class PortInUseError(UsageError):
    """Another process listens where the router should."""


class LogError(UsageError):
    """A log file is missing, damaged, or not one of ours."""


class BoundError(UsageError):
    """A file holds or takes more than it may; the sentence names the bound and how to raise it."""


class StorageError(UsageError):
    """What a module must keep cannot be written: the disk is full, or the folder read-only."""


class ProcessFailedError(UsageError):
    """A process of a run failed for a reason that a restart does not remove."""


class MessageError(CogmapError):
    """A received message is not what its topic carries; it is counted and ignored."""


class NoAnswerError(CogmapError):
    """A query had no answer, or an error for an answer."""
