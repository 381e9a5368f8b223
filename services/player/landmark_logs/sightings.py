"""Landmarks that were seen, as percepts: points, of which nothing is hidden."""

from __future__ import annotations

from cogmap.schemas.sensing import Percept


def sighting(
    label: str,
    bearing_rad: float,
    range_m: float,
    *,
    bearing_sd_rad: float,
    range_sd_m: float,
    width_m: float = 0.0,
) -> Percept:
    """Make the percept of a landmark. Its label says which one it is, as a barcode does; without
    one, that is to be found out.
    """
    return Percept(
        name=label,
        label=label,
        activation=1.0,
        evidence=1.0 if label else 0.0,
        bearing_rad=bearing_rad,
        range_m=range_m,
        bearing_sd_rad=bearing_sd_rad,
        range_sd_m=range_sd_m,
        width_m=width_m,
        height_m=0.0,
        whole=True,
        box_px=(0, 0, 0, 0),
    )
