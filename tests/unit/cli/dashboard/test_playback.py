"""A log as the source of a dashboard."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

import pytest

from cogmap.cli.dashboard import playback as playing
from cogmap.cli.dashboard.playback import Playback
from cogmap.cli.dashboard.source import Wish
from cogmap.errors import LogError, UsageError
from cogmap.recording import open_log
from cogmap.recording.storage.index import read_index
from cogmap.schemas import topics
from cogmap.schemas.sensing import View
from tests.support.reference import REFERENCE
from tests.support.system.processes import wait_until


@pytest.fixture
def playback() -> Iterator[Playback]:
    """The reference drive, which can be shown at any moment."""
    source = Playback(REFERENCE)
    wait_until(lambda: source.playing.indexed_s >= source.playing.duration_s, "all is read")
    yield source
    source.close()


def show(playback: Playback, at_s: float) -> None:
    playback.act(Wish(seek_s=at_s))
    wait_until(lambda: abs(playback.playing.at_s - at_s) < 1e-6, f"{at_s} s is shown")


def test_it_begins_at_the_beginning_and_stands(playback: Playback) -> None:
    assert playback.playing.at_s == 0.0
    assert not playback.playing.is_playing
    assert playback.playing.duration_s == pytest.approx(open_log(REFERENCE).duration_s)


@pytest.mark.parametrize("share", [0.3, 0.8, 1.0, 0.5])
def test_a_moment_has_the_graph_and_the_view_of_that_time(playback: Playback, share: float) -> None:
    log = open_log(REFERENCE)
    at_s = math.floor(1e3 * share * log.duration_s) / 1e3
    show(playback, at_s)
    views = [entry.message for entry in log.messages(topics.VIEW, end_s=at_s)]

    assert playback.scene.graph.digest() == log.graph_at(at_s).digest()
    view = playback.scene.received.message(topics.VIEW)
    assert isinstance(view, View)
    assert view.frame == views[-1].frame


def test_a_moment_is_the_same_where_little_memory_is_left(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(playing, "MAX_KEYFRAME_BYTES", 100_000)
    source = Playback(REFERENCE)
    wait_until(lambda: source.playing.indexed_s >= source.playing.duration_s, "all is read")
    log = open_log(REFERENCE)
    at_s = math.floor(1e3 * log.duration_s) / 1e3
    show(source, at_s)
    source.close()

    assert sum(len(keyframe.graph) for keyframe in source._keyframes) <= 100_000
    assert source.scene.graph.digest() == log.graph_at(at_s).digest()


def test_it_plays_to_the_end_and_stands_there(playback: Playback) -> None:
    playback.act(Wish(speed=100.0))
    playback.act(Wish(play=True))
    wait_until(lambda: playback.playing.at_s == playback.playing.duration_s, "it is at the end")
    wait_until(lambda: not playback.playing.is_playing, "it stands")

    log = open_log(REFERENCE)
    assert playback.scene.graph.digest() == log.graph_at(log.duration_s).digest()


def test_a_step_leads_to_the_next_cycle(playback: Playback) -> None:
    show(playback, round(open_log(REFERENCE).duration_s / 2, 3))
    cycle = playback.scene.graph.cycle
    playback.act(Wish(step=True))

    wait_until(lambda: playback.scene.graph.cycle > cycle, "a cycle later")
    assert playback.scene.graph.cycle <= cycle + 2


def test_what_only_a_running_system_can_do_is_refused(playback: Playback) -> None:
    with pytest.raises(UsageError, match="log"):
        playback.act(Wish(goal="bakery"))


def test_a_speed_that_makes_no_sense_is_limited(playback: Playback) -> None:
    playback.act(Wish(speed=1e9))

    assert playback.playing.speed == 100.0


def test_damage_is_said_and_what_is_before_it_is_shown(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    content = bytearray(REFERENCE.read_bytes())
    index = read_index(REFERENCE)
    of_deltas = frozenset(
        number for number, channel in index.channels.items() if channel.topic.endswith("delta")
    )
    with_deltas = [chunk for chunk in index.chunks if chunk.has_any(of_deltas)]
    content[with_deltas[-1].offset + 200] ^= 0xFF
    path.write_bytes(content)
    source = Playback(path)
    try:
        wait_until(lambda: "is damaged" in source.playing.failure, "the damage is said")
        with pytest.raises(UsageError, match="is damaged"):
            source.act(Wish(play=True))
    finally:
        source.close()


def test_what_is_no_log_is_said(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    path.write_text("nothing")

    with pytest.raises(LogError, match="not an MCAP file"):
        Playback(path)
