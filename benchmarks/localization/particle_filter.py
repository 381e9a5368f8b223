"""The peer of localization on a known map: a public particle filter, pfilter's."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt

from benchmarks import optional
from benchmarks.localization.senses import Moment
from cogmap.geometry.arrays import Floats
from cogmap.schemas.sensing import Percept

PARTICLES = 1000
RESAMPLE_BELOW = 0.5
# Factors of the stated noise of motion and of observations. The one with the least error on the
# robots themselves is reported, in the filter's favour.
SCALES = ((1.0, 1.0), (1.0, 2.0), (2.0, 1.0), (2.0, 2.0), (4.0, 2.0))
MIN_WEIGHT = 1e-12
Surveyed = Mapping[str, tuple[float, float]]


def localize(
    moments: Sequence[Moment],
    surveyed: Surveyed,
    start: tuple[float, float, float],
    scales: tuple[float, float],
    seed: int,
) -> Floats:
    """Return (n, 3) mean poses at the moments, of particles that begin at `start`, on a map of
    `surveyed` landmarks by label.

    It gets the percepts, motions and noise that the codelets get, the noise times `scales`. Raises
    UsageError if pfilter is not installed.
    """
    library = optional.pfilter()
    motion_scale, observation_scale = scales
    rng = np.random.default_rng(seed)

    def moved(particles: Floats, moment: Moment) -> Floats:
        return move(particles, moment.motions, motion_scale, rng)

    def weights(particles: Floats, _: Floats, moment: Moment) -> Floats:
        return likelihoods(particles, moment.percepts, surveyed, observation_scale)

    def resampled(weights: Floats) -> npt.NDArray[np.intp]:
        # Systematic, as the library's own, which draws from the global source.
        positions = (np.arange(len(weights)) + rng.uniform()) / len(weights)
        return np.searchsorted(weights.cumsum()[:-1], positions)

    found = library.ParticleFilter(
        prior_fn=lambda count: np.tile(start, (count, 1)),
        dynamics_fn=moved,
        observe_fn=lambda particles, moment: particles,
        noise_fn=lambda particles, moment: particles,
        weight_fn=weights,
        resample_fn=resampled,
        n_particles=PARTICLES,
        n_eff_threshold=RESAMPLE_BELOW,
    )

    poses = []
    for moment in moments:
        found.update(np.zeros(3) if moment.percepts else None, moment=moment)
        poses.append(found.mean_state)
    return np.array(poses)


def move(particles: Floats, motions: Floats, scale: float, rng: np.random.Generator) -> Floats:
    """Move (k, 3) particles by (n, 5) rows of motion, whose stated noise counts `scale` times."""
    x_m, y_m, heading_rad = particles.T
    for speed, turn_rate, dt, speed_sd, turn_rate_sd in motions:
        noise = rng.normal(size=(2, len(particles)))
        distance_m = (speed + scale * speed_sd * noise[0]) * dt
        turn_rad = (turn_rate + scale * turn_rate_sd * noise[1]) * dt

        middle_rad = heading_rad + turn_rad / 2
        x_m = x_m + distance_m * np.cos(middle_rad)
        y_m = y_m + distance_m * np.sin(middle_rad)
        heading_rad = heading_rad + turn_rad
    return np.column_stack([x_m, y_m, heading_rad])


def likelihoods(
    particles: Floats, percepts: Sequence[Percept], surveyed: Surveyed, scale: float
) -> Floats:
    """Return (k,) likelihoods of ranges and bearings, Gaussian, up to a factor."""
    log = np.zeros(len(particles))
    for percept in percepts:
        if percept.name not in surveyed:
            continue
        x_m, y_m = surveyed[percept.name]
        right_m = x_m - particles[:, 0]
        up_m = y_m - particles[:, 1]

        range_error = (np.hypot(right_m, up_m) - percept.range_m) / (scale * percept.range_sd_m)
        turned_rad = np.arctan2(up_m, right_m) - particles[:, 2] - percept.bearing_rad
        bearing_rad = np.arctan2(np.sin(turned_rad), np.cos(turned_rad))
        bearing_error = bearing_rad / (scale * percept.bearing_sd_rad)
        log -= (range_error**2 + bearing_error**2) / 2

    relative: Floats = np.exp(log - log.max())
    return relative + MIN_WEIGHT
