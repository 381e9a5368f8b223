"""Places on the earth by longitude and latitude, as positions in a plane."""

from __future__ import annotations

import numpy as np

from cogmap.geometry.arrays import Floats

# The mean radius of the earth (IUGG 1980).
EARTH_M = 6_371_008.8


def plane_m(lonlat: Floats, middle: Floats) -> Floats:
    """Return (n, 2) metres east and north of `middle` (2,), of (n, 2) longitudes and latitudes in
    degrees: good to a thousandth within some kilometres.
    """
    degree_m = np.radians(1.0) * EARTH_M
    shrinking = np.cos(np.radians(middle[1]))
    offsets = lonlat.reshape(-1, 2) - middle
    return np.asarray(offsets * np.array([shrinking * degree_m, degree_m]))


def continuous(lonlat: Floats) -> Floats:
    """Return the same (n, 2) places with longitudes up to 360 degrees if they lie on both sides of
    the 180th meridian.
    """
    lon, lat = lonlat.reshape(-1, 2).T
    if not len(lon) or np.ptp(lon) <= 180.0:
        return lonlat
    return np.column_stack([np.where(lon < 0.0, lon + 360.0, lon), lat])
