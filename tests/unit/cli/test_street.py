"""`cogmap street`: what counts as an answer."""

from __future__ import annotations

from cogmap.cli.street import is_as_asked
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
