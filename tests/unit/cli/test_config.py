"""`cogmap config`: every setting with what it means, as TOML, JSON and JSON Schema."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from cli.config import commented_toml, file_schema, print_config
from cli.launch.plan import Choices, awaited, effective
from services import registry

TRAJECTORY = {
    "line_m": [[0.0, 0.0], [60.0, 0.0]],
    "landmarks": [{"name": "bakery", "x_m": 40.0, "y_m": 14.0}],
}


def printed(*arguments: str) -> str:
    result = CliRunner().invoke(print_config, arguments, catch_exceptions=False)
    assert result.exit_code == 0
    return result.output


def sections(**given: dict[str, Any]) -> dict[str, dict[str, Any]]:
    choices = Choices(seed=7)
    return effective(given, choices, awaited(choices, observer=False))


@pytest.mark.parametrize("sim", [{}, {"trajectory": TRAJECTORY}], ids=["town", "trajectory"])
def test_the_commented_file_reads_back_to_the_same(sim: dict[str, Any]) -> None:
    written = sections(sim=sim)
    read = tomllib.loads(commented_toml(written))

    assert read == json.loads(json.dumps(written))


def test_each_key_has_its_description_unit_and_range_before_it() -> None:
    text = printed("--seed", "3")

    assert "# Width of a camera image, in pixels, 64 to 1024.\nwidth_px = 320\n" in text
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
        for key, schema in definition["properties"].items()
        if not schema.get("description")
    ]

    assert undescribed == []


def test_every_number_among_the_settings_is_bounded() -> None:
    definitions = file_schema()["$defs"]
    unbounded = []
    for kind, definition in definitions.items():
        for key, schema in definition["properties"].items():
            if schema.get("type") in ("integer", "number"):
                has_least = {"minimum", "exclusiveMinimum"} & schema.keys()
                has_greatest = {"maximum", "exclusiveMaximum"} & schema.keys()
                if not (has_least and has_greatest):
                    unbounded.append(f"{kind}.{key}")

    assert unbounded == []
