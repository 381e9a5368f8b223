"""The one tree of exceptions. Each says in one sentence what is wrong and what to do about it."""

from __future__ import annotations


class CogmapError(Exception):
    """Whatever this project raises on purpose."""


class UsageError(CogmapError):
    """The user can mend it: a wrong configuration, a missing file, a port in use. Exit code 2."""


class ConfigError(UsageError):
    """A configuration key or value is wrong."""


class NoRouterError(UsageError):
    """No Zenoh router answered in time."""


class PortInUseError(UsageError):
    """Another process listens where the router should."""


class MessageError(CogmapError):
    """A message that came is not what its topic carries; it is counted and passed over."""


class NoAnswerError(CogmapError):
    """A query got no answer, or an error for an answer."""


class LogError(UsageError):
    """A log file is missing, damaged, or not one of ours."""
