"""Links of the documentation as they are in the site."""

from __future__ import annotations

import pytest

from docs.site.links import linked


@pytest.mark.parametrize(
    ("place", "link", "shown"),
    [
        ("index.md", "[towns](docs/towns.md#streets)", "[towns](towns.md#streets)"),
        ("index.md", "[reasons](docs/decisions/)", "[reasons](decisions/README.md)"),
        ("index.md", "![map](docs/drive.png)", "![map](drive.png)"),
        ("modules.md", "[all](../examples/README.md)", "[all](examples.md)"),
        ("decisions/mcap.md", "[how](../memory.md)", "[how](../memory.md)"),
        ("examples.md", "[page](../docs/modules.md)", "[page](modules.md)"),
    ],
)
def test_a_link_to_a_file_that_has_a_page_leads_there(place: str, link: str, shown: str) -> None:
    assert linked(link, place) == shown


def test_a_link_to_a_file_without_a_page_is_text() -> None:
    assert linked("see [Cargo.toml](../examples/rust/Cargo.toml)", "modules.md") == "see Cargo.toml"


def test_a_link_to_a_file_that_does_not_exist_is_refused() -> None:
    with pytest.raises(ValueError, match=r"README.md links docs/none.md, which does not exist"):
        linked("[none](docs/none.md)", "index.md")


@pytest.mark.parametrize("text", ["[a](#b)", "[a](https://example.org/b.md)", "```\n[a](b)\n```"])
def test_other_links_and_code_stay_as_they_are(text: str) -> None:
    assert linked(text, "index.md") == text
