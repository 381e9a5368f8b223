"""Loop closing on pose graphs that others recorded, against exact least squares and gtsam."""
