"""The agent, what it perceives, the objects around it and the maps that they are on."""

from __future__ import annotations

from typing import Annotated

import msgspec
import numpy as np
import numpy.typing as npt

from cogmap.schemas.array import Matrix
from cogmap.schemas.base import Count, Finite, Metres, Name, Unit
from cogmap.schemas.nodes.attention import SATISFIED_BY
from cogmap.schemas.nodes.base import NEVER_NS, GraphNode, Positive, Spread, Stamp
from cogmap.schemas.nodes.columns import POSE_COLUMNS, SelfColumn, check_matrix
from cogmap.schemas.nodes.ids import ROOT_MAP


class PathIntegration(msgspec.Struct, kw_only=True, frozen=True):
    """The pose by path integration alone, and its variance since the start, of the distance and of
    the heading.
    """

    x_m: Finite = 0.0
    y_m: Finite = 0.0
    heading_rad: Finite = 0.0
    variance_m2: Spread = 0.0
    variance_rad2: Spread = 0.0

    def pose(self) -> npt.NDArray[np.float64]:
        """Return x, y and heading, (3,)."""
        return np.array([self.x_m, self.y_m, self.heading_rad])

    def variances(self) -> npt.NDArray[np.float64]:
        """Return the variances in m^2 and rad^2, (2,)."""
        return np.array([self.variance_m2, self.variance_rad2])


class Sighting(msgspec.Struct, kw_only=True, frozen=True):
    """How an object was seen in a view: where it stands by path integration until then, how exactly
    it was seen, and path integration then.
    """

    x_m: Finite
    y_m: Finite
    range_sd_m: Spread
    bearing_sd_rad: Spread
    odometry: PathIntegration


class Misfits(msgspec.Struct, kw_only=True, frozen=True):
    """Views that did not fit the map.

    `count` is the number of views in a row in which nothing fitted, `label` the landmark that did
    not fit first, and `is_lost` states that another did not fit since. `last_ns` and `last_fit_ns`
    are the stamps of the last misfit and of the last view that fitted. `not_elsewhere_ns` is the
    stamp at which what did not fit was found to fit nowhere else on the map together either,
    `found_ns` that at which the agent was found where it cannot have moved to.
    """

    count: Count = 0
    label: str = ""
    is_lost: bool = False
    last_ns: Stamp = 0
    last_fit_ns: Stamp = 0
    not_elsewhere_ns: Stamp = NEVER_NS
    found_ns: Stamp = NEVER_NS


class Self(GraphNode, kw_only=True, frozen=True, tag="self"):
    """The agent: the estimate of its pose (paper §5.4), path integration alone, and misfits.

    `samples`: float64 (n, 3) or (n, 7), see SelfColumn. The pose is their mean. `kept_share` is the
    share of the samples that rejection kept. `stationary_since_ns` is NEVER_NS while the agent
    moves.
    """

    map: Name = ROOT_MAP
    stamp_ns: Stamp = NEVER_NS
    x_m: Finite = 0.0
    y_m: Finite = 0.0
    heading_rad: Finite = 0.0
    x_sd_m: Spread = 0.0
    y_sd_m: Spread = 0.0
    heading_sd_rad: Spread = 0.0
    kept_share: Unit = 1.0
    stationary_since_ns: Stamp = NEVER_NS
    speed_gain: Finite = 0.0
    turn_gain: Finite = 0.0
    range_gain: Finite = 0.0
    odometry: PathIntegration = PathIntegration()
    misfits: Misfits = Misfits()
    samples: Matrix

    def __post_init__(self) -> None:
        check_matrix(self.id, self.samples, "<f8", (POSE_COLUMNS, len(SelfColumn)))


class Percept(GraphNode, kw_only=True, frozen=True, tag="percept"):
    """A PAM node over threshold: an object in the view of this cycle. `label` is that of the
    individual object that it is of, `name` what the view alone would call it.
    """

    label: Name
    name: str = ""
    bearing_rad: Finite
    range_m: Positive


FUNCTIONS = ("shop", "home", "school", "office", "works", *SATISFIED_BY.values())
"""What objects are used for, as far as perception knows."""


class Object(GraphNode, kw_only=True, frozen=True, tag="object"):
    """An individual object of the cognitive map, with samples of its position (paper §5.2).

    `label` states which one it is, and nothing of what it is. `names` is what it may be called: the
    evidence for each name summed over views, and that for none under the empty name. `given_name`
    is what a person calls it. `appearances`, float16 (n, d), are what it looks like from several
    sides.
    `offsets_m`: float16 (n, 2), the samples relative to their mean (`x_m`, `y_m`), which keeps them
    to a thousandth of their spread. `sightings` is the number of views that agree with the
    position, `misses` that of views in a row that do not. One that is `surveyed` was given, and
    stays where it is. `last_seen_ns` and `created_ns` are times of views; `seen_from_m` is where
    the agent stood in the last one, relative to the object, and `last_sighting` how it saw it, if
    by range and bearing. `function` is what it is used for, such as "shop", empty if that is
    unknown.
    """

    label: Name
    names: dict[str, Positive] = {}
    given_name: str = ""
    appearances: Matrix | None = None
    function: str = ""
    map: Name = ROOT_MAP
    x_m: Finite
    y_m: Finite
    x_sd_m: Spread = 0.0
    y_sd_m: Spread = 0.0
    width_m: Metres = 0.0
    height_m: Metres = 0.0
    sightings: Count = 0
    misses: Count = 0
    last_seen_ns: Stamp = NEVER_NS
    seen_from_m: tuple[Finite, Finite] | None = None
    last_sighting: Sighting | None = None
    created_ns: Stamp = 0
    surveyed: bool = False
    offsets_m: Matrix | None = None

    def __post_init__(self) -> None:
        if self.offsets_m is not None:
            check_matrix(self.id, self.offsets_m, "<f2", (2,))

    @property
    def look(self) -> str:
        """Return what most views would call it; empty if they have no name for it."""
        return max(self.names, key=lambda name: (self.names[name], name)) if self.names else ""

    @property
    def name(self) -> str:
        """Return what it is called: by a person, or else by perception; empty if it is not."""
        return self.given_name or self.look

    def positions_m(self) -> npt.NDArray[np.float64]:
        """Return (n, 2) samples of its position; one, the mean, if it has none."""
        mean = np.array([[self.x_m, self.y_m]])
        if self.offsets_m is None:
            return mean

        return mean + self.offsets_m.numpy()

    def covariance_m2(self) -> npt.NDArray[np.float64]:
        """Return the covariance of its position, (2, 2): that of its samples, if it has some."""
        if self.offsets_m is None:
            return np.diag([self.x_sd_m**2, self.y_sd_m**2])

        offsets_m = self.offsets_m.numpy().astype(np.float64)
        covariance: npt.NDArray[np.float64] = offsets_m.T @ offsets_m / len(offsets_m)
        return covariance


class Map(GraphNode, kw_only=True, frozen=True, tag="map"):
    """A cognitive map: a grid of place nodes `cell_m` apart, in a frame of its own.

    The frame's origin and direction are in the frame of `parent`; the root map has none. A sub-map
    holds what is at most `width_m` / 2 east or west and `height_m` / 2 north or south of its
    origin; both are 0 of a map without limits. `remembered` is what long-term memory calls the map
    that was recalled and joined to it, empty if none was.
    """

    cell_m: Annotated[float, msgspec.Meta(gt=0, le=1e4)]
    parent: str = ""
    x_m: Finite = 0.0
    y_m: Finite = 0.0
    heading_rad: Finite = 0.0
    width_m: Metres = 0.0
    height_m: Metres = 0.0
    remembered: str = ""
