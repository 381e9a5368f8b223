"""Maps that people drew, read from a file, and compared with the model's."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from cogmap.cli.experiment.city_maps import city_maps
from cogmap.errors import UsageError
from cogmap.experiments.city_maps import people
from cogmap.experiments.city_maps.environment import Environment, environments
from cogmap.experiments.city_maps.measure import CityMap, Learned
from cogmap.experiments.city_maps.sources import grown, grown_environments

(PLACE,) = environments(grown(1), 1, 1)
EXAMPLE = Path(__file__).parents[3] / "examples" / "human_maps.csv"


def _file(folder: Path, text: str) -> Path:
    path = folder / "people.csv"
    path.write_text(text)
    return path


def test_the_true_map_has_no_error_whoever_draws_it(tmp_path: Path) -> None:
    path = _file(tmp_path, "# a comment\n" + people.template([PLACE]))

    (error_km2,) = people.read(path, [PLACE]).values()
    assert error_km2 == pytest.approx(0, abs=1e-6)


@pytest.mark.parametrize(
    ("row", "says"),
    [
        ("atlantis,anna,house 1,0,0", "line 10: expected one of the maps"),
        (f"{PLACE.name},anna,palace,0,0", "line 10: expected one of its buildings"),
        (f"{PLACE.name},truth,{PLACE.names[0]},0,0", "once from truth"),
        (f"{PLACE.name},anna,{PLACE.names[0]},0,nan", "two numbers"),
        (f"{PLACE.name},anna,{PLACE.names[0]},0", "two numbers"),
        (f"{PLACE.name},anna,{PLACE.names[0]},0,0", "leave that person's map out"),
    ],
)
def test_a_row_that_is_no_place_of_a_building_is_named(tmp_path: Path, row: str, says: str) -> None:
    path = _file(tmp_path, people.template([PLACE]) + row + "\n")

    with pytest.raises(UsageError, match=says):
        people.read(path, [PLACE])


def test_a_file_with_other_columns_is_refused(tmp_path: Path) -> None:
    path = _file(tmp_path, "map,x,y\n")

    with pytest.raises(UsageError, match="map,person,building,x,y"):
        people.read(path, [PLACE])


def _city(environment: Environment, error_km2: float) -> CityMap:
    errors = dict.fromkeys(("positions", "heading"), error_km2)
    learned = Learned(errors, 0, {}, {}, {})
    return CityMap(environment, (learned,))


def test_errors_are_correlated_over_the_maps_of_the_same_name() -> None:
    maps = [
        _city(replace(PLACE, name=name), km2)
        for name, km2 in zip("abcd", (1, 2, 3, 9), strict=True)
    ]
    found = people.metrics(maps, {"a": 2.0, "b": 4.0, "c": 6.0, "elsewhere": 5.0})

    assert found["human_maps"] == 3
    assert found["human_r_paper"] == pytest.approx(1.0)
    assert found["human_r2_paper"] == pytest.approx(1 - (1 + 4 + 9) / 8)

    with pytest.raises(UsageError, match="people drew 2 of the maps"):
        people.metrics(maps, {"a": 2.0, "b": 4.0})


def test_the_example_is_marked_as_synthetic_and_of_the_maps_of_seed_1() -> None:
    assert EXAMPLE.read_text().startswith("# Synthetic")

    errors_km2 = people.read(EXAMPLE, grown_environments(4, 1))
    assert len(errors_km2) == 4
    assert np.ptp(list(errors_km2.values())) > 0


def test_a_file_of_too_few_of_the_maps_is_refused_before_any_is_driven(tmp_path: Path) -> None:
    drawn = people.template(grown_environments(2, 1))
    options = ["--maps", "3", "--human", str(_file(tmp_path, drawn)), "--out", str(tmp_path)]

    done = CliRunner().invoke(city_maps, options)

    assert isinstance(done.exception, UsageError)
    assert "people drew 2 of the maps that are measured" in str(done.exception)
    assert "traversals" not in done.output
