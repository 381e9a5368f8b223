"""Reads schemes from TOML, and refuses what no broadcast could ever match."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import msgspec

from cogmap.data.toml_tables import Source, read_tables
from cogmap.errors import ConfigError
from cogmap.hints import did_you_mean
from cogmap.schemas.base import Count, Finite, Name, PositiveSeconds, Scalar, Share
from cogmap.schemas.cognition import PARAMETERS, ActionName, GuidanceScheme, Relation
from cogmap.schemas.feelings import Feeling
from cogmap.services.procedural.kinds import NEED, NodeKinds
from cogmap.services.procedural.patterns import Condition, Pattern
from cogmap.services.procedural.schemes import Reference, Result, Scheme

BUILT_IN = Path(__file__).with_name("schemes.toml")
SCHEME = "scheme"
GUIDANCE = "guidance"
KIND = "kind"
VARIABLE = "as"
FEELING = "feeling"
FEELINGS = tuple(feeling.value for feeling in Feeling if feeling)
SALIENCE = "salience"
BOUNDS = ("at_least", "at_most")
TYPES = {float: "number", int: "whole number", str: "word"}
_NUMBER = re.compile(r"(?<=_)[1-9]\d*(?=_)")


class SchemeTable(msgspec.Struct, kw_only=True, forbid_unknown_fields=True):
    """A scheme as it is written."""

    name: Name
    action: str
    context: list[dict[str, Any]]
    adding: list[dict[str, Any]] = []
    deleting: list[dict[str, Any]] = []
    parameters: dict[str, Scalar] = {}
    base_level: Share = 0.5
    within_s: PositiveSeconds = 5.0


class LandmarkTable(Relation, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """A landmark as it is written."""


class GuidanceTable(msgspec.Struct, kw_only=True, forbid_unknown_fields=True):
    """A guidance scheme as it is written."""

    name: Name
    landmarks: list[LandmarkTable]
    path_m: list[tuple[Finite, Finite]]
    executions: Count = 0
    successes: Count = 0


class SchemeFile(msgspec.Struct, kw_only=True, forbid_unknown_fields=True):
    """A file of schemes. `generic_kinds` are kinds of nodes that other packages' codelets write,
    `own_actions` those that a motor module of somebody's own executes, `own_needs` and
    `own_functions` those of a body and of objects that somebody's own modules sense.
    """

    scheme: list[SchemeTable] = []
    guidance: list[GuidanceTable] = []
    generic_kinds: list[Name] = []
    own_actions: list[Name] = []
    own_needs: list[Name] = []
    own_functions: list[Name] = []


def load(path: Path) -> list[Scheme]:
    """Load the schemes of a file. Raises ConfigError that names the file, and the line of what is
    wrong in it.
    """
    source, file = _decoded(path)
    kinds = NodeKinds(file.generic_kinds, file.own_needs, file.own_functions)
    actions = [*ActionName, *file.own_actions]
    schemes: list[Scheme] = []
    for number, table in enumerate(file.scheme):
        scheme = _Reader(source, number, table, kinds).scheme(actions)
        if scheme.name in [each.name for each in schemes]:
            text = f"two schemes are named {scheme.name!r}"
            raise source.error(SCHEME, number, scheme.name, text)
        schemes.append(scheme)

    return schemes


def load_guidance(path: Path) -> list[GuidanceScheme]:
    """Load the guidance schemes of a file. Raises ConfigError as `load` does."""
    source, file = _decoded(path)
    names = {table.name for table in file.scheme}
    schemes = []
    for number, table in enumerate(file.guidance):
        if table.name in names:
            text = f"two schemes are named {table.name!r}"
            raise source.error(GUIDANCE, number, table.name, text)
        if table.successes > table.executions:
            text = f"scheme {table.name!r} has more successes than executions"
            raise source.error(GUIDANCE, number, "successes", text)

        names.add(table.name)
        try:
            schemes.append(msgspec.convert(msgspec.to_builtins(table), GuidanceScheme))
        except msgspec.ValidationError as error:
            word = str(error).rpartition("$.")[2].rstrip("`")
            raise source.error(GUIDANCE, number, word, str(error)) from None

    return schemes


def _decoded(path: Path) -> tuple[Source, SchemeFile]:
    remedy = "name one that exists, or leave procedural.schemes out"
    return read_tables(path, SchemeFile, "file of schemes", remedy)


class _Reader:
    """Makes a scheme out of its table."""

    def __init__(self, source: Source, number: int, table: SchemeTable, kinds: NodeKinds) -> None:
        self._source = source
        self._number = number
        self._table = table
        self._kinds = kinds
        self._kind_of: dict[str, str] = {}
        self._near: list[str] = []

    def scheme(self, actions: Sequence[str]) -> Scheme:
        """Read the scheme, whose action is one of `actions`. Raises ConfigError."""
        table = self._table
        if not table.context:
            raise self._error("context", "has no context: name a pattern at least")
        if table.action not in actions:
            raise self._unknown("action", table.action, actions)

        context = tuple(self._pattern(each) for each in table.context)
        self._kind_of = {each.variable: each.kind for each in context if each.variable}
        return Scheme(
            name=table.name,
            action=table.action,
            context=context,
            adding=tuple(self._result(each) for each in table.adding),
            deleting=tuple(self._bound(self._pattern(each)) for each in table.deleting),
            parameters=self._parameters(),
            base_level=table.base_level,
            within_s=table.within_s,
        )

    def _result(self, table: dict[str, Any]) -> Result:
        fields = dict(table)
        salience = fields.pop(SALIENCE, 0.0)
        pattern = self._pattern(fields)
        self._near.append(SALIENCE)
        is_number = isinstance(salience, int | float) and not isinstance(salience, bool)
        if not is_number or not -1.0 <= salience <= 1.0:
            raise self._error(SALIENCE, f"has the salience {salience!r}: write one from -1 to 1")
        return Result(self._bound(pattern), float(salience))

    def _bound(self, pattern: Pattern) -> Pattern:
        """Check a result: no feeling, and its variable, if it has one, is one of the context."""
        if pattern.feelings:
            text = "has a feeling among its results: it is a condition of the context alone"
            raise self._error(FEELING, text)
        if pattern.variable and pattern.variable not in self._kind_of:
            raise self._unknown("variable", pattern.variable, list(self._kind_of))
        return pattern

    def _pattern(self, table: dict[str, Any]) -> Pattern:
        self._near = [str(word) for item in table.items() for word in item]
        kind = table.get(KIND)
        if not isinstance(kind, str):
            word = next(iter(table), "")
            raise self._error(word, f"has a pattern without a kind: {table}")
        if kind not in self._kinds.names:
            raise self._unknown("node kind", kind, self._kinds.names)

        variable = table.get(VARIABLE, "")
        if not isinstance(variable, str):
            raise self._error(VARIABLE, f"has a variable that is no word: {variable!r}")
        conditions = []
        for field, value in table.items():
            if field not in (KIND, VARIABLE, FEELING):
                conditions.append(self._condition(kind, field, value))

        named = table.get(FEELING, [])
        names = named if isinstance(named, list) else [named]
        for name in names:
            if name not in FEELINGS:
                raise self._unknown(FEELING, str(name), FEELINGS)
        return Pattern(kind, tuple(conditions), variable, tuple(Feeling(name) for name in names))

    def _condition(self, kind: str, field: str, value: Any) -> Condition:
        self._check_field(kind, field)
        if isinstance(value, dict):
            for name, bound in value.items():
                if name not in BOUNDS:
                    raise self._unknown("bound", name, BOUNDS)
                if isinstance(bound, bool) or not isinstance(bound, int | float):
                    raise self._error(name, f"has the bound {bound!r}, which is no number")
            return Condition(field, **value)

        values = value if isinstance(value, list) else [value]
        try:
            typed = tuple(self._kinds.value(kind, field, each) for each in values)
        except ValueError as error:
            word = next((each for each in values if isinstance(each, str)), field)
            raise self._error(word, f"has a wrong value of {kind}.{field}: {error}") from None

        for each in typed:
            self._check_word(self._kinds.meaning(kind, field), each)
        return Condition(field, typed)

    def _check_word(self, meaning: str, word: Scalar) -> None:
        """Refuse a word for a need or a function that there is none of; empty, it is of none."""
        if meaning and word and word not in self._kinds.known(meaning):
            raise self._unknown(meaning, str(word), self._kinds.known(meaning))

    def _parameters(self) -> dict[str, Scalar | Reference]:
        """Read the parameters, which are those of the motor program, if that is one of ours."""
        action = self._table.action
        given = self._table.parameters
        parameters = {name: self._parameter(name, value) for name, value in given.items()}
        needed = PARAMETERS.get(action)
        if needed is None:
            return parameters

        for name, parameter in parameters.items():
            self._near = [name, str(given[name])]
            self._check_parameter(name, parameter, needed)
        for name in needed:
            if name not in parameters:
                raise self._error("parameters", f"lacks the parameter {name!r} of {action}")
        return parameters

    def _check_parameter(
        self, name: str, parameter: Scalar | Reference, needed: Mapping[str, type]
    ) -> None:
        """Refuse a parameter that the motor program does not take, or not as a value such as this.
        Those that are numbered are numbered on.
        """
        wanted = needed.get(name) or needed.get(_NUMBER.sub("1", name))
        if wanted is None:
            raise self._unknown(f"parameter of {self._table.action}", name, [*needed])

        if isinstance(parameter, Reference):
            kind = self._kind_of[parameter.variable]
            if self._kinds.fields(kind) is None:
                return
            found = self._kinds.scalar(kind, parameter.field)
        else:
            found = type(parameter)
            self._check_word(NEED if name == NEED else "", parameter)

        if found is not wanted and (found, wanted) != (int, float):
            value = self._table.parameters[name]
            text = f"has the parameter {name} {value!r}, which is no {TYPES[wanted]}"
            raise self._error(name, text)

    def _parameter(self, name: str, value: Scalar) -> Scalar | Reference:
        """Read a parameter as it is, or "$VARIABLE.FIELD" of a node of the context."""
        self._near = [name]
        if not isinstance(value, str) or not value.startswith("$"):
            return value

        variable, _, field = value[1:].partition(".")
        if variable not in self._kind_of:
            raise self._unknown("variable", variable, list(self._kind_of))
        self._check_field(self._kind_of[variable], field)
        return Reference(variable, field)

    def _check_field(self, kind: str, field: str) -> None:
        fields = self._kinds.fields(kind)
        if fields is not None and field not in fields:
            raise self._unknown(f"field of {kind}", field, fields)

    def _unknown(self, what: str, word: str, known: Sequence[str]) -> ConfigError:
        remedy = did_you_mean(word, known, f"there are {', '.join(known) or 'none'}")
        return self._error(word, f"names the unknown {what} {word!r}: {remedy}")

    def _error(self, word: str, text: str) -> ConfigError:
        text = f"scheme {self._table.name!r} {text}"
        return self._source.error(SCHEME, self._number, word, text, self._near)
