"""The cognitive cycle on drives of the demo's town: its latency, and the agent's error."""
