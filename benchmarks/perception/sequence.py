"""Places recognised by the views that lead to them: loops in held-out towns driven twice, each time
in another light.

The second lap has another speed, does not keep to the line and does not look straight ahead. One
memory sees all laps and all towns, which share most kinds of building, and a side street between
the laps: so there is much to mistake.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from benchmarks.report import Metrics
from cogmap.geometry.polylines import distances_along
from schemas.sensing import PlaceMatch, Pose
from services.epam.places.recognizer import PlaceRecognizer
from services.sensory.disparity import DepthFromStereo
from services.sensory.rectify import rectification
from services.sim.layout import town
from services.sim.layout.plan import Point
from services.sim.rendering.camera import StereoCamera, calibration
from services.sim.rendering.light import Light, some_light
from services.sim.world import World
from training.rendering import towns

Floats = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]

# The last town is built of kinds that nobody was taught alone: no landmark in any view.
TOWNS = ((3201, 0), (3202, 0), (3203, 28))
FIRST_LAP, SIDE_STREET, SECOND_LAP = range(3)
STEP_M = (0.8, 0.8)
STEPS_M = (0.6, 1.1)
OFFSET_M = 0.5
TURN_RAD = math.radians(3)
CORNER_M = 6.0
SPACING_M = 0.1
SPEED_CHANGES_M = 10.0
OFFSET_CHANGES_M = 8.0
TURN_CHANGES_M = 4.0
NEAREST_M = 2.5
SAME_M = 3.0
SAME_RAD = math.radians(30)
PRECISION = 0.99
FRAME_NS = 400_000_000


@dataclass(frozen=True)
class Stretch:
    """Poses one after the other, all in one light."""

    part: int
    light: Light
    poses: list[Pose]


@dataclass(frozen=True)
class Answer:
    """Where a view was taken, in which town and on which part of the drive, and what it was said to
    match.
    """

    seed: int
    part: int
    pose: Pose
    match: PlaceMatch | None


def measure() -> Metrics:
    """The metrics of place recognition, of all TOWNS driven one after the other."""
    recognizer = PlaceRecognizer()
    answers = list[Answer]()

    for seed, invented in TOWNS:
        answers += drive(recognizer, len(answers), _town(seed, invented))

    return metrics(answers)


def drive(recognizer: PlaceRecognizer, first_frame: int, place: town.Town) -> Iterator[Answer]:
    """Drive through a town and ask `recognizer` at each view; frames count from `first_frame`."""
    world = World(place)

    try:
        camera = StereoCamera(world, calibration())
        straight = rectification(camera.calibration)
        stereo = DepthFromStereo(straight.calibration, NEAREST_M)
        rng = np.random.default_rng([place.seed, 0x5F])
        frame = first_frame

        for stretch in course(place):
            for pose in stretch.poses:
                world.robot.place(pose)
                eyes = camera.capture_labelled(stretch.light, rng)
                left, right = straight.apply(*(eye.image for eye in eyes))

                depth_m = stereo.depth_m(left, right)
                matches, _ = recognizer.observe(frame, frame * FRAME_NS, left, depth_m)
                best = matches[0] if matches else None
                yield Answer(place.seed, stretch.part, pose, best)
                frame += 1
    finally:
        world.close()


def course(place: town.Town) -> list[Stretch]:
    """A lap, a side street, and the lap again in another light."""
    rng = np.random.default_rng([place.seed, 0x5E])
    light = some_light(rng)
    other = some_light(rng)
    side = place.roads[4]
    return [
        Stretch(FIRST_LAP, light, poses(place.line(), rng, STEP_M)),
        Stretch(SIDE_STREET, light, poses([side.start, side.end], rng, STEP_M)),
        Stretch(SECOND_LAP, other, poses(place.line(), rng, STEPS_M, OFFSET_M, TURN_RAD)),
    ]


def poses(
    line: Sequence[Point],
    rng: np.random.Generator,
    steps_m: tuple[float, float],
    offset_m: float = 0.0,
    turn_rad: float = 0.0,
) -> list[Pose]:
    """Poses along `line`, its corners rounded, at steps between `steps_m`, off the line and off its
    direction.

    How long a step is and how far off the robot is, up to `offset_m` and `turn_rad`, changes slowly
    along the way.
    """
    at_m, points_m = _rounded(line)
    step = _slowly(rng, at_m, SPEED_CHANGES_M, 1.0)
    offset = _slowly(rng, at_m, OFFSET_CHANGES_M, offset_m)
    turn = _slowly(rng, at_m, TURN_CHANGES_M, turn_rad)
    x_ahead, y_ahead = np.gradient(points_m, axis=0).T
    heading_rad = np.unwrap(np.arctan2(y_ahead, x_ahead))
    columns = np.column_stack([points_m, heading_rad, offset, turn, step])

    mean_step_m = sum(steps_m) / 2
    half_range_m = (steps_m[1] - steps_m[0]) / 2
    found = []
    here_m = 0.0

    while here_m <= at_m[-1]:
        here = [float(np.interp(here_m, at_m, column)) for column in columns.T]
        x_m, y_m, along_rad, left_m, turned_rad, speed = here
        pose = Pose(
            x_m=x_m - left_m * math.sin(along_rad),
            y_m=y_m + left_m * math.cos(along_rad),
            heading_rad=along_rad + turned_rad,
        )
        found.append(pose)
        here_m += mean_step_m + half_range_m * speed

    return found


def _rounded(line: Sequence[Point]) -> tuple[Floats, Floats]:
    """How far along `line` each of (n,) points close to each other is, and the points (n, 2).

    Corners are cut smoothly.
    """
    corners_m = np.asarray(line, np.float64)
    along_m = distances_along(corners_m)
    count = math.ceil(along_m[-1] / SPACING_M)
    even_m = np.linspace(0, along_m[-1], count)

    half = round(CORNER_M / SPACING_M / 2)
    width = 2 * half + 1
    window = np.full(width, 1 / width)
    columns = []

    for values in corners_m.T:
        column = np.interp(even_m, along_m, values)
        padded = np.pad(column, half, mode="edge")
        columns.append(np.convolve(padded, window, mode="valid"))

    points_m = np.stack(columns, axis=1)
    return distances_along(points_m), points_m


def _slowly(rng: np.random.Generator, at_m: Floats, every_m: float, limit: float) -> Floats:
    """Values up to `limit` to both sides, between ones drawn at every so many metres."""
    knots_m = np.arange(0.0, at_m[-1] + 2 * every_m, every_m)
    values = rng.uniform(-limit, limit, len(knots_m))
    return np.asarray(np.interp(at_m, knots_m, values))


def metrics(answers: Sequence[Answer]) -> Metrics:
    """Recall at 99 % precision, and that of the answers as they were given."""
    score = np.array([answer.match.score if answer.match else 0.0 for answer in answers])
    right = np.array([_is_right(answer, answers) for answer in answers])
    again = np.array([answer.part == SECOND_LAP for answer in answers])
    first = [answer for answer in answers if answer.part == FIRST_LAP]
    was_seen = np.array([any(same(answer, other) for other in first) for answer in answers])

    wanted = again & was_seen
    matched = score > 0
    false_elsewhere = matched & ~right & ~again
    return {
        "sequence_recall_at_99p": recall(score, right, wanted, PRECISION),
        "sequence_recall": _ratio(right & wanted, wanted),
        "sequence_precision": _ratio(right, matched),
        "sequence_views": float(len(answers)),
        "sequence_false_outside_second_lap": float(false_elsewhere.sum()),
    }


def _is_right(answer: Answer, answers: Sequence[Answer]) -> bool:
    """Whether it matches a view of the same place."""
    return answer.match is not None and same(answer, answers[answer.match.frame])


def _ratio(some: Flags, of_all: Flags) -> float:
    return float(some.sum() / max(1, of_all.sum()))


def recall(score: Floats, right: Flags, wanted: Flags, precision: float) -> float:
    """The share of `wanted` views that are matched rightly, at the lowest score that gives at least
    `precision`.

    0 where no score does; a view of score 0 is not matched.
    """
    for min_score in np.unique(score[score > 0]):
        matched = score >= min_score
        if right[matched].mean() >= precision:
            return _ratio(matched & right & wanted, wanted)

    return 0.0


def same(one: Answer, other: Answer) -> bool:
    """Whether both were at the same place and looked in about the same direction."""
    apart_m = math.hypot(one.pose.x_m - other.pose.x_m, one.pose.y_m - other.pose.y_m)
    turned = math.remainder(one.pose.heading_rad - other.pose.heading_rad, math.tau)
    return one.seed == other.seed and apart_m < SAME_M and abs(turned) < SAME_RAD


def _town(seed: int, invented: int) -> town.Town:
    return town.generate(seed, towns.kinds(seed, invented))
