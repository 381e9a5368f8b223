"""`cogmap config`: every setting with what it means, as TOML, JSON and JSON Schema."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from cogmap.cli.config import commented_toml, file_schema, print_config
from cogmap.cli.launch.plan import Choices, effective
from cogmap.services import registry

TICKS_PER_CYCLE = 40
CYCLES_PER_S = 5
# LIDA's published defaults in the unit of our settings: what is by the tick there is by the cycle,
# or by the broadcast, here.
LIDA = {
    "global_workspace.no_broadcast_ticks": 100,
    "global_workspace.aggregate_above": 0.8,
    "global_workspace.coalition_above": 0.5,
    "global_workspace.refractory_ticks": 40,
    "global_workspace.decay": 0.1 * TICKS_PER_CYCLE,
    "workspace.decay": 0.1 * TICKS_PER_CYCLE,
    "workspace.base_level_decay": 0.1 * TICKS_PER_CYCLE,
    "epam.percept_threshold": "0.7 of total activation",
    "epam.priming.share": 0.9,
    "epam.priming.half_life_s": 0.5 / 0.05 / TICKS_PER_CYCLE / CYCLES_PER_S,
    "epam.priming.feeling_threshold": 0.7,
    "procedural.instantiation": 0.1,
    "procedural.unconscious_share": 0.0,
    "procedural.graph_kinds": [],
    "action.selector": "behaviour_net",
    "action.selection_threshold": 0.9,
    "action.threshold_fall": 0.1,
    "memory.sparse.kind": "binary",
    "memory.sparse.hard_locations": 10_000,
    "memory.sparse.dimensions": 1024,
    "memory.episodic.decay_per_h": "hours, up to a day",
}

TRAJECTORY = {
    "line_m": [[0.0, 0.0], [60.0, 0.0]],
    "landmarks": [{"name": "bakery", "x_m": 40.0, "y_m": 14.0}],
}


def printed(*arguments: str) -> str:
    result = CliRunner().invoke(print_config, arguments, catch_exceptions=False)
    assert result.exit_code == 0
    return result.output


def default(path: str) -> Any:
    """The default of the setting at `path`."""
    section, *keys = path.split(".")
    value: Any = registry.config_type(section)()
    for key in keys:
        value = getattr(value, key)

    return value


def description(path: str) -> str:
    """The description of the setting at `path`, as it is printed."""
    whole = file_schema()
    section, *keys = path.split(".")
    schema = whole["properties"][section]
    for key in keys:
        kind = schema["$ref"].rpartition("/")[2]
        schema = whole["$defs"][kind]["properties"][key]

    return str(schema["description"])


def sections(**given: dict[str, Any]) -> dict[str, dict[str, Any]]:
    choices = Choices(seed=7)
    return effective(given, choices, observer=False)


@pytest.mark.parametrize("sim", [{}, {"trajectory": TRAJECTORY}], ids=["town", "trajectory"])
def test_the_commented_file_reads_back_to_the_same(sim: dict[str, Any]) -> None:
    written = sections(sim=sim)
    read = tomllib.loads(commented_toml(written))

    assert read == json.loads(json.dumps(written))


def test_each_key_has_its_description_unit_and_range_before_it() -> None:
    text = printed("--seed", "3")

    assert "# Width of a camera image, in pixels. (64 to 1024)\nwidth_px = 320\n" in text
    assert "(above 0 to 100)\ncruise_m_s" in text
    assert "(0 to 4096 characters)\n" in text
    assert "seed = 3\n" in text


def test_a_key_without_a_value_is_a_comment() -> None:
    assert "# trajectory is not set\n" in printed()


def test_json_has_the_value_the_description_and_the_bounds_of_each_key() -> None:
    keys = json.loads(printed("--json", "--seed", "3"))["sim"]
    seed = keys["seed"]

    assert seed["value"] == 3
    assert seed["description"].startswith("Seed of the town")
    assert seed["type"] == "integer"
    assert seed["minimum"] == 0
    assert seed["maximum"] == 2**32


def test_the_schema_has_an_object_a_module() -> None:
    schema = json.loads(printed("--schema"))

    assert schema == json.loads(json.dumps(file_schema()))
    assert list(schema["properties"]) == list(registry.sections())

    for section in schema["properties"].values():
        name = section["$ref"].removeprefix("#/$defs/")
        assert schema["$defs"][name]["type"] == "object"


def test_what_is_written_to_a_file_is_what_is_printed(tmp_path: Path) -> None:
    path = tmp_path / "config.toml"
    printed("-o", str(path))

    assert path.read_text(encoding="utf-8") == printed()


def test_every_setting_has_a_description() -> None:
    definitions = file_schema()["$defs"]
    undescribed = [
        f"{kind}.{key}"
        for kind, definition in definitions.items()
        for key, schema in definition.get("properties", {}).items()
        if not schema.get("description")
    ]

    assert undescribed == []


def test_every_number_among_the_settings_is_bounded() -> None:
    definitions = file_schema()["$defs"]
    unbounded = []
    for kind, definition in definitions.items():
        for key, schema in definition.get("properties", {}).items():
            if schema.get("type") in ("integer", "number"):
                has_least = {"minimum", "exclusiveMinimum"} & schema.keys()
                has_greatest = {"maximum", "exclusiveMaximum"} & schema.keys()
                if not (has_least and has_greatest):
                    unbounded.append(f"{kind}.{key}")

    assert unbounded == []


@pytest.mark.parametrize("path", LIDA)
def test_a_changed_default_of_lida_is_named_with_its_reason(path: str) -> None:
    if default(path) == LIDA[path]:
        return

    before, names, reason = description(path).partition("LIDA: ")
    assert before and names and "; here " in reason and "because" in reason
