"""The settings of our codelets by section, for those that configure and need not run them: to
import the codelets takes longer.
"""

from __future__ import annotations

import msgspec

from cogmap.services.codelets import config as common
from cogmap.services.codelets.attention import config as attention
from cogmap.services.codelets.planning import config as planning
from cogmap.services.codelets.sub_maps import config as structure
from cogmap.services.codelets.sub_maps import resolution_config as resolution

SECTIONS: dict[str, type[msgspec.Struct]] = {
    common.SECTION: common.Config,
    attention.SECTION: attention.Config,
    resolution.COARSE_PLACES: resolution.CoarsePlacesConfig,
    structure.SECTION: structure.Config,
    planning.SECTION: planning.Config,
    resolution.SUB_MAP_PLACES: resolution.SubMapPlacesConfig,
}
