"""The picture of a cycle: complete, legible, the same each time."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import cv2
import numpy as np
import pytest
from click.testing import CliRunner
from msgspec import structs

from cogmap.cli.explain import choice
from cogmap.cli.explain.drawing import deciding, lettering, sensing
from cogmap.cli.explain.drawing.blocks import Bar, Words
from cogmap.cli.explain.drawing.box import MOST, Box, inner_in
from cogmap.cli.explain.drawing.figure import figure
from cogmap.cli.explain.drawing.robot import Robot
from cogmap.cli.explain.moment import Moment, moment
from cogmap.cli.main import cogmap
from cogmap.cli.plots.palette import ESTIMATE, PLAN
from cogmap.errors import LogError
from cogmap.recording.log import open_log
from cogmap.schemas.array import Array
from tests.support.cycles import Cycles, percepts
from tests.support.logs import write_log
from tests.support.reference import REFERENCE

LABELS = [f"a_building_of_a_rather_long_name_{number}" for number in range(MOST + 3)]


@pytest.fixture(scope="module")
def reference() -> Moment:
    """A cycle of the reference drive."""
    log = open_log(REFERENCE)
    cycle = choice.last_broadcast(log)
    return moment(log, cycle.number, cycle.stamp_ns)


def of_cycle(path: Path, number: int) -> Moment:
    """A made-up cycle: the first has a broadcast, the second none; there are no views."""
    cycles = Cycles()
    cycles.add(1, novelty=0.9, whereabouts=0.4)
    cycles.add(2, novelty=0.9)
    log = open_log(write_log(path / "drive.mcap", cycles.rows))
    cycle = choice.numbered(log, number)
    return moment(log, cycle.number, cycle.stamp_ns)


def words(box: Box) -> list[str]:
    """Every line of a box, from its top."""
    lines: list[str] = []
    for block in box.blocks:
        if isinstance(block, Words):
            lines += block.lines
    return lines


def bars(box: Box) -> list[Bar]:
    return [block for block in box.blocks if isinstance(block, Bar)]


def test_a_picture_has_the_same_bytes_each_time(reference: Moment) -> None:
    for suffix, beginning in ((".png", b"\x89PNG"), (".svg", b"<?xml")):
        first = figure(reference, suffix)

        assert first.startswith(beginning)
        assert figure(reference, suffix) == first


def test_a_picture_is_drawn_from_view_to_wheels_by_the_command(tmp_path: Path) -> None:
    target = tmp_path / "cycle.png"
    words = ["explain", str(REFERENCE), "--picture", str(target)]
    printed = CliRunner().invoke(cogmap, words, standalone_mode=False).stdout

    drawn = cv2.imread(str(target))
    assert drawn is not None
    assert drawn.shape[1] > 2 * drawn.shape[0]
    assert f"{target}: cycle " in printed


def test_the_view_is_in_the_picture(reference: Moment) -> None:
    assert reference.view is not None
    red = np.zeros_like(reference.view.message.image.numpy())
    red[..., 0] = 255
    view = structs.replace(reference.view.message, image=Array.of(red))
    logged = type(reference.view)(view, reference.view.time_s, reference.view.after_ms)

    drawn = cv2.imdecode(np.frombuffer(figure(_with(reference, view=logged), ".png"), np.uint8), 1)
    assert drawn is not None
    is_red = (drawn == (0, 0, 255)).all(axis=-1)
    rows, columns = np.nonzero(is_red)
    assert np.ptp(columns) / np.ptp(rows) == pytest.approx(96 / 72, rel=0.05)
    assert columns.max() < drawn.shape[1] / 6


def test_a_view_that_is_no_image_is_named(reference: Moment) -> None:
    assert reference.view is not None
    grey = reference.view.message.image.numpy()[..., 0]
    view = structs.replace(reference.view.message, image=Array.of(grey))
    logged = type(reference.view)(view, 0.0, None)

    with pytest.raises(LogError, match=r"reference\.mcap, frame \d+: expected a uint8 image"):
        figure(_with(reference, view=logged), ".png")


def test_the_winner_and_the_chosen_behaviour_are_marked(tmp_path: Path) -> None:
    found = of_cycle(tmp_path, 1)

    contenders = bars(deciding.coalitions(found))
    behaviours = bars(deciding.behaviours(found))
    assert [bar.share for bar in contenders] == [0.9, 0.4]
    assert [bar.colour == ESTIMATE for bar in contenders] == [True, False]
    assert {bar.threshold for bar in contenders} == {0.45}
    assert [bar.share for bar in behaviours] == [0.9, 0.4]
    assert [bar.colour == PLAN for bar in behaviours] == [True, False]


def test_a_cycle_without_a_broadcast_shows_what_was_conscious_before(tmp_path: Path) -> None:
    found = of_cycle(tmp_path, 2)
    broadcast = deciding.broadcast(found)

    assert broadcast.is_empty
    assert deciding.behaviours(found).is_empty
    assert "last, in cycle 1, 0.10 s before:" in " ".join(words(broadcast))
    assert figure(found, ".svg").startswith(b"<?xml")


def test_what_has_no_room_is_counted_and_names_are_cut(tmp_path: Path) -> None:
    found = of_cycle(tmp_path, 1)
    assert found.percepts is not None
    many = type(found.percepts)(percepts(1, *LABELS), 0.0, 0.0)
    box = sensing.percepts(_with(found, percepts=many))

    assert len(bars(box)) == MOST
    assert words(box)[-1] == "and 3 more"
    assert words(box)[0].endswith(lettering.ELLIPSIS)


def test_every_line_fits_its_box(reference: Moment) -> None:
    boxes = [
        sensing.percepts(reference),
        sensing.workspace(reference),
        deciding.coalitions(reference),
        deciding.broadcast(reference),
        deciding.behaviours(reference),
        deciding.command(reference),
    ]
    for box in boxes:
        for block in box.blocks:
            for line in block.lines if isinstance(block, Words) else []:
                assert lettering.width_of(line, block.size) <= inner_in(box.width_in)


def test_lines_break_between_words_and_say_that_they_go_on() -> None:
    lines = lettering.wrapped("one two three four five six seven", 0.6, 8.5, most=2)

    assert len(lines) == 2
    assert lines[0] == "one two"
    assert lines[1].endswith(lettering.ELLIPSIS)
    assert lettering.wrapped("", 1.0, 8.5) == []


def test_a_robot_takes_room_for_its_arrows() -> None:
    standing = Robot(0.0, 0.0, "k").height_in
    ahead = Robot(10.0, 5.0, "k").height_in
    turning = Robot(-10.0, 10.0, "k").height_in

    assert standing < ahead < turning


def _with(found: Moment, **changes: object) -> Moment:
    """The moment with other messages."""
    return dataclasses.replace(found, **changes)
