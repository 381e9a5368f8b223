"""The room with cameras: its landmarks are buildings, drawn, and recognised by sensory memory and
EPAM as they are.

Buildings are larger than the landmarks of Nardini's room, so the room that is drawn is SCALE times
as large, and what is seen of it is made as much smaller. Nothing is lost by that: noise is a share
of the distance, so the model has no scale. The participant looks all around, as it does where it
receives percepts that are not drawn; posts are touched, not seen.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import msgspec

from cogmap.experiments.cue_integration import senses
from cogmap.experiments.cue_integration.geometry import POSTS, START, Point
from cogmap.experiments.cue_integration.room import Room
from cogmap.experiments.cue_integration.run import Session, respond
from cogmap.experiments.cue_integration.trial import Condition, Noise, Trial
from cogmap.experiments.rendered import named
from cogmap.parallel import Progress
from cogmap.robot import calibration
from cogmap.schemas import sensing
from cogmap.schemas.sensing import Odometry, Percept, Percepts, View
from cogmap.services import registry
from cogmap.services.codelets.rules import OURS
from cogmap.services.sim.layout import roadside
from cogmap.services.sim.rendering.camera import StereoCamera
from cogmap.services.sim.trajectory import Trajectory
from cogmap.services.sim.world import World

SCALE = 10.0
# A camera sees 75°: of what two pictures cut, another shows the whole.
LOOKS = 8
LOOK_NS = 50_000_000


class PicturedRoom(Room):
    """A room whose landmarks are seen by cameras. Close it when done."""

    def __init__(self, trial: Trial) -> None:
        super().__init__(trial)
        self._sensory = registry.build("sensory", {})
        self._epam = registry.build("epam", {})
        self._drawn = self._landmarks
        self._world, self._camera = self._open()
        self._looks = 0

    def close(self) -> None:
        """Leave the renderer."""
        self._world.close()

    def _seen(self, picked: Mapping[str, Point]) -> list[Percept]:
        """Return the buildings around that are recognised, if it is light, each as in the picture
        that shows it best, whole and in the middle; and what is being picked up.
        """
        best: dict[str, Percept] = {}
        if self._are_lit and self._drawn != self._landmarks:
            self._world.close()
            self._drawn = self._landmarks
            self._world, self._camera = self._open()

        qualities: dict[str, tuple[bool, float]] = {}
        for look in range(LOOKS if self._are_lit else 0):
            turn_rad = math.tau * look / LOOKS
            for percept in self._look(turn_rad):
                label = percept.name
                quality = (percept.whole, -abs(percept.bearing_rad))
                if label not in best or quality > qualities[label]:
                    qualities[label] = quality
                    best[label] = _turned(percept, turn_rad)

        touched = senses.sightings(self._pose, picked, self._trial.noise, self._rng)
        return [*best.values(), *touched]

    def _look(self, turn_rad: float) -> list[Percept]:
        """Return what sensory memory and EPAM recognise with the participant's head turned to the
        left.
        """
        self._looks += 1
        stamp_ns = self._looks * LOOK_NS
        x_m, y_m = _scaled(self._pose.position)
        heading_rad = self._pose.heading_rad + turn_rad
        self._world.place_robot(sensing.Pose(x_m=x_m, y_m=y_m, heading_rad=heading_rad))

        standing = Odometry(
            stamp_ns=stamp_ns, speed_m_s=0.0, turn_rate_rad_s=0.0, dt_s=LOOK_NS / 1e9
        )
        self._sensory.feed(standing)
        percepts: list[Percept] = []
        for view in self._sensory.feed(self._camera.frame(stamp_ns, self._looks)):
            if not isinstance(view, View):
                continue
            for message in self._epam.feed(view):
                if isinstance(message, Percepts):
                    percepts += message.objects

        return percepts

    def _open(self) -> tuple[World, StereoCamera]:
        places = []
        for landmark in self._drawn:
            x_m, y_m = _scaled(landmark)
            places.append({"x_m": x_m, "y_m": y_m})

        line_m = [_scaled(START), _scaled(POSTS[-1])]
        trajectory = msgspec.convert(
            {"line_m": line_m, "landmarks": named(places), "sensing": "cameras"}, Trajectory
        )
        layout = roadside.along(trajectory, self._trial.seed)
        world = World(layout)
        return world, StereoCamera(world, calibration())


def metrics(noise: Noise, seed: int, progress: Progress, rules: str = OURS) -> dict[str, float]:
    """Return the error of the response in one trial of each condition with cameras, and in the same
    with percepts that are not drawn.
    """
    found: dict[str, float] = {}

    for done, condition in enumerate(Condition, start=1):
        trial = Trial(condition, 0, noise, seed, rules)
        name = condition.value
        session = Session(trial, PicturedRoom)
        try:
            drawn = session.run()
        finally:
            session.room.close()

        drawn_m = math.dist(drawn.position, trial.target)
        percepts_m = math.dist(respond(trial).position, trial.target)

        found[f"cameras_error_{name}_m"] = drawn_m
        found[f"cameras_same_trial_by_percepts_error_{name}_m"] = percepts_m
        progress(done / len(Condition))

    return found


def _scaled(point: Point) -> Point:
    x_m, y_m = point
    return SCALE * x_m, SCALE * y_m


def _turned(percept: Percept, turn_rad: float) -> Percept:
    """Return a building seen with the head turned, as a landmark of the room."""
    return msgspec.structs.replace(
        percept,
        bearing_rad=math.remainder(percept.bearing_rad + turn_rad, math.tau),
        range_m=percept.range_m / SCALE,
        range_sd_m=percept.range_sd_m / SCALE,
        width_m=percept.width_m / SCALE,
        height_m=percept.height_m / SCALE,
    )
