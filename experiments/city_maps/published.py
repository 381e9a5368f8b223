"""What others have published of this experiment (Madl et al. 2016, §6.2 and figure 8), in km^2."""

from __future__ import annotations

HUMAN_MEAN_KM2 = 1.07
HUMAN_SD_KM2 = 0.85
MODEL_MEAN_KM2 = 1.08
MODEL_SD_KM2 = 1.39
MAPS = 28
CITIES = 21
SOURCE = "published (Madl et al. 2016)"
