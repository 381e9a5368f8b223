"""Estimation of a path from measurements that err: pose graphs, and which of their loops hold."""
