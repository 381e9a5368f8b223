"""A log as the source of a dashboard: shown at any moment, or played."""

from __future__ import annotations

import gc
import threading
import time
from bisect import bisect_right
from collections.abc import Iterator
from dataclasses import dataclass
from operator import attrgetter
from pathlib import Path

import lz4.frame

from cogmap.bus.codec import decode, encode
from cogmap.cli.dashboard.received import Arrived, Received
from cogmap.cli.dashboard.scene import FOLLOWED, Scene
from cogmap.cli.dashboard.source import Playing, Wish
from cogmap.errors import LogError, MessageError, UsageError
from cogmap.graph.graph import Graph
from cogmap.recording.log import recorded_config
from cogmap.recording.storage.reader import LogReader, Record
from cogmap.runtime import config
from cogmap.schemas import topics
from cogmap.schemas.graph import Delta, Snapshot
from cogmap.services.codelets.public import PlanningConfig
from cogmap.services.global_workspace.config import Config

KEYFRAME_S = 1.0
"""A moment is shown by the keyframe before it and what follows: some 100 messages of a town."""

MAX_KEYFRAME_BYTES = 256 * 2**20
"""What keyframes take at most: if they take more, they are spaced twice as far. That is every
second of five minutes in a town of 600 m.
"""

VIEW_BACK_S = 2.0
"""The view of a moment is looked for so far back."""

TICK_S = 0.05
SPEEDS = (0.1, 100.0)
_SMALL = tuple(topic for topic in FOLLOWED if not topic.carries_images)


@dataclass(frozen=True)
class Keyframe:
    """All that is shown at `at_ns` of the log: the graph as compressed bytes, and the rest."""

    at_ns: int
    graph: bytes
    received: Received


class Playback:
    """The log at `path`, from its beginning. Keyframes are made in the background; a moment can be
    shown once they have come so far. Raises LogError if it cannot be read.
    """

    def __init__(self, path: Path) -> None:
        self._reader = LogReader(path)
        self.label = str(self._reader.path)
        self.lock = threading.Lock()
        sections = recorded_config(self._reader)
        self._settings = config.recorded(sections, "global_workspace", Config)
        self._planning = config.recorded(sections, "planning", PlanningConfig)
        self.scene = self._new_scene()

        self._begin_ns, self._end_ns = self._reader.span_ns
        self._at_ns = self._begin_ns
        self._keyframes = [self._keyframe(self.scene, self._begin_ns)]
        self._indexed_ns = self._begin_ns
        self._is_playing = False
        self._speed = 1.0
        self._seek_ns: int | None = self._begin_ns
        self._steps = 0
        self._coming: Iterator[Record] = iter(())
        self._next: Record | None = None
        self._changed = threading.Event()
        self._has_ended = False
        self._failure = ""
        self._threads = [
            threading.Thread(target=work, daemon=True) for work in (self._index, self._play)
        ]
        for thread in self._threads:
            thread.start()

    @property
    def is_there(self) -> bool:
        """Return true: a log is there."""
        return True

    @property
    def playing(self) -> Playing:
        """Return how far it is played."""
        return Playing(
            at_s=self._seconds(self._at_ns),
            duration_s=self._seconds(self._end_ns),
            indexed_s=self._seconds(self._indexed_ns),
            is_playing=self._is_playing,
            speed=self._speed,
            failure=self._failure,
        )

    def watched(self, by: int) -> None:
        """Do nothing: who does not watch does not play."""

    def act(self, wish: Wish) -> str:
        """Play, stop, step, or show another moment. Raises UsageError for what a log cannot do."""
        if self._failure:
            raise UsageError(self._failure)
        if wish.seek_s is not None:
            wanted_ns = self._begin_ns + round(max(0.0, wish.seek_s) * 1e9)
            self._seek_ns = min(wanted_ns, self._end_ns)
            done = f"{self._seconds(self._seek_ns):.1f} s into the log"
        elif wish.play is not None:
            self._is_playing = wish.play
            done = "playing" if wish.play else "paused"
        elif wish.step:
            self._is_playing = False
            self._steps += 1
            done = "one cycle on"
        elif wish.speed is not None:
            slowest, fastest = SPEEDS
            self._speed = min(max(wish.speed, slowest), fastest)
            done = f"{self._speed:g} times as fast as it was"
        else:
            raise UsageError("nothing can be done in a log: it is over")
        self._changed.set()
        return done

    def close(self) -> None:
        """End what goes on in the background."""
        self._has_ended = True
        self._changed.set()
        for thread in self._threads:
            thread.join()

    def _seconds(self, at_ns: int) -> float:
        return (at_ns - self._begin_ns) / 1e9

    def _new_scene(self) -> Scene:
        graph = Graph()

        def follow(delta: Delta, _incarnation: int | None) -> None:
            graph.apply(delta)

        return Scene(graph, follow, self._settings, self._planning, Path(self.label))

    def _keyframe(self, scene: Scene, at_ns: int) -> Keyframe:
        content = lz4.frame.compress(encode(scene.graph.snapshot()))
        return Keyframe(at_ns, content, scene.received.copy())

    def _index(self) -> None:
        """Go through the log once, and leave keyframes."""
        reader = LogReader(self._reader.path)
        scene = self._new_scene()
        spacing_ns = round(KEYFRAME_S * 1e9)
        n_bytes = 0
        try:
            for record in reader.records(_SMALL):
                if self._has_ended:
                    return

                if record.log_time_ns >= self._keyframes[-1].at_ns + spacing_ns:
                    keyframe = self._keyframe(scene, record.log_time_ns)
                    n_bytes += len(keyframe.graph)
                    self._keyframes.append(keyframe)
                    self._indexed_ns = record.log_time_ns
                if n_bytes > MAX_KEYFRAME_BYTES:
                    self._keyframes = self._keyframes[::2]
                    n_bytes = sum(len(keyframe.graph) for keyframe in self._keyframes)
                    spacing_ns *= 2
                _take(scene, reader, record)
        except LogError as error:
            self._failure = str(error)
        self._indexed_ns = self._end_ns
        # Half a million objects of keyframes stay: to look through them for garbage takes longer
        # than to show a moment.
        gc.freeze()

    def _play(self) -> None:
        """Show what is asked for, and go on while it plays."""
        last_s = time.monotonic()
        while not self._has_ended:
            now_s = time.monotonic()
            try:
                self._go_on(now_s - last_s)
            except LogError as error:
                self._failure = str(error)
                self._is_playing = False
            last_s = now_s
            self._changed.wait(TICK_S if self._is_playing else None)
            self._changed.clear()

    def _go_on(self, passed_s: float) -> None:
        """Show the moment that is asked for, or what follows if it plays."""
        if self._seek_ns is not None:
            wanted_ns = self._seek_ns
            self._seek_ns = None
            self._steps = 0
            self._show(wanted_ns)
        elif self._steps:
            self._steps -= 1
            self._advance(self._end_ns, self.scene.graph.cycle + 1)
        elif self._is_playing:
            passed_ns = round(passed_s * self._speed * 1e9)
            self._advance(min(self._at_ns + passed_ns, self._end_ns))
            self._is_playing = self._at_ns < self._end_ns

    def _show(self, at_ns: int) -> None:
        """Show the moment `at_ns`, by the keyframe before it."""
        keyframes = self._keyframes
        later = bisect_right(keyframes, at_ns, key=attrgetter("at_ns"))
        keyframe = keyframes[max(0, later - 1)]
        snapshot = decode(topics.SNAPSHOT, lz4.frame.decompress(keyframe.graph))
        assert isinstance(snapshot, Snapshot)

        scene = self._new_scene()
        scene.graph.load(snapshot)
        scene.received = keyframe.received.copy()
        between = self._reader.records(_SMALL, start_ns=keyframe.at_ns, end_ns=at_ns + 1)
        for record in between:
            _take(scene, self._reader, record)
        back_ns = max(self._begin_ns, at_ns - round(VIEW_BACK_S * 1e9))
        views = list(self._reader.records([topics.VIEW], start_ns=back_ns, end_ns=at_ns + 1))
        if views:
            _take(scene, self._reader, views[-1])

        self._coming = self._reader.records(FOLLOWED, start_ns=at_ns + 1)
        self._next = next(self._coming, None)
        with self.lock:
            scene.follow_on(self.scene)
            self.scene = scene
            self._at_ns = at_ns

    def _advance(self, until_ns: int, cycle: int | None = None) -> None:
        """Take account of what was received up to `until_ns`, or to the end of `cycle`."""
        while self._next is not None and self._next.log_time_ns <= until_ns:
            record = self._next
            with self.lock:
                _take(self.scene, self._reader, record)
                self._at_ns = record.log_time_ns
            self._next = next(self._coming, None)
            if cycle is not None and self.scene.graph.cycle > cycle:
                return
        self._at_ns = until_ns


def _take(scene: Scene, reader: LogReader, record: Record) -> None:
    """Have a scene take account of a message of the log; one that cannot be read is left out."""
    try:
        message = reader.message(record)
    except MessageError:
        return
    scene.take(record.topic, Arrived(message, record.envelope, record.log_time_ns))
