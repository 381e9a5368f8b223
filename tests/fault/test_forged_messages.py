"""Messages that make sense but for one thing, on the bus of an agent that drives: the short form of
`python -m benchmarks forge`.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from benchmarks.forge.cases import Case, Kind, Mode
from benchmarks.forge.measure import Campaign
from cogmap.schemas import topics

SEED = 1
LIMIT_S = 180.0
CASES = [
    Case(topics.PERCEPTS.name, Kind.NEGATIVE_STAMP, Mode.LOCKSTEP),
    Case(topics.STEREO.name, Kind.OTHER_SOURCE, Mode.LOCKSTEP),
    Case(topics.SELF_MOTION.name, Kind.NEGATIVE_STAMP, Mode.LOCKSTEP),
    Case(topics.MOTOR_COMMAND.name, Kind.NEGATIVE_STAMP, Mode.LOCKSTEP),
    Case(topics.SELF_MOTION.name, Kind.FAR_NUMBER, Mode.LOCKSTEP),
    Case(topics.SELF_MOTION.name, Kind.NEW_INCARNATION, Mode.LOCKSTEP),
    Case(topics.SELF_MOTION.name, Kind.FLOOD, Mode.LOCKSTEP),
    Case(topics.LEARNED.name, Kind.OLD_STAMP, Mode.LOCKSTEP),
    Case(topics.DELTA.name, Kind.FAR_VERSION, Mode.LOCKSTEP),
]


@pytest.fixture(scope="module")
def campaign(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Campaign]:
    folder: Path = tmp_path_factory.mktemp("forge")
    campaign = Campaign(folder, SEED, LIMIT_S)
    yield campaign
    campaign.close()


@pytest.mark.parametrize("case", CASES, ids=str)
def test_a_lie_neither_stops_nor_steers_the_agent_and_is_named(
    campaign: Campaign, case: Case
) -> None:
    outcome = campaign.tell(case)

    assert outcome.lies > 0
    assert not outcome.failures
