"""How the codelets are configured."""

from __future__ import annotations

from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from cogmap.schemas.base import PositiveMetres

SECTION = "codelets"

Gain = Annotated[float, Meta(ge=0, le=1)]
Seconds = Annotated[float, Meta(gt=0, le=1e9)]
Positive = Annotated[float, Meta(gt=0, le=100)]


class Config(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """Numbers of samples, what is assumed of percepts and self-motion, and how maps are corrected.

    The noise of each sense comes with its messages. The gains are what a sense errs by for longer
    than one step; the town's senses have none, those of an uncalibrated robot are estimated as it
    drives.
    """

    samples: Annotated[
        int,
        Meta(
            description="Monte-Carlo samples of the agent's pose, 10 to 100000", ge=10, le=100_000
        ),
    ] = 800
    kept_samples: Annotated[
        int,
        Meta(
            description="samples that rejection leaves at least, some drawn repeatedly, 1 to 10000",
            ge=1,
            le=10_000,
        ),
    ] = 200
    landmark_samples: Annotated[
        int,
        Meta(description="samples of each landmark's position, 10 to 10000", ge=10, le=10_000),
    ] = 200
    correlated_views: Annotated[
        float,
        Meta(
            description="successive views of a landmark whose errors are alike, so that together "
            "they count as one, 1 to 10000; 1 takes each for independent, as eq. 1 does",
            ge=1,
            le=10_000,
        ),
    ] = 60.0
    largest_landmark_sd_m: Annotated[
        PositiveMetres,
        Meta(
            description="landmarks whose position is less certain do not inform localization, "
            "standard deviation in m, above 0, at most 10000"
        ),
    ] = 4.0
    landmark_jitter_m: Annotated[
        PositiveMetres,
        Meta(
            description="least noise added to a landmark's samples at each view, standard "
            "deviation in m, above 0, at most 10000"
        ),
    ] = 0.03
    speed_gain_sd: Annotated[
        Gain,
        Meta(description="standard deviation of the gain error of speed, a share, 0 to 1"),
    ] = 0.0
    turn_gain_sd: Annotated[
        Gain,
        Meta(description="standard deviation of the gain error of turn rate, a share, 0 to 1"),
    ] = 0.0
    drift_rad_per_m: Annotated[
        Gain,
        Meta(description="standard deviation of the drift of heading, rad per m, 0 to 1"),
    ] = 0.0
    range_gain_sd: Annotated[
        Gain,
        Meta(description="standard deviation of the gain error of range, a share, 0 to 1"),
    ] = 0.0
    path_spacing_m: Annotated[
        PositiveMetres,
        Meta(description="distance between places of the path, in m, above 0, at most 10000"),
    ] = 1.0
    revisit_s: Annotated[
        Seconds,
        Meta(
            description="time after which a landmark or place seen again may close a loop, in s, "
            "above 0"
        ),
    ] = 20.0
    closure_spacing_s: Annotated[
        Seconds,
        Meta(description="least time between two loop closures by the same cue, in s, above 0"),
    ] = 2.0
    path_variance_per_m: Annotated[
        Positive,
        Meta(
            description="least variance of path integration's position, m^2 per m, above 0, at "
            "most 100"
        ),
    ] = 1e-4
    heading_variance_per_m: Annotated[
        Positive,
        Meta(
            description="least variance of path integration's heading, rad^2 per m, above 0, at "
            "most 100"
        ),
    ] = 1e-6
    heading_variance_per_rad: Annotated[
        Positive,
        Meta(
            description="least variance of path integration's heading, rad^2 per rad turned, "
            "above 0, at most 100"
        ),
    ] = 1e-5
    correct: Annotated[
        Literal["positions", "heading"],
        Meta(
            description="what map correction corrects: positions alone, by reverse replay "
            "(eq. 9), or headings too, by nonlinear least squares"
        ),
    ] = "heading"
    anchor: Annotated[
        Literal["start", "map"],
        Meta(
            description="what stays in place when the map is corrected. start: where the path "
            "begins, for goals and maps that are given relative to it. map: the path that was "
            "corrected before, as a whole, so that an agent whose heading at the start is little "
            "known does not have all its map turned by what it learns of that"
        ),
    ] = "start"
    landmarks: Annotated[
        Literal["buildings", "points"],
        Meta(
            description="what landmarks are for map correction. buildings: successive sightings "
            "of one of their sides err alike, and each side errs by itself. points: all sightings "
            "err independently"
        ),
    ] = "buildings"
    place_match_sd_m: Annotated[
        PositiveMetres,
        Meta(
            description="standard deviation of the position at which a place is recognised, in m, "
            "above 0, at most 10000"
        ),
    ] = 2.0
    place_match_sd_rad: Annotated[
        float,
        Meta(
            description="standard deviation of the heading at which a place is recognised, in "
            "rad, above 0, at most 3.2",
            gt=0,
            le=3.2,
        ),
    ] = 0.2
    sparse_after_s: Annotated[
        Seconds,
        Meta(
            description="age from which on a place of the path is joined into an older one that "
            "stood there already, in s, above 0, at most 1e9; until then a mistaken loop closure "
            "can be taken back"
        ),
    ] = 300.0
