"""Settings of perception: each described, each bounded."""

from __future__ import annotations

import msgspec
import pytest

from cogmap.services.epam.config import Config

BOUNDED = ["percept_threshold"]


def test_every_setting_has_a_description() -> None:
    for schema in msgspec.json.schema(Config)["$defs"].values():
        for name, setting in schema["properties"].items():
            assert setting.get("description"), name


@pytest.mark.parametrize("key", BOUNDED)
@pytest.mark.parametrize("value", [float("inf"), float("nan"), -1, 1e6])
def test_infinite_and_absurd_settings_are_refused(key: str, value: float) -> None:
    with pytest.raises(msgspec.ValidationError, match=key):
        msgspec.convert({key: value}, Config)
