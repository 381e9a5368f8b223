"""The pages of the reference."""

from __future__ import annotations

import nbformat
import pytest

from cogmap.cli.main import VERBS
from cogmap.schemas import topics
from cogmap.services import registry
from docs.site import reference
from docs.site.links import ROOT, TUTORIAL
from docs.site.notebook import markdown_of


def test_every_command_is_described() -> None:
    page = reference.commands()

    for name in VERBS.keys() - set(reference.ALIASES):
        assert f"\n## {name}\n" in page
        assert f"Usage: cogmap {name} " in page
    assert "Usage: cogmap log summary " in page


def test_every_modules_settings_are_described() -> None:
    page = reference.settings()

    assert "cruise_m_s = 4.0" in page
    assert [name for name in registry.sections() if f"\n[{name}]\n" not in page] == []


@pytest.mark.parametrize("topic", topics.ALL, ids=lambda topic: topic.name)
def test_every_message_is_described(topic: topics.Topic) -> None:
    page = reference.messages()

    assert f"| `{topic.name}` | {topic.type.__name__} |" in page
    assert f"\n## {topic.type.__name__}\n" in page


def test_the_tutorial_has_every_cell_with_what_it_shows() -> None:
    notebook = nbformat.read(ROOT / TUTORIAL, as_version=4)
    page = markdown_of(ROOT / TUTORIAL)

    assert [cell.source for cell in notebook.cells if cell.source not in page] == []
    assert page.count("<img ") == 2
