"""Where the robot's battery is charged: posts on the pavements, at the kerbs, spread over a town.
Pure.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from cogmap.errors import ConfigError
from cogmap.geometry.arrays import Booleans, Floats
from cogmap.geometry.se2 import transform_to
from cogmap.services.sim.layout.boundaries import clearance_m, surfaces
from cogmap.services.sim.layout.furniture import CHARGING_PLACE, Prop
from cogmap.services.sim.layout.place import Place
from cogmap.services.sim.layout.plan import Point, Road

SIZE_M = (0.6, 0.6, 2.6)
# From the kerb, as other props at least.
KERB_GAP_M = 0.15
# From the end of a street, where others may cross it.
JUNCTION_M = 8.0
# From any wall at least.
WALL_M = 1.0
# Objects that stand nearer to one another than buildings are taken for one.
BUILDING_M = 6.5
# From props, and from other posts at least.
PROP_M = 3.5
POST_M = 15.0
# Of a random search: posts that are tried, and choices of them, of which the best is kept.
CANDIDATES = 1000
DRAWS = 200
# From where the robot starts, less than the distance at which it is charged.
HOME_M = 6.5
HOME_OFFSETS_M = (0.0, -1.5, 1.5, -3.0, 3.0, -4.5, 4.5)
_HALF_M = SIZE_M[1] / 2


def with_charging_places(place: Place, seed: int, count: int) -> Place:
    """Add `count` charging places to `place`, the same from the same seed.

    One is where the robot starts, if there is room. The others are spread so that none of its
    streets is far from one, and clear of every street, building and prop. Raises ConfigError if
    there is no room for so many.
    """
    if not count:
        return place

    rng = np.random.default_rng([seed, 0xC4A6])
    candidates = _candidates(rng, place.roads)
    free = _free(candidates, place)
    home = _free(_beside_start(place), place)[:1]
    if home:
        apart = _is_apart(_middles_m(free), [(home[0].x_m, home[0].y_m)], POST_M)
        free = [post for post, is_apart in zip(free, apart.tolist(), strict=True) if is_apart]

    others = count - len(home)
    chosen = _spread(rng, _middles_m(free), _middles_m(candidates), others) if others else []
    if len(chosen) < others:
        raise ConfigError(
            f"[sim] the town has no room for {count} charging places: lower battery.places or set "
            "energy to false"
        )

    posts = [*home, *(free[number] for number in chosen)]
    return replace(place, props=(*place.props, *posts))


def _candidates(rng: np.random.Generator, roads: Sequence[Road]) -> list[Prop]:
    """Draw posts at the kerbs of long enough streets, wherever they would stand."""
    lengths_m = np.array([max(0.0, road.length_m - 2 * JUNCTION_M) for road in roads])
    total_m = lengths_m.sum()
    if not total_m:
        return []

    posts = []
    for number in rng.choice(len(roads), CANDIDATES, p=lengths_m / total_m).tolist():
        along_m = JUNCTION_M + float(rng.uniform(0.0, lengths_m[number]))
        side = float(rng.choice([-1.0, 1.0]))
        posts.append(_post(roads[number], along_m, side))

    return posts


def _beside_start(place: Place) -> list[Prop]:
    """Return posts at the kerbs of the streets that the robot starts on, so near that they charge
    it there, the nearest first.
    """
    posts = []
    start = np.array([[place.start.x_m, place.start.y_m]])
    for road in place.roads:
        ((along_m, left_m),) = transform_to(np.array([*road.start, road.heading_rad]), start)
        if not 0.0 <= along_m <= road.length_m or abs(left_m) > road.width_m / 2:
            continue
        for offset_m in HOME_OFFSETS_M:
            for side in (-1.0, 1.0):
                posts.append(_post(road, float(along_m) + offset_m, side))

    def away_m(post: Prop) -> float:
        return math.dist((post.x_m, post.y_m), (place.start.x_m, place.start.y_m))

    return sorted((post for post in posts if away_m(post) <= HOME_M), key=away_m)


def _post(road: Road, along_m: float, side: float) -> Prop:
    left_m = side * (road.width_m / 2 + KERB_GAP_M + _HALF_M)
    x_m, y_m = road.point(along_m, left_m)

    return Prop(
        kind=CHARGING_PLACE,
        x_m=round(x_m, 3),
        y_m=round(y_m, 3),
        heading_rad=road.heading_rad,
        size_m=SIZE_M,
        look=0,
    )


def _free(posts: Sequence[Prop], place: Place) -> list[Prop]:
    """Keep the posts that stand on no street, in no building, and beside nothing else."""
    middles_m = _middles_m(posts)
    streets = surfaces(place.roads)
    along_m, left_m = streets.local(middles_m)
    is_along = np.abs(along_m) < streets.half_length_m + _HALF_M
    is_across = np.abs(left_m) < streets.half_width_m + _HALF_M
    is_free = np.asarray(~(is_along & is_across).any(axis=1))

    is_free &= _is_apart(middles_m, [(plot.x_m, plot.y_m) for plot in place.plots], BUILDING_M)
    is_free &= _is_apart(middles_m, [(prop.x_m, prop.y_m) for prop in place.props], PROP_M)

    boxes = [plot.footprint for plot in place.plots]
    west, south, east, north = np.array(boxes, float).reshape(-1, 4).T
    x_m = middles_m[:, :1]
    y_m = middles_m[:, 1:]
    is_inside = (x_m >= west) & (x_m <= east) & (y_m >= south) & (y_m <= north)
    is_free &= ~is_inside.any(axis=1)

    free = []
    for number in np.flatnonzero(is_free).tolist():
        post = posts[number]
        if clearance_m(place.walls_m, post.x_m, post.y_m) >= WALL_M:
            free.append(post)

    return free


def _middles_m(posts: Sequence[Prop]) -> Floats:
    """Return the (n, 2) middles of posts."""
    middles = [(post.x_m, post.y_m) for post in posts]
    return np.array(middles, float).reshape(-1, 2)


def _is_apart(points_m: Floats, others: Sequence[Point], apart_m: float) -> Booleans:
    """Mark, (n,), those of (n, 2) points that are at least `apart_m` from all others."""
    others_m = np.array(others, float).reshape(-1, 2)
    return np.asarray((_distances_m(points_m, others_m) >= apart_m).all(axis=1))


def _spread(
    rng: np.random.Generator, free_m: Floats, everywhere_m: Floats, count: int
) -> list[int]:
    """Choose `count` of the (n, 2) free places: of DRAWS choices, the one from which the farthest
    place of all is nearest. Returns none if no choice has room for so many.
    """
    away_m = _distances_m(free_m, everywhere_m)
    is_apart = _distances_m(free_m, free_m) >= POST_M

    best: list[int] = []
    least_m = np.inf
    for _ in range(DRAWS):
        # Draw places that are all apart, until no other is.
        chosen: list[int] = []
        is_left = np.ones(len(is_apart), bool)
        while len(chosen) < count and is_left.any():
            number = int(rng.choice(np.flatnonzero(is_left)))
            chosen.append(number)
            is_left &= is_apart[number]

        if len(chosen) < count:
            continue

        farthest_m = float(away_m[chosen].min(axis=0).max())
        if farthest_m < least_m:
            least_m = farthest_m
            best = chosen

    return best


def _distances_m(points_m: Floats, others_m: Floats) -> Floats:
    """Return the (n, k) distances of each of (n, 2) points from each of (k, 2) others."""
    x_m, y_m = (points_m[:, None] - others_m[None]).transpose(2, 0, 1)
    distances_m: Floats = np.hypot(x_m, y_m)
    return distances_m
