"""`cogmap street`: what counts as an answer."""

from __future__ import annotations

import pytest

from cogmap.bus.memory import MemoryBus, MemoryNetwork
from cogmap.cli.street import Towns, check_known, is_as_asked
from cogmap.errors import NoAnswerError, UsageError
from cogmap.schemas.sensing import Street, StreetClosure, TrueTown


def _town(*closed: str) -> TrueTown:
    streets = []
    for name in ("Elm Street 1", "Oak Lane 2"):
        line_m = [(0.0, 0.0), (9.0, 0.0)]
        streets.append(Street(name=name, line_m=line_m, width_m=8.0, closed=name in closed))

    return TrueTown(seed=1, streets=streets, buildings=[])


def test_a_town_answers_where_the_street_is_as_asked() -> None:
    close = StreetClosure(street="Elm Street 1", closed=True)
    reopen = StreetClosure(street="Elm Street 1", closed=False)

    assert is_as_asked(_town("Elm Street 1"), close)
    assert not is_as_asked(_town("Oak Lane 2"), close)
    assert is_as_asked(_town(), reopen)


def test_a_town_without_the_street_answers_nothing() -> None:
    for closed in (True, False):
        closure = StreetClosure(street="Nowhere 1", closed=closed)
        assert not is_as_asked(_town(), closure)


def test_a_street_that_the_town_does_not_have_is_refused_with_what_may_be_meant() -> None:
    check_known(_town(), "Elm Street 1")
    with pytest.raises(UsageError, match="'Elm Street 1'"):
        check_known(_town(), "Elm Street 11")
    with pytest.raises(UsageError, match="cogmap street list"):
        check_known(_town(), "Qxyz")


def test_without_a_simulation_the_remedy_is_named() -> None:
    towns = Towns(MemoryBus(MemoryNetwork()))

    with pytest.raises(NoAnswerError, match="cogmap run"):
        towns.next(0.0)
