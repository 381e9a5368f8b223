"""How well perception sees: held-out towns, drawn and then seen as the running system sees."""
