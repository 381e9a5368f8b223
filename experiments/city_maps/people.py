"""Maps that people drew of the environments, from a user's file, and how the model's errors compare
(paper §6.2).

A CSV file under the line map,person,building,x,y: a row says where a person put a building on a map
of its own, in any unit and direction. Lines that begin with # are ignored.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Iterator, Mapping, Sequence
from io import StringIO
from pathlib import Path
from typing import NamedTuple

import numpy as np

from cogmap.data.text import Line, numbered_lines
from cogmap.errors import UsageError
from cogmap.experiments.city_maps.correction import HEADING, POSITIONS
from cogmap.experiments.city_maps.environment import Environment
from cogmap.experiments.city_maps.measure import CityMap, aligned_error_km2
from cogmap.geometry.arrays import Floats

Persons = dict[str, dict[str, tuple[float, float]]]
COLUMNS = ("map", "person", "building", "x", "y")
GIVE = "people's maps as CSV"
MIN_MAPS = 3


class Row(NamedTuple):
    """Where a person put a building."""

    map_name: str
    person: str
    building: str
    x: float
    y: float


def read(path: Path, environments: Sequence[Environment]) -> dict[str, float]:
    """Return the mean error of people's maps in km^2 by the map's name, each aligned first.

    Raises UsageError naming the line of what is not a map or building of `environments`, and the
    map and person if a building is missing or given twice.
    """
    by_name = {environment.name: environment for environment in environments}
    drawn: dict[str, Persons] = {}

    for line, row in _rows(path):
        environment = by_name.get(row.map_name)
        if environment is None:
            raise line.wrong(f"one of the maps {', '.join(by_name)}")
        if row.building not in environment.names:
            raise line.wrong(f"one of its buildings {', '.join(environment.names)}")

        places = drawn.setdefault(row.map_name, {}).setdefault(row.person, {})
        if row.building in places:
            raise line.wrong(f"each building of {row.map_name} once from {row.person}")
        places[row.building] = row.x, row.y

    return {name: _mean_error_km2(path, by_name[name], own) for name, own in drawn.items()}


def check_number(environments: Sequence[Environment], people_km2: Mapping[str, float]) -> None:
    """Raise UsageError if people drew fewer than MIN_MAPS of the environments."""
    matched = [each for each in environments if each.name in people_km2]
    if len(matched) < MIN_MAPS:
        raise UsageError(
            f"people drew {len(matched)} of the maps that are measured, and a correlation takes "
            f"{MIN_MAPS}: give maps of more, or measure more with --maps"
        )


def metrics(maps: Sequence[CityMap], people_km2: Mapping[str, float]) -> dict[str, float]:
    """Compare the errors of maps with people's of the same maps, by name; those of other maps do
    not count.

    `human_r_paper` and `human_r2_paper` are over the maps, of the mean error by the paper's rule
    with people's; `ours` is with headings. Raises UsageError as `check_number` does.
    """
    check_number([city.environment for city in maps], people_km2)
    matched = [city for city in maps if city.environment.name in people_km2]
    drawn_km2 = np.array([people_km2[city.environment.name] for city in matched])
    found = {"human_maps": float(len(matched)), "human_error_km2": float(drawn_km2.mean())}

    for name, method in (("paper", POSITIONS), ("ours", HEADING)):
        model_km2 = np.array([city.error_km2(method) for city in matched])
        found[f"human_r_{name}"] = correlation(model_km2, drawn_km2)
        found[f"human_r2_{name}"] = determination(model_km2, drawn_km2)

    return found


def correlation(model_km2: Floats, people_km2: Floats) -> float:
    """Return Pearson's r over maps, 0 if the errors of one of both do not vary."""
    if np.ptp(model_km2) == 0 or np.ptp(people_km2) == 0:
        return 0.0

    return float(np.corrcoef(model_km2, people_km2)[0, 1])


def determination(model_km2: Floats, people_km2: Floats) -> float:
    """Return R^2: the share of the variance of people's errors that the model's own errors, neither
    scaled nor shifted, account for; below 0 if people's mean would do better. It is 0 if people's
    do not vary.
    """
    residual = np.square(people_km2 - model_km2).sum()
    total = np.square(people_km2 - people_km2.mean()).sum()
    return float(1 - residual / total) if total > 0 else 0.0


def _mean_error_km2(path: Path, environment: Environment, persons: Persons) -> float:
    """Return the mean error over the persons who drew a map."""
    errors_km2 = []

    for person, places in persons.items():
        missing = [name for name in environment.names if name not in places]
        if missing:
            raise UsageError(
                f"{path} lacks {', '.join(missing)} of {environment.name} by {person}: give all "
                "eight buildings of a map, or leave that person's map out"
            )

        learned = np.array([places[name] for name in environment.names])
        errors_km2.append(aligned_error_km2(learned, environment.buildings_m))

    return float(np.mean(errors_km2))


def _rows(path: Path) -> Iterator[tuple[Line, Row]]:
    """Yield the rows of a file with their lines. Raises UsageError naming a line that is wrong."""
    lines = (line for line in numbered_lines(path, GIVE) if _counts(line.text))
    first = next(lines, Line(path, 1, ""))
    if tuple(_cells(first)) != COLUMNS:
        raise first.wrong(f"the names {','.join(COLUMNS)}")

    for line in lines:
        yield line, _row(line)


def _row(line: Line) -> Row:
    """Read a line. Raises UsageError."""
    try:
        map_name, person, building, *numbers = _cells(line)
        x, y = map(float, numbers)
        is_place = math.isfinite(x) and math.isfinite(y)
    except ValueError:
        is_place = False

    if not is_place:
        raise line.wrong("a map, a person, a building and two numbers")
    return Row(map_name, person, building, x, y)


def _counts(text: str) -> bool:
    return bool(text.strip()) and not text.startswith("#")


def _cells(line: Line) -> list[str]:
    (cells,) = csv.reader([line.text])
    return [cell.strip() for cell in cells]


def template(environments: Sequence[Environment]) -> str:
    """Return such a file with the true places, in metres, to see which buildings to ask for."""
    lines = [",".join(COLUMNS)]

    for environment in environments:
        places_m = environment.buildings_m.tolist()
        for building, (x_m, y_m) in zip(environment.names, places_m, strict=True):
            cells = (environment.name, "truth", building, f"{x_m:.1f}", f"{y_m:.1f}")
            lines.append(_line(cells))

    return "\n".join(lines) + "\n"


def _line(cells: Sequence[str]) -> str:
    file = StringIO()
    csv.writer(file, lineterminator="").writerow(cells)
    return file.getvalue()
