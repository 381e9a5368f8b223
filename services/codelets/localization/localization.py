"""The localization codelet: where the agent is (paper §5.4, eq. 1-3).

Recursive Bayes by rejection sampling: samples move with the self-motion, and stay with a
probability proportional to the likelihood of what is seen. Its cost grows with the landmarks in
view, not on the map.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cogmap.errors import MessageError
from cogmap.geometry.se2 import compose, mean_pose, relative
from cogmap.graph.graph import nearest_place
from schemas.array import Array
from schemas.base import Scalar
from schemas.cognition import Task
from schemas.graph import Node, Operation
from services.codelets.config import Config
from services.codelets.localization.measurement_model import (
    MOVING,
    Sighting,
    compare,
    log_likelihood,
    sightings,
)
from services.codelets.localization.motion_model import (
    POSE_COLUMNS,
    RANGE,
    SPEED,
    TURN,
    dead_reckon,
    move,
    with_gains,
)
from services.codelets.localization.recovery import look_around, seen_before, turn_about
from services.codelets.localization.sampling import (
    Samples,
    centred,
    generator,
    inflate,
    rejection_resample,
    resample,
    tempering_exponent,
)
from services.codelets.mapping.path import (
    ODOMETRY_FACTS,
    VARIANCE_FACTS,
    odometry_of,
    variances_of,
)
from services.codelets.mapping.places import place_link

WIDER = 1.5
WIDENINGS = 6
ALONE = 3
SEVERAL = 2
STAGES = 3
# Headings a radian apart, and those whose mean direction is no longer than that of a spread of one.
TURNED_RAD = 1.0
ALIKE = 0.6
FORGOTTEN_S = 20.0


@dataclass(frozen=True)
class Found:
    """The samples that stay, the share of those tried that they are, and for how many views nothing
    has fitted.

    `missed` names the landmark that was the first not to fit; `others` says whether another did not
    fit since: then it is the agent who is elsewhere, not the landmark. `carried` says that it was
    found where it cannot have gone.
    """

    samples: Samples
    share: float = 1.0
    astray: int = 0
    missed: str = ""
    others: bool = False
    carried: bool = False


def localize(task: Task, config: Config) -> list[Operation]:
    """Move the self node's samples, correct them by the landmarks in view, and link it to its new
    place.

    Where the paper starts each step from the mean of the samples, these go on from the samples
    themselves: what the agent does not know of its heading now, it must still not know when it
    comes to matter.
    """
    self_node = next((node for node in task.nodes if node.kind == "self"), None)
    if self_node is None or self_node.samples is None:
        raise MessageError(f"task {task.task_id} has no self node with samples")
    rng = generator(task.task_id)
    before = with_gains(np.array(self_node.samples.numpy(), np.float64), config, rng)
    motions = np.asarray(task.motions.numpy(), np.float64)
    moved = move(resample(before, config.samples, 0.0, rng), motions, config, rng)
    stands_ns = _stands_since(self_node, bool(motions[:, :2].any()))
    seen = sightings(task.percepts, task.nodes, config.largest_landmark_sd_m, stands_ns)
    past = _past(self_node, moved, task.stamp_ns)
    found = past if seen is None else _correct(past, seen, config, rng)
    odometry = dead_reckon(
        odometry_of(self_node), motions, found.samples[:, POSE_COLUMNS:].mean(axis=0)
    )
    variances = variances_of(self_node) + np.square(motions[:, 3:5] * motions[:, 2:3]).sum(axis=0)
    if seen is not None and found.others:
        found = _look_around(found, task, odometry, config, rng)
    if found.carried:
        # Who was carried away felt nothing of it: the way there counts as one that was gone, as
        # sure as it is found.
        odometry = compose(odometry, relative(mean_pose(moved), mean_pose(found.samples)))
        variances += np.square(centred(found.samples)[1]).mean(axis=0)[1:POSE_COLUMNS]
    return _self_operations(
        task, self_node, found, stands_ns, np.concatenate([odometry, variances])
    )


def _stands_since(node: Node, moves: bool) -> int:
    """The stamp at which the agent came to stand where it is; MOVING where it did not."""
    if moves:
        return MOVING
    before = int(node.attributes.get("stands_ns", MOVING))
    return int(node.attributes.get("stamp_ns", 0)) if before == MOVING else before


def _past(node: Node, moved: Samples, stamp_ns: int) -> Found:
    """What was found before; that something did not fit is forgotten where nothing has come of it
    for long.
    """
    facts = node.attributes
    if stamp_ns > int(facts.get("missed_ns", 0)) + FORGOTTEN_S * 1e9:
        return Found(moved)
    return Found(
        moved,
        1.0,
        int(facts.get("astray", 0)),
        str(facts.get("missed", "")),
        bool(facts.get("others", False)),
    )


def _correct(past: Found, seen: Sighting, config: Config, rng: np.random.Generator) -> Found:
    """Reject by what is in view. Where most of that fits no sample, all stay, until the agent must
    be elsewhere.

    Where it would leave too few, the same is done in stages: each by a part of the likelihood, the
    product of all parts being the whole, from samples as many as before, drawn around those that
    the stage before has left. Stages cannot follow a heading that may be any: there the landmarks
    say which headings are tried.
    """
    if _may_be_turned(past.samples[:, 2]) and seen.has_bearing.any():
        return Found(turn_about(past.samples, seen, config, rng), 0.0)
    compared = compare(past.samples, seen)
    fitting = int(np.add.reduce(compared.squared < config.gate**2, axis=0, dtype=np.uint8).max())
    if 2 * fitting < len(seen.labels) or not fitting:
        return _stray(past, seen, config, rng)
    samples = past.samples
    left = 1.0
    share = 1.0
    for stage in range(STAGES):
        scores = log_likelihood(compared.density, config.outlier_share) / config.correlated_views
        part = (
            left
            if stage == STAGES - 1
            else min(left, tempering_exponent(scores, config.kept_samples / len(scores)))
        )
        chosen, kept = rejection_resample(samples, part * scores, config.kept_samples, rng)
        share = share * kept
        left = left - part
        if left <= 0:
            break
        samples = resample(chosen, len(samples), 0.0, rng)
        compared = compare(samples, seen)
    return Found(chosen, share)


def _may_be_turned(headings_rad: Samples) -> bool:
    """Whether the headings (n,) are so far apart that nearly any may be the agent's."""
    apart = np.ptp(headings_rad) > TURNED_RAD
    return bool(
        apart and np.hypot(np.cos(headings_rad).mean(), np.sin(headings_rad).mean()) < ALIKE
    )


def _stray(past: Found, seen: Sighting, config: Config, rng: np.random.Generator) -> Found:
    """Nothing fits: the agent is less sure of its pose than it took itself to be, the more the
    longer that goes on.

    But one landmark that does not fit may stand elsewhere, or be another.
    """
    astray = past.astray + 1
    missed = past.missed or seen.labels[0]
    others = past.others or any(label != missed for label in seen.labels)
    less_sure = (
        inflate(past.samples, WIDER, rng) if others and astray <= WIDENINGS else past.samples
    )
    return Found(less_sure, 0.0, astray, missed, others)


def _look_around(
    lost: Found, task: Task, odometry: Samples, config: Config, rng: np.random.Generator
) -> Found:
    """Where several landmarks have not fitted for long, the agent is elsewhere: it looks for itself
    by all it has seen.

    That is as soon as this tells where it may be: two landmarks, or, later, one; and at once where
    it is less sure of its position than one look at a landmark makes it.
    """
    now = {percept.label for percept in task.percepts}
    percepts = [
        *task.percepts,
        *(each for each in seen_before(task, odometry) if each.label not in now),
    ]
    seen = sightings(percepts, task.nodes, config.largest_landmark_sd_m, MOVING)
    if seen is None:
        return lost
    enough = config.astray if len(seen.labels) > 1 else ALONE * config.astray
    off_m = centred(lost.samples[:, :2])[1]
    unsure = float(np.square(off_m).sum(axis=1).mean()) > float(seen.range_m.min()) ** 2
    if lost.astray < (SEVERAL if unsure else enough):
        return lost
    return Found(look_around(lost.samples, seen, config, rng), 0.0, carried=not unsure)


def _self_operations(
    task: Task, node: Node, found: Found, stands_ns: int, odometry: Samples
) -> list[Operation]:
    mean, off = centred(found.samples)
    sd = np.sqrt(np.einsum("nd,nd->d", off, off) / len(off))
    cell = nearest_place(mean[0], mean[1], task.cell_m)
    gains = mean[[SPEED, TURN, RANGE]].tolist()
    missed_ns = int(node.attributes.get("missed_ns", 0))
    attributes: dict[str, Scalar] = node.attributes | {
        "x_m": float(mean[0]),
        "y_m": float(mean[1]),
        "heading_rad": float(mean[2]),
        "x_sd_m": float(sd[0]),
        "y_sd_m": float(sd[1]),
        "heading_sd_rad": float(sd[2]),
        "kept_share": found.share,
        "astray": found.astray,
        "missed": found.missed,
        "others": found.others,
        "missed_ns": task.stamp_ns
        if found.astray > int(node.attributes.get("astray", 0))
        else missed_ns,
        "fits_ns": int(node.attributes.get("fits_ns", 0)) if found.astray else task.stamp_ns,
        "stands_ns": stands_ns,
        **dict(zip(("speed_gain", "turn_gain", "range_gain"), gains, strict=True)),
        **dict(zip((*ODOMETRY_FACTS, *VARIANCE_FACTS), odometry.tolist(), strict=True)),
        "stamp_ns": task.stamp_ns,
        "place": cell,
    }
    gained = bool(sd[POSE_COLUMNS:].any())
    samples = Array.of(found.samples if gained else found.samples[:, :POSE_COLUMNS])
    moved = Node(
        id=node.id,
        kind=node.kind,
        activation=1.0,
        base_level=1.0,
        attributes=attributes,
        samples=samples,
    )
    return [moved, *place_link(node, cell)]
