"""Who gets into a site's router, and what each may do there: ours, and zenohd where it is at hand.

The rules are loaded from the file that `cogmap keys make` writes for zenohd.
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator

import pytest

from benchmarks.access.grounds import Grounds, grounds
from benchmarks.access.measure import NO_CERTIFICATE, PLAIN, STRANGER, trials_by
from cogmap.bus.access.subjects import OBSERVER, OPERATOR, ROUTER

ZENOHD = shutil.which(os.environ.get("ZENOHD", "zenohd")) or ""
needs_zenohd = pytest.mark.skipif(not ZENOHD, reason="no zenohd: name it with ZENOHD")


@pytest.fixture(scope="module", params=["ours", pytest.param("zenohd", marks=needs_zenohd)])
def place(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Grounds]:
    program = ZENOHD if request.param == "zenohd" else ""
    with grounds(tmp_path_factory.mktemp("site"), program) as found:
        yield found


@pytest.mark.parametrize("who", [STRANGER, NO_CERTIFICATE, PLAIN])
def test_nobody_gets_in_without_a_certificate_of_the_site(who: str, place: Grounds) -> None:
    achieved = [trial for trial in trials_by(who, place) if trial.is_achieved]

    assert not achieved


@pytest.mark.parametrize("who", ["epam", "workspace", "motor", OPERATOR, OBSERVER, ROUTER])
def test_each_may_do_what_the_table_has_and_nothing_else(who: str, place: Grounds) -> None:
    trials = trials_by(who, place)

    assert trials
    assert [trial for trial in trials if trial.is_achieved != trial.is_allowed] == []


def test_perception_cannot_turn_the_wheels_and_motor_can(place: Grounds) -> None:
    achieved = {
        who: {trial.deed for trial in trials_by(who, place) if trial.is_achieved}
        for who in ("epam", "motor")
    }

    assert "publish motor/command" in achieved["motor"]
    assert "publish motor/command" not in achieved["epam"]
    assert "keep motor/command" not in achieved["epam"]
    assert "be motor" not in achieved["epam"]
    assert "subscribe camera/stereo" not in achieved["epam"]
