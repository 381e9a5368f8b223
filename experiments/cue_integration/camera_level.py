"""The room with cameras: its landmarks are buildings, drawn, and recognised by sensory memory and
EPAM as they are.

Buildings are larger than the landmarks of Nardini's room, so the room that is drawn is SCALE times
as large, and what is seen of it is made as much smaller. Nothing is lost by that: noise is a share
of the distance, so the model has no scale. The participant looks all around, as it does where it is
told percepts; posts are touched, not seen.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import msgspec

from cogmap.parallel import Progress
from experiments.cue_integration import senses
from experiments.cue_integration.geometry import POSTS, START, Point
from experiments.cue_integration.room import Room
from experiments.cue_integration.run import Session, respond
from experiments.cue_integration.trial import Condition, Noise, Response, Trial
from experiments.rendered import SENSES, named
from schemas import sensing
from schemas.sensing import Odometry, Percept, Percepts, View
from services import registry
from services.sim.layout import roadside
from services.sim.rendering.camera import StereoCamera, calibration
from services.sim.scripted.trajectory import Trajectory
from services.sim.world import World

SCALE = 10.0
# A camera sees 75°: of what two pictures cut, another shows the whole.
LOOKS = 8
LOOK_NS = 50_000_000


class PicturedRoom(Room):
    """A room whose landmarks are seen by cameras. Close it when done."""

    def __init__(self, trial: Trial) -> None:
        super().__init__(trial)
        self._sensory, self._epam = (registry.build(name, {}) for name in SENSES)
        self._drawn = self._landmarks
        self._world, self._camera = self._open()
        self._looks = 0

    def close(self) -> None:
        """Leave the renderer."""
        self._world.close()

    def _seen(self, picked: Mapping[str, Point]) -> list[Percept]:
        """The buildings around that are recognised, if it is light, and what is being picked up."""
        touched = senses.sightings(self._pose, picked, self._trial.noise, self._rng)
        return [*(self._around() if self._are_lit else []), *touched]

    def _around(self) -> list[Percept]:
        """Each building once, as in the picture that shows it best: whole, and in the middle."""
        if self._drawn != self._landmarks:
            self._world.close()
            self._drawn = self._landmarks
            self._world, self._camera = self._open()
        best: dict[str, tuple[bool, float, Percept]] = {}
        for turn_rad in (math.tau * look / LOOKS for look in range(LOOKS)):
            for percept in self._look(turn_rad):
                quality = percept.whole, -abs(percept.bearing_rad), _turned(percept, turn_rad)
                if percept.label not in best or quality[:2] > best[percept.label][:2]:
                    best[percept.label] = quality
        return [percept for _, _, percept in best.values()]

    def _look(self, turn_rad: float) -> list[Percept]:
        """What EPAM says of a view, the participant's head turned so far to the left."""
        here = self._pose
        self._looks = self._looks + 1
        self._world.place_robot(
            sensing.Pose(
                x_m=SCALE * here.x_m, y_m=SCALE * here.y_m, heading_rad=here.heading_rad + turn_rad
            )
        )
        stamp_ns = self._looks * LOOK_NS
        self._sensory.feed(
            Odometry(stamp_ns=stamp_ns, speed_m_s=0.0, turn_rate_rad_s=0.0, dt_s=LOOK_NS / 1e9)
        )
        felt = self._sensory.feed(self._camera.frame(stamp_ns, self._looks))
        said = [each for view in felt if isinstance(view, View) for each in self._epam.feed(view)]
        return [percept for each in said if isinstance(each, Percepts) for percept in each.objects]

    def _open(self) -> tuple[World, StereoCamera]:
        line_m = [_scaled(START), _scaled(POSTS[-1])]
        places = [dict(zip(("x_m", "y_m"), _scaled(each), strict=True)) for each in self._drawn]
        way = msgspec.convert(
            {"line_m": line_m, "landmarks": named(places), "sensing": "cameras"}, Trajectory
        )
        world = World(roadside.along(way, self._trial.seed))
        return world, StereoCamera(world, calibration())


def metrics(noise: Noise, seed: int, progress: Progress) -> dict[str, float]:
    """How far off the response is in one trial of each condition with cameras, and in the same told
    percepts.
    """
    found: dict[str, float] = {}
    for done, condition in enumerate(Condition, start=1):
        trial = Trial(condition, 0, noise, seed)
        found[f"cameras_error_{condition.value}_m"] = _error_m(trial, _respond(trial))
        found[f"cameras_same_trial_by_percepts_error_{condition.value}_m"] = _error_m(
            trial, respond(trial)
        )
        progress(done / len(Condition))
    return found


def _respond(trial: Trial) -> Response:
    session = Session(trial, PicturedRoom)
    try:
        return session.run()
    finally:
        session.room.close()


def _error_m(trial: Trial, response: Response) -> float:
    return math.dist((response.x_m, response.y_m), trial.target)


def _scaled(point: Point) -> Point:
    return SCALE * point[0], SCALE * point[1]


def _turned(percept: Percept, turn_rad: float) -> Percept:
    """A building seen with the head turned, as a landmark of the room."""
    return msgspec.structs.replace(
        percept,
        bearing_rad=math.remainder(percept.bearing_rad + turn_rad, math.tau),
        range_m=percept.range_m / SCALE,
        range_sd_m=percept.range_sd_m / SCALE,
        width_m=percept.width_m / SCALE,
        height_m=percept.height_m / SCALE,
    )
