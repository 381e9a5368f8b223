"""Tables that people write as TOML."""

from __future__ import annotations

from pathlib import Path

import msgspec
import pytest

from cogmap.data.toml_tables import read_tables
from cogmap.errors import ConfigError

WRITTEN = """# a comment
[start]
x_m = 1.0

[[street]]
name = "Elm Street"

[[street]]
name = "Oak Street"  # the second
width_m = 6.0
"""


class Start(msgspec.Struct, forbid_unknown_fields=True):
    """One table."""

    x_m: float


class Street(msgspec.Struct, forbid_unknown_fields=True):
    """One of several."""

    name: str
    width_m: float = 8.0


class Town(msgspec.Struct, forbid_unknown_fields=True):
    """All of them."""

    start: Start
    street: list[Street] = []


def _read(folder: Path, text: str) -> Town:
    path = folder / "town.toml"
    path.write_text(text)
    _, town = read_tables(path, Town, "town", "write one")
    return town


def test_tables_are_read_as_they_are_written(tmp_path: Path) -> None:
    town = _read(tmp_path, WRITTEN)

    assert town.start.x_m == 1.0
    assert [street.width_m for street in town.street] == [8.0, 6.0]


@pytest.mark.parametrize(
    ("before", "after", "complaint"),
    [
        ("width_m = 6.0", 'width_m = "six"', r"town\.toml:10: Expected `float`, got `str`"),
        ("width_m =", "widht_m =", r"town\.toml:10: .*unknown field `widht_m`.*mean 'width_m'\?"),
        ("x_m =", "xm =", r"town\.toml:3: .*unknown field `xm`.*did you mean 'x_m'\?"),
        ("[start]", "[strat]", r"town\.toml:2: .*unknown field `strat`.*did you mean 'start'\?"),
        ("[start]", "[start", "as TOML"),
    ],
)
def test_what_is_wrong_is_named_by_its_line(
    before: str, after: str, complaint: str, tmp_path: Path
) -> None:
    with pytest.raises(ConfigError, match=complaint):
        _read(tmp_path, WRITTEN.replace(before, after))


def test_a_file_that_is_missing_is_named_with_the_remedy(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"no town .*none\.toml: write one"):
        read_tables(tmp_path / "none.toml", Town, "town", "write one")
