"""Every domain driven with every variant of the rules, by all cases."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from cogmap.errors import CogmapError
from cogmap.experiments.ablation.outcome import Case, Outcome, failed
from cogmap.experiments.ablation.variants import PLANNING, VARIANTS, Rules
from cogmap.parallel import Progress, parallel_map

# By the domain's name and the variant's, the outcome of each case.
Measured = dict[tuple[str, str], list[Outcome]]
ERROR = "error"
RuleItems = tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class Domain:
    """Where the variants are compared: its cases, and the unit of its errors, or of another
    `quantity`. Where the robot is carried along a line, whether the agent `plans` its way or not,
    and how, changes nothing.
    """

    name: str
    label: str
    unit: str
    cases: Sequence[Case]
    plans: bool = False
    quantity: str = ERROR

    def effective(self, rules: Rules) -> RuleItems:
        """Return those of `rules` that can change a run, in the order of their names."""
        chosen = [(rule, value) for rule, value in rules.items() if self.plans or rule != PLANNING]
        return tuple(sorted(chosen))


@dataclass(frozen=True)
class Job:
    """One case with one variant."""

    case: Case
    rules: RuleItems


def measure(
    domains: Sequence[Domain],
    processes: int,
    progress: Progress,
    variants: Mapping[str, Rules] = VARIANTS,
) -> Measured:
    """Drive every case with every variant: the same whatever the number of processes.

    Two variants that cannot differ in a domain are driven once.
    """
    jobs: list[Job] = []
    first_job: dict[tuple[str, RuleItems], int] = {}
    for domain in domains:
        for rules in variants.values():
            key = (domain.name, domain.effective(rules))
            if key not in first_job:
                first_job[key] = len(jobs)
                jobs += [Job(case, domain.effective(rules)) for case in domain.cases]

    outcomes = parallel_map(driven, jobs, processes, progress)
    measured: Measured = {}
    for domain in domains:
        for name, rules in variants.items():
            first = first_job[domain.name, domain.effective(rules)]
            measured[domain.name, name] = outcomes[first : first + len(domain.cases)]

    return measured


def driven(job: Job) -> Outcome:
    """Drive a case. One that cannot be driven to its end is lost, and says why."""
    try:
        return job.case.drive(dict(job.rules))
    except CogmapError as error:
        return failed(str(error))
