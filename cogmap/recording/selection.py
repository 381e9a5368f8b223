"""Which topics of the table are meant."""

from __future__ import annotations

import re
from collections.abc import Iterable

from cogmap.errors import UsageError
from cogmap.hints import did_you_mean
from cogmap.recording.storage.format import topics_to_record
from cogmap.schemas import topics
from cogmap.schemas.topics import Scope, Topic


def named(names: Iterable[str | Topic]) -> list[Topic]:
    """Return the topics of those names; a topic stands for itself. Raises UsageError as `one`."""
    return [one(name) for name in names]


def one(name: str | Topic) -> Topic:
    """Return the topic called `name`, which may begin with a slash; a topic stands for itself.

    Raises UsageError naming what may be meant if it is not in the table.
    """
    if isinstance(name, Topic):
        return name
    if not isinstance(name, str):
        raise UsageError(
            f"{name!r} is no topic: give each as an argument of its own, by its name or as a "
            "constant of `cogmap.topics`"
        )

    found = topics.BY_NAME.get(name.strip("/"))
    if found is None:
        known = f"there are {', '.join(sorted(topics.BY_NAME))}"
        raise UsageError(f"no topic {name!r}: {did_you_mean(name, topics.BY_NAME, known)}")
    return found


def pattern(text: str, option: str) -> re.Pattern[str]:
    """Return `text` as a regular expression. Raises UsageError naming the option it came from."""
    try:
        return re.compile(text)
    except re.error as error:
        raise UsageError(f"{option} {text!r} is not a regular expression: {error}") from None


def to_record(names: Iterable[str] = (), regex: str = "", exclude: str = "") -> list[Topic]:
    """Return the topics that are named or match `regex`, all of them if neither is given, less
    those that match `exclude`.

    Raises UsageError if nothing is left.
    """
    recordable = topics_to_record()
    wanted = set(named(names))
    if not wanted and not regex:
        wanted = set(recordable)
    elif regex:
        matcher = pattern(regex, "--regex")
        wanted |= {topic for topic in recordable if matcher.search(topic.name)}
    if exclude:
        unwanted = pattern(exclude, "--exclude")
        wanted = {topic for topic in wanted if not unwanted.search(topic.name)}

    chosen = [topic for topic in recordable if topic in wanted]
    if not chosen:
        raise UsageError("no topic is left: name some, or leave --regex and --exclude out")
    return chosen


def to_play(names: Iterable[str] = (), regex: str = "", exclude: str = "") -> list[Topic]:
    """Return the topics to play, as `to_record` does; without a choice, facts about processes are
    left out, as those are of other ones.
    """
    wanted = list(names)
    chosen = to_record(wanted, regex, exclude)
    if wanted or regex:
        return chosen
    return [topic for topic in chosen if topic.scope is not Scope.PROCESS]
