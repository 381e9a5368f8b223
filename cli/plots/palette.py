"""The colours of the plots, so that the same thing looks the same in each."""

from __future__ import annotations

PAPER = "#fbfaf7"
INK = "#37352f"
FAINT = "#8a857a"
TRUE = "#1f2430"
ESTIMATE = "#e4572e"
WHEELS = "#8d7cc4"
FUSED = "#3f74b5"
STREET = "#e7e3da"
KERB = "#cfc9bc"
HOUSE = "#d3d0cb"
WALL = "#b3aea5"
CHARGING = "#c218b0"
CLOSED = "#b3261e"
NAME = "#6d6960"
ROAD = "#4f9d8f"
OBJECT = "#c98a12"
CUT = "#b8457a"
GOAL = "#d2a106"
PLAN = "#1f9e9a"
SHORTCUT = "#8fc93a"
ROAD_OPACITY = 0.62
SEVERAL = ("#c98a12", "#3f74b5", "#b8457a", "#6f9a35", "#8d5fc4", "#1f9e9a", "#d2622a", "#5b6475")
