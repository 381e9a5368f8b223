"""The one table of codelets: ours, a row each, and those that other packages declare.

A package declares its own by an entry point of the group `cogmap.codelets`, whose object is a
Codelet.
"""

from __future__ import annotations

from collections.abc import Iterable
from importlib.metadata import EntryPoint, entry_points

from cogmap.errors import ConfigError
from cogmap.runtime import config
from cogmap.runtime.codelet import ENTRY_POINTS, Codelet, ConfiguredCodelet
from cogmap.services.codelets.attention import (
    danger,
    episode,
    expectation,
    goal,
    need,
    novelty,
    place_lost,
    whereabouts,
)
from cogmap.services.codelets.correction import (
    apply_correction,
    join_map,
    map_correction,
    sparse_path,
)
from cogmap.services.codelets.localization import landmarks, localization, object_place
from cogmap.services.codelets.mapping import (
    boundary,
    charging_place,
    loop_detection,
    path,
    road_place,
)
from cogmap.services.codelets.planning import route_plan
from cogmap.services.codelets.sub_maps import coarse_places, map_structure, sub_map_places

CODELETS: tuple[Codelet, ...] = (
    apply_correction.CODELET,
    join_map.CODELET,
    sparse_path.CODELET,
    localization.CODELET,
    object_place.CODELET,
    charging_place.CODELET,
    landmarks.CODELET,
    road_place.CODELET,
    boundary.CODELET,
    path.CODELET,
    loop_detection.CODELET,
    map_correction.CODELET,
    map_structure.CODELET,
    coarse_places.CODELET,
    sub_map_places.CODELET,
    route_plan.CODELET,
    whereabouts.CODELET,
    novelty.CODELET,
    expectation.CODELET,
    goal.CODELET,
    need.CODELET,
    danger.CODELET,
    place_lost.CODELET,
    episode.CODELET,
)


def all_codelets() -> tuple[Codelet, ...]:
    """Our codelets, then those of other packages, by name.

    Raises ConfigError where an entry point is no codelet, or a name is taken.
    """
    codelets = list(CODELETS)
    names = {codelet.name for codelet in codelets}
    points = sorted(entry_points(group=ENTRY_POINTS), key=lambda point: point.name)

    for point in points:
        codelet = _declared(point)
        if codelet.name in names:
            raise ConfigError(f"entry point {point.name}: there is a codelet {codelet.name!r}")

        names.add(codelet.name)
        codelets.append(codelet)

    return tuple(codelets)


def _declared(point: EntryPoint) -> Codelet:
    """The codelet that an entry point names. Raises ConfigError where it names none."""
    loaded = _loaded(point)
    if not isinstance(loaded, Codelet):
        raise ConfigError(f"entry point {point.name} = {point.value} is no Codelet")

    return loaded


def _loaded(point: EntryPoint) -> object:
    """What an entry point names. Raises ConfigError where it cannot be imported."""
    try:
        return point.load()
    except Exception as error:  # another package's code may raise anything as it is imported
        reason = f"{type(error).__name__}: {error}"
        raise ConfigError(
            f"entry point {point.name} = {point.value} cannot be imported ({reason}): "
            "mend or uninstall its package"
        ) from error


def configured(
    sections: config.Sections, codelets: Iterable[Codelet]
) -> tuple[ConfiguredCodelet, ...]:
    """`codelets` with their settings from `sections`. Raises ConfigError."""
    return tuple(
        ConfiguredCodelet(codelet, config.typed(sections, codelet.section, codelet.config))
        for codelet in codelets
    )
