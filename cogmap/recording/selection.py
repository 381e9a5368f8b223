"""Which topics of the table are meant."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable

from cogmap.errors import UsageError
from cogmap.recording.storage.format import topics_to_record
from cogmap.schemas import topics
from cogmap.schemas.topics import Topic


def named(names: Iterable[str | Topic]) -> list[Topic]:
    """Return the topics of those names; a topic stands for itself. Raises UsageError naming the one
    that is not in the table.
    """
    found = []
    for name in names:
        if isinstance(name, Topic):
            found.append(name)
            continue
        if name not in topics.BY_NAME:
            close = difflib.get_close_matches(name, topics.BY_NAME, 1)
            known = f"there are {', '.join(sorted(topics.BY_NAME))}"
            raise UsageError(
                f"no topic {name!r}: {f'did you mean {close[0]}?' if close else known}"
            )
        found.append(topics.BY_NAME[name])
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
        raise UsageError(
            "no topic is left to record: name some, or leave --regex and --exclude out"
        )
    return chosen
