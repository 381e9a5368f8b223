"""Buildings that are torn down while the robot drives."""

from __future__ import annotations

import numpy as np
import pytest

from cogmap.errors import ConfigError
from cogmap.runtime.run import LOCKSTEP
from cogmap.schemas.sensing import MotorCommand, Percepts, TrueTown
from cogmap.services.sim.layout.removals import Removal, RemovedBuildings
from cogmap.services.sim.module import Config, build
from cogmap.services.sim.percept_level.percepts import PerceptErrors
from cogmap.testing import of_type


def _config(**changes: object) -> Config:
    exact = PerceptErrors(detected=1.0, right_name=1.0, precision=1.0)
    usual: dict[str, object] = {
        "seed": 3,
        "town": "blocks",
        "sensing": "percepts",
    }
    usual |= {"percepts": exact}
    return Config(**(usual | changes))  # type: ignore[arg-type]


def _views(config: Config, count: int) -> tuple[list[Percepts], list[TrueTown]]:
    """What a robot that stands sees."""
    module = build(config, run=LOCKSTEP)
    answers = list(module.start() if module.start else [])
    for _ in range(count):
        stamp_ns = of_type(Percepts, answers)[-1].stamp_ns
        still = MotorCommand(stamp_ns=stamp_ns, left_wheel_rad_s=0.0, right_wheel_rad_s=0.0)
        answers += module.feed(still)
    return of_type(Percepts, answers), of_type(TrueTown, answers)


def test_a_building_that_is_gone_is_not_seen_and_the_town_is_told_anew() -> None:
    before, (town,) = _views(_config(), 10)
    labels = {percept.name for view in before for percept in view.objects}
    seen = [number for number, each in enumerate(town.buildings) if each.name in labels]
    gone = [Removal(building=number, from_s=1.0) for number in seen]

    after, towns = _views(_config(removals=gone), 10)
    late = [view for view in after if view.stamp_ns > 1_000_000_000]
    assert labels
    assert late
    assert not labels & {percept.name for view in late for percept in view.objects}
    assert len(towns[-1].buildings) == len(town.buildings) - len(seen)
    walls = np.asarray(towns[-1].walls_m.numpy())
    assert len(walls) == len(np.asarray(town.walls_m.numpy())) - 4 * len(seen)


def test_buildings_go_when_the_schedule_says_so() -> None:
    schedule = [Removal(building=1, from_s=2.0), Removal(building=0, from_s=1.0)]
    removed = RemovedBuildings(2, schedule)

    assert not removed.advance(500_000_000)
    assert removed.advance(1_000_000_000)
    assert removed.numbers == {0}
    assert removed.advance(5_000_000_000)
    assert removed.numbers == {0, 1}
    assert not removed.advance(6_000_000_000)


def test_the_removal_of_a_building_that_is_not_there_is_refused() -> None:
    with pytest.raises(ConfigError, match="no building 5"):
        RemovedBuildings(5, [Removal(building=5, from_s=0.0)])


def test_cameras_refuse_that_a_building_goes() -> None:
    with pytest.raises(ConfigError, match="removals"):
        build(_config(sensing="cameras", removals=[Removal(building=0, from_s=1.0)]), run=LOCKSTEP)
