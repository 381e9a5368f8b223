"""What others have published of several goals in order."""

from __future__ import annotations

# Figure 5 of Madl et al. (2013): percent above the shortest route, by number of goals. Read off the
# figure by eye, to within 0.2.
READ_OFF_BY_EYE = "read off a published figure by eye, ±0.2"
HUMAN_PERCENT = {4: 0.9, 5: 2.9, 6: 4.7, 7: 8.5, 8: 9.3, 9: 9.0}
MODEL_PERCENT = {4: 0.7, 5: 2.9, 6: 5.0, 7: 8.6, 8: 8.9, 9: 8.9}
# Of problems that people saw drawn, as a share of the shortest tour, by number of goals.
DRAWN_HUMAN = {
    10: 0.011,
    20: 0.025,
    30: 0.060,
    40: 0.076,
    50: 0.096,
    60: 0.086,
    70: 0.111,
    80: 0.106,
    90: 0.115,
    100: 0.109,
    110: 0.115,
    120: 0.118,
}
