"""YAML that others wrote is read up to a depth."""

from __future__ import annotations

import pytest
import yaml

from cogmap.files.yaml import MAX_DEPTH, parsed


@pytest.mark.parametrize(
    "text",
    [
        "[" * 20_000,
        "{a: " * 20_000,
        "- " * 20_000,
        "".join(f"{' ' * level}a:\n" for level in range(MAX_DEPTH + 2)),
        "[']', " * 20_000,
    ],
)
def test_yaml_that_is_nested_without_end_is_refused(text: str) -> None:
    with pytest.raises(yaml.YAMLError, match="nested more than 64 deep"):
        parsed(text)


def test_yaml_that_people_write_is_read() -> None:
    deep = "[" * MAX_DEPTH + "]" * MAX_DEPTH

    assert parsed("a: [1, 2.5]\nb:\n  - {c: '[['}\n") == {"a": [1, 2.5], "b": [{"c": "[["}]}
    assert parsed(deep)
