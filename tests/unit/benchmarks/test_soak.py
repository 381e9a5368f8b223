"""What grew in a long run, by its samples, and the rounds that the agent is sent on."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from msgspec.structs import replace

from benchmarks.soak import trends
from benchmarks.soak.processes import name_of
from benchmarks.soak.rounds import PATIENCE_CYCLES, Rounds, next_round
from benchmarks.soak.trends import Sample, Sizes, Span
from cogmap.cli.launch.command_line import cogmap_command
from cogmap.schemas.codelets import Offer
from cogmap.schemas.graph import Delta, DropNode, Phase
from cogmap.schemas.nodes import NEVER_NS, Goal

RUN_S = 3600.0
SPAN = Span.after_warm_up(RUN_S)
AT_S = np.linspace(0.0, RUN_S, 361)


def _life(memory_mb: np.ndarray, descriptors: np.ndarray) -> list[Sample]:
    rows = zip(AT_S.tolist(), memory_mb.tolist(), descriptors.tolist(), strict=True)
    return [Sample(at_s, int(1e6 * mb), int(count)) for at_s, mb, count in rows]


def test_memory_that_grows_has_its_slope_and_the_warm_up_has_none() -> None:
    warm_up_mb = np.where(SPAN.begin_s > AT_S, 40.0 * AT_S / SPAN.begin_s, 40.0)
    noise_mb = np.random.default_rng(1).normal(0.0, 0.05, AT_S.size)
    none = np.zeros_like(AT_S)

    flat = trends.slope_mb_per_h(_life(warm_up_mb, none), SPAN)
    grown = trends.slope_mb_per_h(_life(warm_up_mb + noise_mb + 3.0 * AT_S / 3600, none), SPAN)

    assert flat == pytest.approx(0.0, abs=1e-6)
    assert grown == pytest.approx(3.0, abs=0.1)


def test_a_process_that_lived_only_in_the_warm_up_has_no_slope() -> None:
    samples = [Sample(float(at_s), 10, 5) for at_s in range(100)]

    assert np.isnan(trends.slope_mb_per_h(samples, SPAN))


def test_a_descriptor_that_opens_for_a_moment_is_no_growth_and_one_that_stays_is() -> None:
    memory_mb = np.full_like(AT_S, 40.0)
    opened = np.full_like(AT_S, 20.0)
    opened[[5, 200, 350]] = 25.0
    leaked = 20.0 + (AT_S > 0.6 * RUN_S)

    assert trends.descriptors_growth(_life(memory_mb, opened), SPAN) == 0.0
    assert trends.descriptors_growth(_life(memory_mb, leaked), SPAN) == 1.0


def test_cycles_are_compared_between_the_begin_after_the_warm_up_and_the_end() -> None:
    cycle_ms = np.where(SPAN.begin_s > AT_S, 500.0, 100.0)
    cycle_ms[AT_S > RUN_S - 60.0 * 5] = 120.0

    begin_ms, end_ms = trends.cycle_p50_ms(AT_S, cycle_ms, SPAN)

    assert (begin_ms, end_ms) == (100.0, 120.0)


def _sizes(*journal_mb: float) -> list[Sizes]:
    return [
        Sizes(float(at_s), int(1e6), {"workspace.journal": int(1e6 * mb)}, 0)
        for at_s, mb in enumerate(journal_mb)
    ]


@pytest.mark.parametrize(
    ("journal_mb", "is_bounded"),
    [
        ((1, 30, 60), True),
        ((1, 60, 90), False),
        ((1, 60, 20, 75, 20), True),
        ((1, 60, 10, 75, 90), False),
    ],
    ids=["never long", "grows for ever", "compacted each time", "compacted once, and no more"],
)
def test_a_journal_is_bounded_if_it_is_short_or_compacted(
    journal_mb: tuple[float, ...], is_bounded: bool
) -> None:
    assert trends.is_journal_bounded(_sizes(*journal_mb), 64e6) is is_bounded


def test_a_log_is_bounded_by_its_parts_together() -> None:
    assert trends.is_log_bounded(_sizes(1, 2), 1e6)
    assert not trends.is_log_bounded(_sizes(1, 2), 1e6 - 1)


def test_a_process_has_the_name_of_what_it_does() -> None:
    module = cogmap_command("module", "codelets", "--instance", "codelets-2", "--held")
    server = [sys.executable, "-P", "-m", "cogmap.cli.launch.forking.server", "5"]

    assert name_of(module) == "codelets-2"
    assert name_of(cogmap_command("log", "record", "--tied")) == "recorder"
    assert name_of(cogmap_command("router", "--tied")) == "router"
    assert name_of(server) == "fork_server"
    assert name_of(["ps"]) == "other"


FIRST = Goal(id="goal/corner 1", x_m=1.0, reached_ns=NEVER_NS)
SECOND = Goal(id="goal/end", x_m=2.0, after=FIRST.id, reached_ns=NEVER_NS)


def test_the_next_round_has_the_same_places_in_the_same_order_none_of_them_reached() -> None:
    reached = [replace(goal, reached_ns=7) for goal in (FIRST, SECOND)]

    dropped_first, dropped_second, first, second = next_round(reached, 3)

    assert {dropped_first, dropped_second} == {DropNode(id=FIRST.id), DropNode(id=SECOND.id)}
    assert isinstance(first, Goal)
    assert isinstance(second, Goal)
    assert (first.x_m, second.x_m) == (1.0, 2.0)
    assert second.after == first.id != FIRST.id
    assert {first.reached_ns, second.reached_ns} == {NEVER_NS}


def test_a_round_is_offered_once_all_goals_are_reached_and_again_if_it_was_lost() -> None:
    rounds = Rounds()
    at_cycle = [1, 2, 3, 3 + PATIENCE_CYCLES]
    reached = [replace(goal, reached_ns=7) for goal in (FIRST, SECOND)]
    graphs = [[reached[0], SECOND], reached, [], []]

    offers = []
    for version, (cycle, operations) in enumerate(zip(at_cycle, graphs, strict=True)):
        rounds.graph.change([*operations])
        rounds.graph.cycle = cycle
        delta = Delta(version=version, cycle=cycle, phase=Phase.END, operations=[])
        offers.append(rounds.on_delta(delta))

    assert [len(offered) for offered in offers] == [0, 1, 0, 1]
    assert rounds.number == 1
    (offer,) = offers[1]
    assert isinstance(offer, Offer)
    assert len(offer.operations) == 4
