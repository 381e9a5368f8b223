"""What others may use of the codelets: some of them by their names, sub-maps, coarse maps, routes
and tours as codelets find them, and their settings.
"""

from __future__ import annotations

from cogmap.services.codelets.attention import expectation
from cogmap.services.codelets.config import Config as CodeletsConfig
from cogmap.services.codelets.correction.due import FALSE_CLOSURE
from cogmap.services.codelets.localization import landmarks, localization
from cogmap.services.codelets.localization.sampling import rejection_mask
from cogmap.services.codelets.mapping import boundary
from cogmap.services.codelets.planning import route_plan, tours
from cogmap.services.codelets.planning.config import Config as PlanningConfig
from cogmap.services.codelets.planning.place_cost import place_costs
from cogmap.services.codelets.sub_maps import coarse_places, sub_map_places
from cogmap.services.codelets.sub_maps.config import Config as SubMapsConfig
from cogmap.services.codelets.sub_maps.sub_maps import SubMaps

__all__ = [
    "FALSE_CLOSURE",
    "CodeletsConfig",
    "PlanningConfig",
    "SubMaps",
    "SubMapsConfig",
    "boundary",
    "coarse_places",
    "expectation",
    "landmarks",
    "localization",
    "place_costs",
    "rejection_mask",
    "route_plan",
    "sub_map_places",
    "tours",
]
