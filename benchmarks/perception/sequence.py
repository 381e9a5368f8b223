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
    at_m, points = _rounded(line)
    step = _slowly(rng, at_m, SPEED_CHANGES_M, 1.0)
    offset = _slowly(rng, at_m, OFFSET_CHANGES_M, offset_m)
    turn = _slowly(rng, at_m, TURN_CHANGES_M, turn_rad)
    heading = np.unwrap(np.arctan2(*np.gradient(points, axis=0).T[::-1]))
    middle = sum(steps_m) / 2
    range_m = (steps_m[1] - steps_m[0]) / 2
    found = []
    here_m = 0.0
    while here_m <= at_m[-1]:
        x, y, along, left, by, speed = (
            float(np.interp(here_m, at_m, values))
            for values in (*points.T, heading, offset, turn, step)
        )
        found.append(
            Pose(
                x_m=x - left * math.sin(along),
                y_m=y + left * math.cos(along),
                heading_rad=along + by,
            )
        )
        here_m += middle + range_m * speed
    return found


def _rounded(line: Sequence[Point]) -> tuple[Floats, Floats]:
    """Points (n, 2) close to each other along `line`, and how far from its start each is; corners
    are cut smoothly.
    """
    corners = np.asarray(line, np.float64)
    far_m = _far(corners)
    every = np.linspace(0, far_m[-1], math.ceil(far_m[-1] / SPACING_M))
    half = round(CORNER_M / SPACING_M / 2)
    window = np.full(2 * half + 1, 1 / (2 * half + 1))
    rows = (np.interp(every, far_m, values) for values in corners.T)
    points = np.stack(
        [np.convolve(np.pad(row, half, mode="edge"), window, mode="valid") for row in rows], axis=1
    )
    return _far(points), points


def _far(points: Floats) -> Floats:
    return np.concatenate([[0.0], np.hypot(*np.diff(points, axis=0).T).cumsum()])


def _slowly(rng: np.random.Generator, at_m: Floats, every_m: float, most: float) -> Floats:
    """Values up to `most` to both sides, between ones drawn at every so many metres."""
    knots = np.arange(0.0, at_m[-1] + 2 * every_m, every_m)
    return np.asarray(np.interp(at_m, knots, rng.uniform(-most, most, len(knots))))


def metrics(answers: Sequence[Answer]) -> Metrics:
    """Recall at 99 % precision, and what the answers are worth as they were given."""
    score = np.array([answer.match.score if answer.match else 0.0 for answer in answers])
    right = np.array(
        [
            answer.match is not None and same(answer, answers[answer.match.frame])
            for answer in answers
        ]
    )
    again = np.array([answer.part == SECOND_LAP for answer in answers])
    first = [answer for answer in answers if answer.part == FIRST_LAP]
    wanted = again & np.array([any(same(answer, other) for other in first) for answer in answers])
    said = score > 0
    return {
        "sequence_recall_at_99p": recall(score, right, wanted, PRECISION),
        "sequence_recall": float((right & wanted).sum() / max(1, wanted.sum())),
        "sequence_precision": float(right.sum() / max(1, said.sum())),
        "sequence_views": float(len(answers)),
        "sequence_false_outside_second_lap": float((said & ~right & ~again).sum()),
    }


def recall(score: Floats, right: Flags, wanted: Flags, precision: float) -> float:
    """The share of `wanted` views that are matched rightly, at the lowest score that gives at least
    `precision`.

    0 where no score does; a view of score 0 is not matched.
    """
    for least in np.unique(score[score > 0]):
        said = score >= least
        if right[said].mean() >= precision:
            return float((said & right & wanted).sum() / max(1, wanted.sum()))
    return 0.0


def same(one: Answer, other: Answer) -> bool:
    """Whether both were at the same place and looked in about the same direction."""
    apart_m = math.hypot(one.pose.x_m - other.pose.x_m, one.pose.y_m - other.pose.y_m)
    turned = math.remainder(one.pose.heading_rad - other.pose.heading_rad, math.tau)
    return one.seed == other.seed and apart_m < SAME_M and abs(turned) < SAME_RAD


def _town(seed: int, invented: int) -> town.Town:
    return town.generate(seed, towns.kinds(seed, invented))
