"""The colours of the plots: one meaning each, in every plot.

What is true is black and grey; what the agent has made of it is coloured. The colours differ in
lightness too, so that they stay apart in print and for those who see few hues: several are of
Okabe and Ito's (2008) and of Tol's (2021) schemes.
"""

from __future__ import annotations

PAPER = "#fbfaf7"
INK = "#37352f"
FAINT = "#6d6960"

TRUE = "#1f2430"
STREET = "#e7e3da"
KERB = "#cfc9bc"
HOUSE = "#d3d0cb"
WALL = "#a39d92"
CHARGING = "#c218b0"
CLOSED = "#a11212"
DISTRICTS = ("#ece4d3", "#c9d6e2", "#dfbcc6", "#b9c5a4", "#aea6bd")
"""Buildings by the district that they are in, again from the first if there are more."""

ESTIMATE = "#d55e00"
FUSED = "#0072b2"
WHEELS = "#56b4e9"
ROAD = "#009e73"
ROAD_OPACITY = 0.5
OBJECT = "#c98a12"
CUT = "#b8457a"
SUB_MAP = "#5b6475"
GOAL = "#f0e442"
PLAN = "#6a3db8"
SHORTCUT = "#a5d64c"

SEVERAL = ("#332288", "#cc6677", "#117733", "#999933", "#aa4499", "#44aa99", "#882255", "#5b6475")
"""Things that are told apart by the legend or the names of one plot alone."""

USES = ("#77aadd", "#ee8866", "#eedd88", "#ffaabb", "#99ddff", "#44bb99", "#bbcc33", "#cccccc")
"""What buildings and places are used for, in the order of a figure's own list."""

UNCORRECTED = SEVERAL[4]
POSITIONS = SEVERAL[0]
"""Maps as they were learned, and with positions corrected; with headings too, it is ESTIMATE."""
