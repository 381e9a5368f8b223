"""`cogmap experiment`: the paper's experiments, and the figures that come of them."""
