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
Share = Annotated[float, Meta(ge=0, le=1)]


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
    outlier_share: Annotated[
        Share,
        Meta(description="share of percepts that may be of another landmark, 0 to 1"),
    ] = 1e-3
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
    gate: Annotated[
        float,
        Meta(
            description="a percept further from what a sample predicts does not fit it, in "
            "standard deviations, above 0, at most 100",
            gt=0,
            le=100,
        ),
    ] = 4.0
    misses: Annotated[
        int,
        Meta(
            description="successive misfits after which a landmark is placed anew, 1 to 10000",
            ge=1,
            le=10_000,
        ),
    ] = 8
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
    motion_bias_time_s: Annotated[
        Seconds,
        Meta(
            description="correlation time of the errors of speed, turn rate and drift, in s, "
            "above 0, at most 1e9"
        ),
    ] = 30.0
    range_gain_sd: Annotated[
        Gain,
        Meta(description="standard deviation of the gain error of range, a share, 0 to 1"),
    ] = 0.0
    range_bias_time_s: Annotated[
        Seconds,
        Meta(description="correlation time of the gain error of range, in s, above 0, at most 1e9"),
    ] = 300.0
    misfits_to_relocalize: Annotated[
        int,
        Meta(
            description="successive views that fit no sample, of two landmarks or more, after "
            "which the agent relocalizes, 2 to 10000",
            ge=2,
            le=10_000,
        ),
    ] = 8
    farthest_m: Annotated[
        PositiveMetres,
        Meta(
            description="distance up to which a landmark seen by its bearing alone may stand, in "
            "m, above 0, at most 10000"
        ),
    ] = 50.0
    path_spacing_m: Annotated[
        PositiveMetres,
        Meta(description="distance between places of the path, in m, above 0, at most 10000"),
    ] = 1.0
    boundary_reach_m: Annotated[
        float,
        Meta(
            description="distance up to which links are cut or freed by what is seen, in m, above "
            "0, at most 100",
            gt=0,
            le=100,
        ),
    ] = 25.0
    range_sd_share: Annotated[
        Gain,
        Meta(
            description="standard deviation of a distance seen over the distance, by which road, "
            "boundaries and obstacles far away count less, 0 to 1"
        ),
    ] = 0.03
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
    landmark_sides: Annotated[
        int,
        Meta(
            description="sides of a landmark, by the direction in which it is seen, whose views "
            "share an error: each is a landmark of its own for map correction, 1 to 360; 1: views "
            "from all directions have the same error",
            ge=1,
            le=360,
        ),
    ] = 16
    correlated_sightings: Annotated[
        float,
        Meta(
            description="successive sightings of a landmark along the path whose errors are "
            "alike, so that together they count as one in map correction, 1 to 1000",
            ge=1,
            le=1000,
        ),
    ] = 5.0
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
    false_closure: Annotated[
        float,
        Meta(
            description="a loop closure is rejected if a true one would misfit as much with a "
            "smaller probability, between 0 and 1",
            gt=0,
            lt=1,
        ),
    ] = 1e-3
    sparse_after_s: Annotated[
        Seconds,
        Meta(
            description="age from which on a place of the path is joined into an older one that "
            "stood there already, in s, above 0, at most 1e9; until then a mistaken loop closure "
            "can be taken back"
        ),
    ] = 300.0
    waiting_misfit: Annotated[
        Positive,
        Meta(
            description="misfit of a new loop closure up to which the path explains it: its "
            "squared distance, in variances, over that at which a closure is rejected, above 0, "
            "at most 100"
        ),
    ] = 0.1
    waiting_share: Annotated[
        Share,
        Meta(
            description="share of the new loop closures that the path does not explain, three at "
            "least, from which on it is corrected, once part of it is sparse; below, a correction "
            "would change little, and waits, 0 to 1; 0: none waits"
        ),
    ] = 0.1
    synapse_decay_per_m: Annotated[
        Positive,
        Meta(
            description="decay of the synapse between two place cells with the distance of their "
            "fields, per m, above 0, at most 100"
        ),
    ] = 0.2
