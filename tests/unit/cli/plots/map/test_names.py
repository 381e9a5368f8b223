"""The names of streets and buildings on a map."""

from __future__ import annotations

from itertools import combinations
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.text import Text

from cogmap.cli.plots.map.names import draw_names, labels_of
from cogmap.cli.plots.map.sheet import arrange, extent_m, new_map
from cogmap.schemas.sensing import TrueTown
from cogmap.services.sim.layout.town import generate

TOWN = generate(1).message()
MARGIN_M = 5.0


def _named(axes: Axes, town: TrueTown, margin_m: float = MARGIN_M) -> list[Text]:
    arrange(axes, extent_m(town), margin_m, {"town": []})
    draw_names(axes, town)
    return [text for text in axes.texts if text.get_text()]


def test_streets_and_buildings_are_named_and_no_name_hides_another(tmp_path: Path) -> None:
    with new_map(tmp_path / "town.png") as axes:
        texts = _named(axes, TOWN)
        boxes = [text.get_window_extent() for text in texts]

    written = {text.get_text().replace("\n", " ") for text in texts}
    assert written >= {street.name for street in TOWN.streets}
    assert written >= {building.name.replace("_", " ") for building in TOWN.buildings}
    assert not any(a.overlaps(b) for a, b in combinations(boxes, 2))


def test_what_is_too_small_on_a_map_has_no_name(tmp_path: Path) -> None:
    with new_map(tmp_path / "town.png") as axes:
        assert not _named(axes, TOWN, margin_m=2000.0)


def test_a_start_and_a_goal_at_one_place_share_a_label(tmp_path: Path) -> None:
    with new_map(tmp_path / "town.png") as axes:
        _named(axes, TOWN)
        marked = [("start", (0.0, 0.0)), ("goal school", (9.0, 3.0)), ("goal home", (0.1, 0.0))]
        labels = labels_of(axes, marked)

    assert [label.text for label in labels] == ["start, goal home", "goal school"]
