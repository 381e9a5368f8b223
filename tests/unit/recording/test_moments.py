"""What of a drive other tools show, and when."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from cogmap.recording import open_log
from cogmap.recording.exporting.moments import Moment, moments
from cogmap.schemas import topics
from cogmap.schemas.base import Message
from cogmap.schemas.nodes import Need, Self
from cogmap.testing import agent
from tests.support.logs import SECOND_NS, delta, scan, write_log


def shown(folder: Path, rows: Iterable[tuple[int, Message]]) -> list[Moment]:
    log = open_log(write_log(folder / "log.mcap", rows))
    return list(moments(log, (topics.SCAN,)))


def test_a_drive_that_is_joined_late_has_the_time_of_its_log(tmp_path: Path) -> None:
    first = scan(0, stamp_ns=100 * SECOND_NS)
    second = scan(1, stamp_ns=102 * SECOND_NS)

    found = shown(tmp_path, [(7 * SECOND_NS, first), (8 * SECOND_NS, second)])

    assert [each.stamp_ns for each in found] == [7 * SECOND_NS, 9 * SECOND_NS]
    assert [each.time_s for each in found] == [0.0, 1.0]


def test_each_change_of_a_need_is_shown(tmp_path: Path) -> None:
    needs = [Need(id="need:energy", label="energy", level=level) for level in (0.25, 0.5)]
    deltas = [delta(version, need) for version, need in enumerate(needs, 1)]

    found = shown(tmp_path, [(each.version * SECOND_NS, each) for each in deltas])

    assert [each.content for each in found] == needs


def test_the_agent_is_shown_where_it_believes_to_be(tmp_path: Path) -> None:
    believed = agent(x_m=3.0, y_m=4.0)
    found = shown(tmp_path, [(SECOND_NS, delta(1, believed))])

    poses = [each.content for each in found if isinstance(each.content, Self)]
    assert poses == [believed]
