"""`cogmap config`: every setting of every module, with what it means."""

from __future__ import annotations

import json
import textwrap
from pathlib import Path
from typing import IO, Any

import click
import msgspec
import tomli_w

from cogmap.cli.launch.plan import Choices, effective
from cogmap.cli.options import json_option
from cogmap.cli.run.options import codelets_option, laps_option, lockstep_option, seed_option
from cogmap.errors import UsageError
from cogmap.runtime import config
from cogmap.runtime.config import Sections
from cogmap.runtime.program import config_option, set_option
from cogmap.services import registry

COLUMNS = 100
Schema = dict[str, Any]


@click.command(name="config")
@seed_option
@laps_option
@lockstep_option
@codelets_option
@click.option(
    "--record/--no-record", default=True, help="Let the drive wait for a recorder, or not."
)
@click.option(
    "-o",
    "--output",
    type=click.File("w", encoding="utf-8", atomic=True),
    default="-",
    help="The file to write.  [default: standard output]",
)
@json_option
@click.option("--schema", is_flag=True, help="Print the JSON Schema of the configuration file.")
@config_option
@set_option
def print_config(
    seed: int | None,
    laps: float | None,
    lockstep: bool,
    codelets: int,
    record: bool,
    output: IO[str],
    as_json: bool,
    schema: bool,
    config_path: Path | None,
    settings: tuple[str, ...],
) -> None:
    """Print the whole configuration of a drive, with the meaning, unit and range of each key.

    As TOML it is a file for --config, for modules that are started one by one.
    """
    if as_json and schema:
        raise UsageError("--json and --schema exclude each other: choose one")

    choices = Choices(seed=seed, laps=laps, lockstep=lockstep, codelets=codelets, record=record)
    given = config.load(config_path, settings)
    sections = effective(given, choices, observer=False)
    if schema:
        output.write(json.dumps(file_schema(), indent=2) + "\n")
    elif as_json:
        output.write(json.dumps(described(sections), indent=2) + "\n")
    else:
        output.write(commented_toml(sections))


def file_schema() -> Schema:
    """Make the JSON Schema (2020-12) of the configuration file: its sections, each an object."""
    names = registry.sections()
    kinds = [registry.config_type(name) for name in names]
    references, definitions = msgspec.json.schema_components(kinds, ref_template="#/$defs/{name}")
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "$id": "cogmap/config",
        "type": "object",
        "properties": dict(zip(names, references, strict=True)),
        "additionalProperties": False,
        "$defs": definitions,
    }


def described(sections: Sections) -> dict[str, Any]:
    """Return the value and the schema (description, type, bounds) of each key of each module."""
    whole = file_schema()
    modules = {}
    for name, values in sections.items():
        keys = _keys(whole["properties"][name], whole)
        modules[name] = {key: {"value": values.get(key), **schema} for key, schema in keys.items()}
        for facts in modules[name].values():
            facts.pop("default", None)
    return modules


def _keys(schema: Schema, whole: Schema) -> dict[str, Schema]:
    """Return the schema of each key of the object that `schema` describes; none for other types."""
    for option in (schema, *schema.get("anyOf", ())):
        if "$ref" in option:
            name = option["$ref"].rpartition("/")[2]
            keys: dict[str, Schema] = whole["$defs"][name]["properties"]
            return keys
    return {}


def commented_toml(sections: Sections) -> str:
    """Format `sections` as a TOML file with a comment before each key that has a description."""
    whole = file_schema()
    lines: list[str] = []
    for name, values in sections.items():
        lines += _table([name], values, _keys(whole["properties"][name], whole), whole)
    return "\n".join(lines) + "\n"


def _table(
    path: list[str], values: dict[str, Any], keys: dict[str, Schema], whole: Schema
) -> list[str]:
    """Return the lines of the table at `path`: its own keys, then the tables inside it."""
    lines = [f"[{'.'.join(path)}]"]
    tables: list[str] = []
    unnamed = [key for key in values if key not in keys]
    for key in [*keys, *unnamed]:
        schema = keys.get(key, {})
        comment = _comment(schema)
        value = values.get(key)
        if value is None:
            lines += [*comment, f"# {key} is not set", ""]
        elif isinstance(value, dict):
            tables += comment + _table([*path, key], value, _keys(schema, whole), whole)
        elif _holds_tables(value):
            tables += comment + _array_of_tables([*path, key], value)
        else:
            lines += [*comment, tomli_w.dumps({key: value})]

    return lines + tables


def _holds_tables(value: Any) -> bool:
    return isinstance(value, list | tuple) and bool(value) and isinstance(value[0], dict)


def _array_of_tables(path: list[str], tables: list[dict[str, Any]]) -> list[str]:
    lines = []
    for table in tables:
        lines += [f"[[{'.'.join(path)}]]", tomli_w.dumps(table)]
    return lines


def _comment(schema: Schema) -> list[str]:
    """Make the comment of a key: its description and its range."""
    bounds = _range(schema)
    description = schema.get("description", "") + (f" ({bounds})" if bounds else "")
    return textwrap.wrap(
        description, COLUMNS, initial_indent="# ", subsequent_indent="# ", break_long_words=False
    )


def _range(schema: Schema) -> str:
    """Return the range of a number in words, such as "above 0 to 1", or of a text's length; empty
    if there is none.
    """
    lowest = schema.get("minimum", schema.get("exclusiveMinimum"))
    highest = schema.get("maximum", schema.get("exclusiveMaximum"))
    if lowest is not None and highest is not None:
        words = f"{_number(lowest)} to {_number(highest)}"
        return f"above {words}" if "exclusiveMinimum" in schema else words

    longest = schema.get("maxLength")
    return "" if longest is None else f"{schema.get('minLength', 0)} to {longest} characters"


def _number(value: float) -> str:
    """Write a bound: a whole number in full, any other in few characters."""
    if isinstance(value, int):
        return str(value)
    return f"{value:g}".replace("e+0", "e").replace("e+", "e")
