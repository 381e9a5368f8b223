"""The localization codelet: where the agent is (paper §5.4, eq. 1-3).

Recursive Bayes by rejection sampling: samples move with the self-motion, and are kept with a
probability proportional to the likelihood of what is seen. Its cost grows with the landmarks in
view, not with the map. There are three rules for that: the paper's own, the same by spikes, and
ours.
"""

from __future__ import annotations

import msgspec
import numpy as np

from cogmap.errors import MessageError
from cogmap.geometry.arrays import Floats
from cogmap.graph.graph import Graph
from cogmap.runtime.codelet import Answer, Codelet, CycleContext
from cogmap.schemas.array import Matrix
from cogmap.schemas.codelets import Task
from cogmap.schemas.graph import Link, Phase
from cogmap.schemas.nodes import (
    NEVER_NS,
    POSE_COLUMNS,
    SELF_ID,
    LinkKind,
    Misfits,
    Object,
    Observations,
    PathIntegration,
    PathSegment,
    Self,
    SelfColumn,
    nearest_place,
    object_id,
)
from cogmap.services.codelets.config import SECTION, Config
from cogmap.services.codelets.localization import cogmap_rule, paper_rule, spiking_rule
from cogmap.services.codelets.localization.cogmap_rule import Localized, Step
from cogmap.services.codelets.localization.measurement_model import measurements
from cogmap.services.codelets.localization.misfits import Estimate
from cogmap.services.codelets.localization.motion_model import GAINS, dead_reckon
from cogmap.services.codelets.localization.sampling import centred, generator

NO_GAINS = np.zeros(GAINS)


def due(context: CycleContext, graph: Graph, config: Config) -> list[Task]:
    """Return one task in each cycle."""
    percepts = [*context.percepts.objects, *context.waiting]
    seen = [object_id(label) for label in sorted(percept.label for percept in percepts)]
    about = [SELF_ID, *(name for name in seen if name in graph.nodes)]
    return [context.task(CODELET.name, about, percepts=percepts, with_motions=True)]


def run(task: Task, graph: Graph, config: Config) -> Answer:
    """Move the self node's samples, correct them by the landmarks in view, and link it to its new
    place, by the rule that `config.localization` names.
    """
    agent = graph.agent
    if agent is None or task.motions is None:
        raise MessageError(f"task {task.task_id}: no self node, or no self-motion")

    motions = np.asarray(task.motions.numpy(), np.float64)
    if agent.stamp_ns > task.since_ns:
        # An answer that came late has moved the agent since this task was made.
        motions = _later(motions, (task.stamp_ns - agent.stamp_ns) * 1e-9)
    moved_sd = motions[:, 3:5] * motions[:, 2:3]
    variances = agent.odometry.variances() + np.square(moved_sd).sum(axis=0)

    stationary_since_ns = NEVER_NS
    if not motions[:, :2].any():
        stationary_since_ns = agent.stationary_since_ns
        if stationary_since_ns == NEVER_NS:
            stationary_since_ns = max(0, agent.stamp_ns)

    rule = cogmap_rule.localized if config.localization == "cogmap" else _from_mean
    step = Step(task, graph, agent, motions, variances, stationary_since_ns)
    found, odometry, variances = rule(step, config, generator(task.task_id))

    after = msgspec.structs.replace(
        _self_node(task, agent, found),
        stationary_since_ns=stationary_since_ns,
        odometry=PathIntegration(
            x_m=float(odometry[0]),
            y_m=float(odometry[1]),
            heading_rad=float(odometry[2]),
            variance_m2=float(variances[0]),
            variance_rad2=float(variances[1]),
        ),
    )
    place = nearest_place(after.x_m, after.y_m, graph.cell_m(after.map), after.map)
    return Answer([after, Link(source=after.id, target=place, kind=LinkKind.AT)])


CODELET = Codelet(
    name="localization",
    phase=Phase.LOCALIZATION,
    due=due,
    run=run,
    reads=frozenset({Self, Object, PathSegment, Observations}),
    writes=frozenset({Self, LinkKind.AT}),
    config=Config,
    section=SECTION,
)


def _from_mean(step: Step, config: Config, rng: np.random.Generator) -> Localized:
    """Localize as the paper has it, by rejection or by spikes: every landmark in view counts, from
    its first sighting on, and from where the agent stands too.
    """
    agent = step.agent
    samples = paper_rule.moved(agent.samples.numpy(), step.motions, config, rng)
    seen = measurements(step.task.percepts, step.graph, NEVER_NS, 1)
    share = 1.0
    if seen is not None:
        rule = spiking_rule if config.localization == "spiking" else paper_rule
        samples, share = rule.corrected(samples, seen, rng)

    odometry = dead_reckon(agent.odometry.pose(), step.motions, NO_GAINS)
    return Localized(Estimate(samples, share), odometry, step.variances)


def _later(motions: Floats, duration_s: float) -> Floats:
    """Return the rows of self-motion in the last `duration_s`, by their own durations."""
    durations_s = motions[:, 2]
    until_end_s = np.cumsum(durations_s[::-1])[::-1]
    middle_s = until_end_s - durations_s / 2
    later: Floats = motions[middle_s < duration_s]
    return later


def _self_node(task: Task, agent: Self, found: Estimate) -> Self:
    """Return the self node with the estimate after localization."""
    mean, offsets = centred(found.samples)
    sd = np.sqrt(np.einsum("nd,nd->d", offsets, offsets) / len(offsets))
    has_gains = bool(sd[POSE_COLUMNS:].any())
    samples = found.samples if has_gains else found.samples[:, :POSE_COLUMNS]

    past = agent.misfits
    is_misfit = found.misfit_count > past.count
    misfits = Misfits(
        count=found.misfit_count,
        label=found.first_misfit,
        is_lost=found.is_lost,
        last_ns=task.stamp_ns if is_misfit else past.last_ns,
        last_fit_ns=past.last_fit_ns if found.misfit_count else task.stamp_ns,
        not_elsewhere_ns=task.stamp_ns if found.is_not_elsewhere else past.not_elsewhere_ns,
        found_ns=task.stamp_ns if found.was_kidnapped else past.found_ns,
    )
    return msgspec.structs.replace(
        agent,
        activation=1.0,
        base_level=1.0,
        cycle=task.cycle,
        stamp_ns=task.stamp_ns,
        x_m=float(mean[0]),
        y_m=float(mean[1]),
        heading_rad=float(mean[2]),
        x_sd_m=float(sd[0]),
        y_sd_m=float(sd[1]),
        heading_sd_rad=float(sd[2]),
        kept_share=found.share,
        speed_gain=float(mean[SelfColumn.SPEED_GAIN]),
        turn_gain=float(mean[SelfColumn.TURN_GAIN]),
        range_gain=float(mean[SelfColumn.RANGE_GAIN]),
        misfits=misfits,
        samples=Matrix.of(samples),
    )
