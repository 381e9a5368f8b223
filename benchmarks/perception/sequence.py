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

from benchmarks.report import Metrics
from cogmap.geometry.arrays import Booleans, Floats
from cogmap.geometry.polylines import distances_along
from cogmap.robot import NEAREST_DEPTH_M, calibration
from cogmap.schemas.sensing import PlaceMatch, Pose
from cogmap.services.epam.public import PlaceRecognizer, backbone, descriptor
from cogmap.services.sensory.public import DepthFromStereo, rectification
from cogmap.services.sim.public import town
from cogmap.services.sim.rendering.public import Light, StereoCamera, World, some_light
from cogmap.training.rendering import towns

# The last town is built of kinds that nobody was taught alone: no landmark in any view.
TOWNS = ((3201, 0), (3202, 0), (3203, 28))
FIRST_LAP, SIDE_STREET, SECOND_LAP = range(3)
SIDE_ROAD = 4
STEP_M = (0.8, 0.8)
STEPS_M = (0.6, 1.1)
OFFSET_M = 0.5
TURN_RAD = math.radians(3)
CORNER_M = 6.0
SPACING_M = 0.1
SPEED_CHANGES_M = 10.0
OFFSET_CHANGES_M = 8.0
TURN_CHANGES_M = 4.0
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
    """The town, part of the drive and pose of a view, and the place that it was matched with."""

    seed: int
    part: int
    pose: Pose
    match: PlaceMatch | None


def measure() -> Metrics:
    """Measure place recognition in all TOWNS, driven one after the other."""
    recognizer = PlaceRecognizer()
    answers = list[Answer]()

    for seed, invented in TOWNS:
        place = town.generate(seed, towns.kinds(seed, invented))
        answers += drive(recognizer, len(answers), place)

    return metrics(answers)


def drive(recognizer: PlaceRecognizer, first_frame: int, place: town.Town) -> Iterator[Answer]:
    """Drive through a town and ask `recognizer` at each view; frames count from `first_frame`."""
    features = backbone.load()
    world = World(place)
    frame = first_frame

    try:
        camera = StereoCamera(world, calibration())
        straight = rectification(camera.calibration)
        stereo = DepthFromStereo(straight.calibration, NEAREST_DEPTH_M)
        rng = np.random.default_rng([place.seed, 0x5F])

        for stretch in course(place):
            for pose in stretch.poses:
                world.robot.place(pose)
                left_eye, right_eye = camera.capture_labelled(stretch.light, rng)
                left, right = straight.apply(left_eye.image, right_eye.image)
                depth_m = stereo.depth_m(left, right)

                code = None
                if descriptor.shows_place(left, depth_m):
                    code = descriptor.code(features.features(left))
                matches, _ = recognizer.observe(frame, frame * FRAME_NS, code)
                yield Answer(place.seed, stretch.part, pose, matches[0] if matches else None)
                frame += 1
    finally:
        world.close()


def course(place: town.Town) -> list[Stretch]:
    """Plan a lap, a side street, and the lap again in another light."""
    rng = np.random.default_rng([place.seed, 0x5E])
    light = some_light(rng)
    other_light = some_light(rng)
    loop = place.line()
    side = place.roads[SIDE_ROAD]

    first = poses(loop, rng, STEP_M)
    aside = poses([side.start, side.end], rng, STEP_M)
    second = poses(loop, rng, STEPS_M, OFFSET_M, TURN_RAD)
    return [
        Stretch(FIRST_LAP, light, first),
        Stretch(SIDE_STREET, light, aside),
        Stretch(SECOND_LAP, other_light, second),
    ]


def poses(
    line: Sequence[tuple[float, float]],
    rng: np.random.Generator,
    steps_m: tuple[float, float],
    offset_m: float = 0.0,
    turn_rad: float = 0.0,
) -> list[Pose]:
    """Draw poses along `line`, its corners rounded, at steps between `steps_m`.

    Each is beside the line by up to `offset_m`, and turned from its direction by up to `turn_rad`:
    these and the length of a step change slowly along the line.
    """
    # Points close to each other; the mean over CORNER_M around each cuts corners smoothly.
    corners_m = np.asarray(line, np.float64)
    along_m = distances_along(corners_m)
    even_m = np.linspace(0, along_m[-1], math.ceil(along_m[-1] / SPACING_M))
    half = round(CORNER_M / SPACING_M / 2)
    window = np.full(2 * half + 1, 1 / (2 * half + 1))
    smooth = []
    for values in corners_m.T:
        padded = np.pad(np.interp(even_m, along_m, values), half, mode="edge")
        smooth.append(np.convolve(padded, window, mode="valid"))

    points_m = np.stack(smooth, axis=1)
    at_m = distances_along(points_m)
    x_ahead, y_ahead = np.gradient(points_m, axis=0).T
    headings_rad = np.unwrap(np.arctan2(y_ahead, x_ahead))

    step = _slowly(rng, at_m, SPEED_CHANGES_M, 1.0)
    offset = _slowly(rng, at_m, OFFSET_CHANGES_M, offset_m)
    turn = _slowly(rng, at_m, TURN_CHANGES_M, turn_rad)
    columns = np.column_stack([points_m, headings_rad, offset, turn, step])

    min_step_m, max_step_m = steps_m
    mean_step_m = (min_step_m + max_step_m) / 2
    half_range_m = (max_step_m - min_step_m) / 2
    found = []
    here_m = 0.0

    while here_m <= at_m[-1]:
        here = [float(np.interp(here_m, at_m, column)) for column in columns.T]
        x_m, y_m, along_rad, left_m, turned_rad, speed = here
        beside = Pose(
            x_m=x_m - left_m * math.sin(along_rad),
            y_m=y_m + left_m * math.cos(along_rad),
            heading_rad=along_rad + turned_rad,
        )
        found.append(beside)
        here_m += mean_step_m + half_range_m * speed

    return found


def _slowly(rng: np.random.Generator, at_m: Floats, every_m: float, limit: float) -> Floats:
    """Interpolate values up to `limit` to both sides, between ones drawn every so many metres."""
    beyond_m = at_m[-1] + 2 * every_m
    knots_m = np.arange(0.0, beyond_m, every_m)
    values = rng.uniform(-limit, limit, len(knots_m))
    return np.asarray(np.interp(at_m, knots_m, values))


def metrics(answers: Sequence[Answer]) -> Metrics:
    """Return the recall at 99 % precision, and that of the answers as they were given."""
    score = np.array([answer.match.score if answer.match else 0.0 for answer in answers])
    right = np.array(
        [
            answer.match is not None and same(answer, answers[answer.match.frame])
            for answer in answers
        ]
    )
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


def _ratio(some: Booleans, of_all: Booleans) -> float:
    count = max(1, of_all.sum())
    return float(some.sum() / count)


def recall(score: Floats, right: Booleans, wanted: Booleans, precision: float) -> float:
    """Return the share of `wanted` views that are matched rightly, at the lowest score that gives
    at least `precision`.

    0 if no score does; a view of score 0 is not matched.
    """
    scores = score[score > 0]
    for min_score in np.unique(scores):
        matched = score >= min_score
        if right[matched].mean() >= precision:
            return _ratio(matched & right & wanted, wanted)

    return 0.0


def same(one: Answer, other: Answer) -> bool:
    """Decide whether both were at the same place and looked in about the same direction."""
    if one.seed != other.seed:
        return False

    x_m = one.pose.x_m - other.pose.x_m
    y_m = one.pose.y_m - other.pose.y_m
    turn_rad = math.remainder(one.pose.heading_rad - other.pose.heading_rad, math.tau)
    return math.hypot(x_m, y_m) < SAME_M and abs(turn_rad) < SAME_RAD
