"""What the participant's senses make of a movement and of the landmarks."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from cogmap.experiments.cue_integration.geometry import STEP_M, STEP_RAD, Point, Pose
from cogmap.experiments.cue_integration.trial import DISTANCE, Noise
from cogmap.schemas.sensing import Percept

Rows = list[tuple[float, float, float, float, float]]
HALF_S = 0.25
LANDMARK = "landmark-"
# A direction that is not sensed.
UNKNOWN_RAD = np.pi
# Of the distance: no noise makes a landmark be seen at the eye, or behind it.
MIN_SHARE = 0.05
STANDING: Rows = [(0.0, 0.0, HALF_S, 0.0, 0.0)]
# Turned round and round until any heading is as likely as any other.
DISORIENTED: Rows = [(0.0, 0.0, HALF_S, 0.0, 2 * np.pi / HALF_S)]
# A turn and a step forward of whatever length, the same whatever was done.
UNKNOWN: Rows = [
    (0.0, 0.0, HALF_S, 0.0, STEP_RAD / HALF_S),
    (STEP_M / 2 / HALF_S, 0.0, HALF_S, STEP_M / 2 / HALF_S, 0.0),
]


def self_motion(turn_rad: float, forward_m: float, noise: Noise, rng: np.random.Generator) -> Rows:
    """Return a turn on the spot, then a distance straight on, as rows of SelfMotion: multiplied by
    Gaussians of mean one (§5.4).

    Their standard deviations follow from what is felt, all that a participant knows of them.
    """
    turn_factor = float(rng.normal(1.0, noise.turn))
    speed_factor = float(rng.normal(1.0, noise.speed))
    turn_rate_rad_s = turn_rad / HALF_S * turn_factor
    speed_m_s = forward_m / HALF_S * speed_factor

    turn_rate_sd_rad_s = _sd_of_true(turn_rate_rad_s, noise.turn)
    speed_sd_m_s = _sd_of_true(speed_m_s, noise.speed)
    return [
        (0.0, turn_rate_rad_s, HALF_S, 0.0, turn_rate_sd_rad_s),
        (speed_m_s, 0.0, HALF_S, speed_sd_m_s, 0.0),
    ]


def _sd_of_true(felt: float, noise: float) -> float:
    """Return the standard deviation of the true value if that times a Gaussian of mean one was
    felt, to the fourth order.

    It is more than that of the factor: who has felt little may have felt a fraction of much.
    """
    higher_orders = float(np.sqrt(1 + 8 * noise**2))
    return abs(felt) * noise * higher_orders


def sightings(
    pose: Pose, things: Mapping[str, Point], noise: Noise, rng: np.random.Generator
) -> list[Percept]:
    """Return percepts of all things, by label, wherever the participant faces: it looks around."""
    seen = []

    for label, position in things.items():
        is_landmark = label.startswith(LANDMARK)
        sd = noise.landmark if is_landmark else DISTANCE
        true_bearing_rad, distance_m = pose.towards(position)
        range_m = distance_m * max(float(rng.normal(1.0, sd)), MIN_SHARE)
        bearing_rad = true_bearing_rad + float(rng.normal(0.0, sd))
        bearing_sd_rad = sd
        if is_landmark and noise.range_only:
            bearing_rad = 0.0
            bearing_sd_rad = UNKNOWN_RAD
        seen.append(
            Percept(
                name=label,
                label=label,
                activation=1.0,
                evidence=1.0,
                bearing_rad=bearing_rad,
                range_m=range_m,
                bearing_sd_rad=bearing_sd_rad,
                range_sd_m=sd * range_m,
                width_m=0.1,
                height_m=0.1,
                whole=True,
                box_px=(0, 0, 1, 1),
            )
        )

    return seen
