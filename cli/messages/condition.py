"""The conditions of `--filter`: which messages are meant, by the values of their fields.

    condition  = comparison { "and" comparison }
    comparison = FIELD ( "==" | "!=" | "<" | "<=" | ">" | ">=" ) VALUE

FIELD is as for `--field`. VALUE is a number, true, false, a word, or a text in quotes. Numbers are
compared by size, anything else by being the same.
"""

from __future__ import annotations

import enum
import math
import operator
import re
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import click
from msgspec import inspect

from cogmap.cli.messages.fields import kinds_at
from cogmap.errors import UsageError
from cogmap.hints import did_you_mean
from cogmap.schemas.base import Message
from cogmap.schemas.render import field
from cogmap.schemas.topics import Topic

Value = int | float | bool | str

_COMPARISON = re.compile(
    r"""\s*(?P<field>[\w.]+)
        \s*(?P<operator>==|!=|<=|>=|<|>)
        \s*(?:"(?P<double>[^"]*)"|'(?P<single>[^']*)'|(?P<word>[^\s"'<>=!]+))
        \s*(?:\band\b\s*(?=\S)|$)""",
    re.VERBOSE,
)
_OPERATORS: dict[str, Callable[[Any, Any], bool]] = {
    "==": operator.eq,
    "!=": operator.ne,
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
}
_OF_ANYTHING = ("==", "!=")
_TRUTHS = {"true": True, "false": False}

filter_option = click.option(
    "--filter",
    "condition",
    metavar="CONDITION",
    help="Only messages for which this holds: fields compared with values (== != < <= > >=), "
    'joined by and, such as "speed_m_s > 1.5 and source == sim".',
)


@dataclass(frozen=True)
class Comparison:
    """A field, compared with a value."""

    path: str
    operator: str
    value: Value

    def holds(self, message: Message) -> bool:
        """Decide whether it holds for a message; it does not for one without the field."""
        try:
            found = field(message, self.path)
        except LookupError:
            return False

        if isinstance(found, enum.Enum):
            found = found.value
        are_alike = type(found) is type(self.value) or (
            _is_number(found) and _is_number(self.value)
        )
        return are_alike and _OPERATORS[self.operator](found, self.value)


@dataclass(frozen=True)
class Condition:
    """Comparisons that must all hold."""

    comparisons: Sequence[Comparison] = ()

    def holds(self, message: Message) -> bool:
        """Decide whether all hold for a message."""
        return all(each.holds(message) for each in self.comparisons)


ALWAYS = Condition()


def parsed(text: str | None, topic: Topic) -> Condition:
    """Parse a condition on the messages of `topic`; None is one that always holds.

    Raises UsageError for what is no condition, for a field that no message of the topic has, and
    for a value that the field cannot have.
    """
    if text is None:
        return ALWAYS

    comparisons: list[Comparison] = []
    place = 0
    while place < len(text) or not comparisons:
        found = _COMPARISON.match(text, place)
        if found is None:
            raise UsageError(
                f"--filter {text!r}: {text[place:].strip()!r} is no comparison: write such as "
                '"speed_m_s > 1.5 and source == sim"'
            )
        comparisons.append(_comparison(found, topic))
        place = found.end()
    return Condition(tuple(comparisons))


def _comparison(found: re.Match[str], topic: Topic) -> Comparison:
    """Check a comparison that was found. Raises UsageError."""
    path, symbol = found["field"], found["operator"]
    texts = [found[name] for name in ("double", "single", "word") if found[name] is not None]
    try:
        kinds = kinds_at(topic.type, path)
        value = _value(texts[0], kinds, is_word=found["word"] is not None)
        if symbol not in _OF_ANYTHING and not _is_number(value):
            raise UsageError(f"{symbol} compares numbers: use == or !=")
    except UsageError as error:
        raise UsageError(f"--filter {found[0].strip()!r}: {error}") from None
    return Comparison(path, symbol, value)


def _value(text: str, kinds: Sequence[inspect.Type], *, is_word: bool) -> Value:
    """Read a value of one of these types. Raises UsageError if `text` is none."""
    can_be_any = any(isinstance(kind, inspect.AnyType) for kind in kinds)
    is_number = any(isinstance(kind, inspect.IntType | inspect.FloatType) for kind in kinds)
    is_truth = any(isinstance(kind, inspect.BoolType) for kind in kinds)
    is_text = any(isinstance(kind, inspect.StrType) for kind in kinds)
    names = [name for kind in kinds for name in _names(kind)]

    if is_word and (is_truth or can_be_any) and text in _TRUTHS:
        return _TRUTHS[text]
    number = _number(text)
    if is_word and (is_number or can_be_any) and number is not None:
        return number
    if is_text or can_be_any or text in names:
        return text

    if names:
        hint = did_you_mean(text, names, f"there are {', '.join(filter(None, names))}")
        raise UsageError(f"{text!r} is none of its values: {hint}")
    if is_number or is_truth:
        raise UsageError(f"{text!r} is not {'a number' if is_number else 'true or false'}")
    raise UsageError("it is no single value: name one inside, such as objects.0.label")


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _number(text: str) -> int | float | None:
    """Read a finite number, exactly if it is whole; None if `text` is none."""
    with suppress(ValueError):
        return int(text)
    with suppress(ValueError):
        number = float(text)
        return number if math.isfinite(number) else None
    return None


def _names(kind: inspect.Type) -> list[str]:
    """Return the texts that a value of this type may be, if they are listed."""
    match kind:
        case inspect.EnumType(cls=cls):
            return [str(each.value) for each in cls]
        case inspect.LiteralType(values=values):
            return [str(each) for each in values]
        case _:
            return []
