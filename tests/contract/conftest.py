"""One suite over both buses: what joins a `network` is in memory, or at a real router."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from tests.support.system.networks import InMemory, Network, OverZenoh, routed


@pytest.fixture(scope="session")
def endpoint() -> Iterator[str]:
    """The endpoint of a router of this test run's own."""
    with routed() as address:
        yield address


@pytest.fixture(params=["memory", "zenoh"])
def network(request: pytest.FixtureRequest) -> Iterator[Network]:
    joined = (
        InMemory() if request.param == "memory" else OverZenoh(request.getfixturevalue("endpoint"))
    )
    yield joined
    joined.close()


@pytest.fixture
def over_zenoh(endpoint: str) -> Iterator[OverZenoh]:
    joined = OverZenoh(endpoint)
    yield joined
    joined.close()
