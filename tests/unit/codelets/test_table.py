"""The table of codelets, with those of other packages."""

from __future__ import annotations

from importlib.metadata import EntryPoint

import pytest

from cogmap.errors import ConfigError
from cogmap.runtime.codelet import ENTRY_POINTS
from cogmap.services.codelets import table


def _installed(monkeypatch: pytest.MonkeyPatch, value: str) -> None:
    """Have one entry point of that value, as an installed package would."""
    point = EntryPoint("strange", value, ENTRY_POINTS)
    monkeypatch.setattr(table, "entry_points", lambda group: [point])


def test_our_codelets_are_there_without_any_other_package(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(table, "entry_points", lambda group: [])

    assert table.all_codelets() == table.own_codelets()


def test_a_package_that_cannot_be_imported_is_named_with_the_remedy(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    _installed(monkeypatch, "no_such_package:CODELET")

    with pytest.raises(ConfigError, match=r"no_such_package:CODELET cannot be .*uninstall"):
        table.all_codelets()


def test_an_entry_point_that_is_no_codelet_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    _installed(monkeypatch, "math:pi")

    with pytest.raises(ConfigError, match=r"strange = math:pi is no Codelet"):
        table.all_codelets()


def test_two_codelets_of_one_name_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    _installed(monkeypatch, "cogmap.services.codelets.mapping.path:CODELET")

    with pytest.raises(ConfigError, match="there is a codelet 'path'"):
        table.all_codelets()


def test_the_sections_are_those_of_our_codelets() -> None:
    configurable = [codelet for codelet in table.own_codelets() if codelet.section]

    assert table.own_settings() == {each.section: each.config for each in configurable}
