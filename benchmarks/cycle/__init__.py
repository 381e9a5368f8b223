"""The cognitive cycle on drives of the demo's town: how long it takes, and how well the agent localizes."""
