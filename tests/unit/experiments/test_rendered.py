"""Experiments with rendered cameras instead of made-up percepts."""

from __future__ import annotations

import math
from collections.abc import Sequence

import pytest

from cogmap.cli.experiment import live
from cogmap.errors import CogmapError
from cogmap.experiments.cue_integration.camera_level import PicturedRoom
from cogmap.experiments.cue_integration.geometry import LANDMARKS
from cogmap.experiments.cue_integration.run import FITTED
from cogmap.experiments.cue_integration.trial import Condition, Trial
from cogmap.experiments.loop_closing.run import COGNITION, sections
from cogmap.experiments.rendered import by_cameras, named, with_cameras
from cogmap.experiments.transcript import MODEL, Transcript
from cogmap.runtime.config import Sections
from cogmap.runtime.in_process import InProcessRunner
from cogmap.runtime.module import Module
from cogmap.schemas import topics
from cogmap.schemas.cognition import Action
from cogmap.schemas.sensing import MotorCommand, Percepts

FRAMES = 5


def _short() -> Sections:
    """The way of figure 6, as far as its first building."""
    configured = sections(1, "heading")
    way = configured["sim"]["trajectory"]
    way["line_m"] = [(0.0, 0.0), (10.0, 0.0)]
    return configured


def _heard(configured: Sections, modules: Sequence[Module]) -> Transcript:
    heard = Transcript(MODEL)
    runner = InProcessRunner([*modules, heard.module()])
    runner.run()
    runner.close()
    return heard


def test_a_replayed_sensor_log_gives_the_bytes_that_the_senses_would() -> None:
    shares: list[float] = []
    both = by_cameras({"first": _short(), "again": _short()}, COGNITION, _heard, shares.append)
    first = both["first"].messages
    again = both["again"].messages
    commands = first[topics.MOTOR_COMMAND.name]
    deltas = first[topics.DELTA.name]

    assert len(first[topics.PERCEPTS.name]) == FRAMES
    assert len(commands) == FRAMES
    assert again[topics.MOTOR_COMMAND.name] == commands
    assert again[topics.DELTA.name] == deltas
    assert shares == sorted(shares)
    assert shares[-1] == 1.0


def test_with_cameras_landmarks_become_buildings_of_the_catalogue() -> None:
    told = sections(1, "heading")
    simulated = with_cameras(told)["sim"]
    seen_along = simulated["trajectory"]
    names = [landmark["name"] for landmark in seen_along["landmarks"]]

    assert names[:2] == ["bakery", "library"]
    assert seen_along["sensing"] == "cameras"
    assert "percepts" not in simulated
    members = {**told["run"]["participants"], "sensory": 1, "epam": 1}
    assert with_cameras(told)["run"]["participants"] == members
    assert "sensing" not in told["sim"]["trajectory"]


def test_more_landmarks_than_there_are_kinds_of_building_are_refused() -> None:
    landmarks = [{"x_m": 20.0 * k, "y_m": 14.0} for k in range(25)]

    with pytest.raises(CogmapError, match="too few for 25"):
        named(landmarks)


def test_the_room_with_cameras_sees_its_landmarks_where_they_are() -> None:
    room = PicturedRoom(Trial(Condition.BOTH, 0, FITTED, 1))
    try:
        _, percepts = room.begin()
    finally:
        room.close()

    assert isinstance(percepts, Percepts)
    seen = {each.name: each for each in percepts.objects}
    names = ("bakery", "library", "town_hall")
    for name, (x_m, y_m) in zip(names, LANDMARKS, strict=True):
        forward_m = y_m - 0.0
        left_m = 2.5 - x_m
        range_m = math.hypot(forward_m, left_m)
        bearing_rad = math.atan2(left_m, forward_m)

        assert seen[name].range_m == pytest.approx(range_m, rel=0.1)
        assert seen[name].bearing_rad == pytest.approx(bearing_rad, abs=0.05)


def test_nothing_is_seen_in_the_dark() -> None:
    wait = Action(stamp_ns=1, cycle=1, scheme="wait", activation=1.0, parameters={})
    step = {"turn_rad": 0.0, "forward_m": 0.1}
    walk = Action(stamp_ns=2, cycle=2, scheme="walk", activation=1.0, parameters=step)

    room = PicturedRoom(Trial(Condition.SELF_MOTION, 0, FITTED, 1))
    try:
        room.act(wait)
        _, percepts = room.act(walk)
    finally:
        room.close()

    assert isinstance(percepts, Percepts)
    assert percepts.objects == []


def _commanded(left_rad_s: float) -> Transcript:
    """A transcript of one command to the wheels."""
    heard = Transcript([topics.MOTOR_COMMAND, topics.DELTA])
    command = MotorCommand(stamp_ns=1, left_wheel_rad_s=left_rad_s, right_wheel_rad_s=1.0)
    heard.module().feed(command)
    return heard


def test_bytes_that_differ_are_named_by_their_topic_and_end_the_command() -> None:
    one = _commanded(1.0)
    other = _commanded(2.0)

    assert one.has_as_many_as(other)
    assert one.differs_from(other) == ["motor/command"]

    live.check(one.differs_from(one))
    with pytest.raises(CogmapError, match="other bytes on motor/command"):
        live.check(one.differs_from(other))
