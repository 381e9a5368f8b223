"""docs/architecture.md agrees with the topic table and the modules."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner

from cogmap.cli.architecture import architecture, diagram, renewed, topic_table
from cogmap.errors import CogmapError, UsageError
from cogmap.runtime.module import Module
from cogmap.schemas import topics
from cogmap.schemas.topics import Scope

PAGE = Path(__file__).parents[3] / "docs" / "architecture.md"


def _modules() -> list[Module]:
    camera = Module("camera", emits={topics.STEREO, topics.ODOMETRY})
    memory = Module("memory", emits={topics.VIEW})
    memory.on(topics.STEREO, print)
    memory.on(topics.ODOMETRY, print)
    memory.serve(topics.SNAPSHOT_REQUEST, topics.SNAPSHOT, print)  # type: ignore[arg-type]
    return [camera, memory]


def test_the_page_is_what_the_code_generates() -> None:
    page = PAGE.read_text()

    assert renewed(page) == page, "write it anew with `cogmap architecture`"


def test_modules_are_boxes_and_topics_are_arrows_by_their_delivery() -> None:
    drawn = diagram(_modules())

    assert '    camera["camera"]\n' in drawn
    assert '    camera -->|"camera/stereo"| memory\n' in drawn
    assert '    camera ==>|"odometry"| memory\n' in drawn
    assert '    memory -->|"sensory/view"| observers\n' in drawn
    assert '    observers -.->|"workspace/snapshot_request"| memory\n' in drawn


def test_the_table_has_a_row_for_each_topic() -> None:
    rows = topic_table(_modules()).splitlines()[2:]

    assert [row.split("`")[1] for row in rows] == [topic.name for topic in topics.ALL]
    assert (
        "| `camera/stereo` | StereoFrame | 5 Hz | latest wins | model | camera | memory |" in rows
    )


def test_the_page_shows_no_arrow_of_the_truth_into_a_module() -> None:
    truth = [topic.name for topic in topics.ALL if topic.scope is Scope.TRUTH]
    arrows = [
        line
        for line in PAGE.read_text().splitlines()
        if "|" in line and any(name in line for name in truth)
    ]

    assert arrows
    assert all(line.rstrip(" |").endswith("observers") for line in arrows)


def test_a_page_that_is_out_of_date_fails_the_check(
    tmp_path: Path,
) -> None:
    page = tmp_path / "page.md"
    page.write_text(PAGE.read_text().replace("sensory/view", "sensory/sight"))
    check = CliRunner().invoke(architecture, ["--check", str(page)])
    assert isinstance(check.exception, CogmapError)
    assert "cogmap architecture" in str(check.exception)

    write = CliRunner().invoke(architecture, [str(page)])
    assert write.exit_code == 0
    assert page.read_text() == PAGE.read_text()


@pytest.mark.parametrize("text", ["", "<!-- diagram: generated -->\n<!-- end of diagram -->"])
def test_a_page_without_a_place_for_a_part_is_named(text: str) -> None:
    with pytest.raises(UsageError, match="has no place for its"):
        renewed(text)


def test_a_page_that_is_not_there_is_named_with_the_remedy(tmp_path: Path) -> None:
    absent = tmp_path / "none.md"
    run = CliRunner().invoke(architecture, [str(absent)])

    assert isinstance(run.exception, UsageError)
    assert "run this in the sources" in str(run.exception)
