"""The colours of the pictures, so that the same thing looks the same in each."""

from __future__ import annotations

PAPER, INK, FAINT = "#fbfaf7", "#37352f", "#8a857a"
TRUE, ESTIMATE, WHEELS = "#1f2430", "#e4572e", "#8d7cc4"
STREET, KERB, HOUSE, WALL, NAME = "#e7e3da", "#cfc9bc", "#d3d0cb", "#b3aea5", "#6d6960"
ROAD, OBJECT = "#4f9d8f", "#c98a12"
ROAD_OPACITY = 0.62
SEVERAL = ("#c98a12", "#3f74b5", "#b8457a", "#6f9a35", "#8d5fc4", "#1f9e9a", "#d2622a", "#5b6475")
