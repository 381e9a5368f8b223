"""How many of a drive's buildings were taught, as found from what they look like."""

from __future__ import annotations

import numpy as np
import pytest

from cogmap.errors import MessageError
from cogmap.schemas.array import Array
from cogmap.services.epam.recognition.objects import Appearance, Recognition
from cogmap.services.epam.recognition.taught_share import LATEST_SIGHTINGS, TaughtShare

CALIBRATED = 0.5
APPEARANCE = Appearance(np.zeros(64, np.float32), 1.0, 1.0)


def seen(taught: float, *, building: float = 1.0) -> Recognition:
    """Return the recognition of what is a building with the probability `building`, and, if so, a
    taught one with the probability `taught`, where that was calibrated.
    """
    return Recognition(
        label="bakery",
        activation=building * taught,
        evidence=building * taught,
        unknown=building * (1 - taught),
        background=1 - building,
        names={"bakery": building * taught},
        appearance=APPEARANCE,
    )


def looks(share: float, count: int) -> list[Recognition]:
    """Return what `count` buildings look like, of which a `share` were taught: the log odds of
    those are normal about 2, and of the others about -2, with the variance that makes them
    calibrated.
    """
    rng = np.random.default_rng(5)
    is_taught = rng.random(count) < share
    log_odds = np.where(is_taught, 2.0, -2.0) + 2.0 * rng.normal(size=count)
    return [seen(float(1 / (1 + np.exp(-each)))) for each in log_odds]


@pytest.mark.parametrize("share", [0.05, 0.2, 0.4])
def test_the_share_of_taught_buildings_is_found_from_their_looks(share: float) -> None:
    found = TaughtShare(CALIBRATED)
    for look in looks(share, 3000):
        found.add([look])

    odds = np.exp(found.log_ratio)
    assert odds / (1 + odds) == pytest.approx(share, abs=0.05)


def test_where_most_were_taught_a_stranger_is_no_less_likely() -> None:
    found = TaughtShare(CALIBRATED)
    found.add([seen(0.99)] * 1000)

    assert found.log_ratio == 0.0


def test_what_is_no_building_counts_for_nothing() -> None:
    found = TaughtShare(CALIBRATED)
    found.add([seen(0.1, building=0.0)] * 1000)

    assert not found.log_likelihood.any()


def test_another_district_is_another_share() -> None:
    found = TaughtShare(CALIBRATED)
    for _ in range(3 * int(LATEST_SIGHTINGS)):
        found.add([seen(0.01)])
    of_strangers = found.log_ratio
    for look in looks(0.5, int(LATEST_SIGHTINGS)):
        found.add([look])

    assert of_strangers < -3.0
    assert found.log_ratio > -1.5


def test_likelihoods_of_other_shares_are_refused() -> None:
    with pytest.raises(MessageError, match="likelihoods of the share"):
        TaughtShare(CALIBRATED).restore(Array.of(np.zeros(3)))


def test_the_count_goes_on_after_a_restart() -> None:
    first = TaughtShare(CALIBRATED)
    first.add(looks(0.1, 200))
    second = TaughtShare(CALIBRATED)
    second.restore(first.published())

    assert second.log_ratio == first.log_ratio < -0.5
