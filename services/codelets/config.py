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

    localization: Annotated[
        Literal["paper", "spiking", "cogmap"],
        Meta(
            description="How samples follow self-motion and views. paper: they start again from "
            "their mean at each step (table 1), and are kept by the product of the likelihoods of "
            "all views (eq. 1-3), as each landmark's are by its own view (eq. 4); if none is left, "
            "those before the view stay. spiking: they are spikes of place cells that fire where "
            "path integration by grid cells and a view of a landmark coincide (figure 4); at each "
            "step the phases of the grid cells are reset to their mean, and landmarks are as with "
            "paper. cogmap: they continue from themselves, in stages, a view counts by what is new "
            "in it, and a lost agent is found again."
        ),
    ] = "cogmap"
    samples: Annotated[
        int,
        Meta(description="Monte-Carlo samples of the agent's pose.", ge=10, le=100_000),
    ] = 800
    kept_samples: Annotated[
        int,
        Meta(
            description="Samples that rejection leaves at least, some drawn repeatedly.",
            ge=1,
            le=10_000,
        ),
    ] = 200
    landmark_samples: Annotated[
        int,
        Meta(description="Samples of each landmark's position.", ge=10, le=10_000),
    ] = 200
    landmark_jitter_m: Annotated[
        PositiveMetres,
        Meta(
            description="Least noise added to a landmark's samples at each view, standard "
            "deviation in m."
        ),
    ] = 0.03
    speed_gain_sd: Annotated[
        Gain,
        Meta(description="Standard deviation of the gain error of speed, a share."),
    ] = 0.0
    turn_gain_sd: Annotated[
        Gain,
        Meta(description="Standard deviation of the gain error of turn rate, a share."),
    ] = 0.0
    drift_rad_per_m: Annotated[
        Gain,
        Meta(description="Standard deviation of the drift of heading, rad per m."),
    ] = 0.0
    range_gain_sd: Annotated[
        Gain,
        Meta(description="Standard deviation of the gain error of range, a share."),
    ] = 0.0
    path_spacing_m: Annotated[
        PositiveMetres,
        Meta(description="Distance between places of the path, in m."),
    ] = 1.0
    revisit_s: Annotated[
        Seconds,
        Meta(description="Time after which a landmark or place seen again may close a loop, in s."),
    ] = 20.0
    closure_spacing_s: Annotated[
        Seconds,
        Meta(description="Least time between two loop closures by the same cue, in s."),
    ] = 2.0
    # Over 1 to 60 m of ten drives with cameras, self-motion errs on average by about what it
    # states; the least variances of a heading are for a sense that states less than any can.
    path_variance_per_m: Annotated[
        Positive,
        Meta(description="Least variance of path integration's position, m^2 per m."),
    ] = 1e-4
    heading_variance_per_m: Annotated[
        Positive,
        Meta(description="Least variance of path integration's heading, rad^2 per m."),
    ] = 1e-7
    heading_variance_per_rad: Annotated[
        Positive,
        Meta(description="Least variance of path integration's heading, rad^2 per rad turned."),
    ] = 1e-6
    closes_by: Annotated[
        Literal["sighting", "agreement"],
        Meta(
            description="What closes a loop. sighting: one landmark seen again after `revisit_s`, "
            "at once, and no recognised place (paper 5.6). agreement: several views, of landmarks "
            "or places, that are consistent with one another."
        ),
    ] = "agreement"
    correct: Annotated[
        Literal["eq9", "positions", "heading"],
        Meta(
            description="How map correction closes loops. eq9: positions alone, by eq. 9 as it is "
            "printed, from the path believed; objects shift with the nearest place of the path. "
            "positions: positions alone, by reverse replay to the least of eq. 7. heading: "
            "headings too, by nonlinear least squares."
        ),
    ] = "heading"
    anchor: Annotated[
        Literal["start", "map"],
        Meta(
            description="What stays in place when the map is corrected. start: where the path "
            "begins, for goals and maps that are given relative to it. map: the path "
            "that was corrected before, as a whole, so that an agent whose heading at "
            "the start is little known does not have all its map turned by what it "
            "learns of that."
        ),
    ] = "start"
    landmarks: Annotated[
        Literal["buildings", "points"],
        Meta(
            description="What landmarks are. buildings: successive sightings of one of their "
            "sides err alike, and each side errs by itself. points: all sightings err "
            "independently, as eq. 1 takes them to."
        ),
    ] = "buildings"
    place_match_sd_m: Annotated[
        PositiveMetres,
        Meta(
            description="Standard deviation of the position at which a place is recognised, in m."
        ),
    ] = 2.0
    place_match_sd_rad: Annotated[
        float,
        Meta(
            description="Standard deviation of the heading at which a place is recognised, in rad.",
            gt=0,
            le=3.2,
        ),
    ] = 0.2
    sparse_after_s: Annotated[
        Seconds,
        Meta(
            description="Age from which on a place of the path is joined into an older one that "
            "stood there already, in s; until then a mistaken loop closure can be "
            "taken back."
        ),
    ] = 300.0
