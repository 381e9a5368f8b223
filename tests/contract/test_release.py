"""A release has one version, in the code, the changelog and the citation."""

from __future__ import annotations

import pytest

from cogmap.version import VERSION
from tests.support.includes import ROOT
from tests.support.release import problems

CHANGELOG = "# Changelog\n\n## 1.1.0\n\n- News.\n\n## 1.0.0\n\n- The first.\n"
CITATION = "title: Cogmap\nversion: 1.1.0\n"


def test_this_version_is_in_changelog_and_citation() -> None:
    changelog = (ROOT / "CHANGELOG.md").read_text()
    citation = (ROOT / "CITATION.cff").read_text()

    assert problems(VERSION, changelog, citation, tags=()) == []


@pytest.mark.parametrize(
    ("version", "tags", "problem"),
    [
        ("1.2.0", (), "CHANGELOG.md has no section 1.2.0 with text"),
        ("1.0.0", (), "CHANGELOG.md begins with 1.1.0, not with 1.0.0"),
        ("1.0.0", (), "CITATION.cff has the version 1.1.0, not 1.0.0"),
        ("1.1.0", ("v1.0.0", "v1.1.0"), "v1.1.0 is tagged already"),
    ],
)
def test_a_release_that_is_not_ready_is_refused(
    version: str, tags: tuple[str, ...], problem: str
) -> None:
    found = problems(version, CHANGELOG, CITATION, tags)

    assert any(sentence.startswith(problem) for sentence in found)


def test_a_section_without_text_is_no_section() -> None:
    empty = CHANGELOG.replace("- News.\n", "")

    assert problems("1.1.0", empty, CITATION, ())
