"""Geometry of the plane: array types, poses (SE(2)) and polylines."""
