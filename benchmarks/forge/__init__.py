"""The campaign of lies: messages that make sense but for one thing, put by a stranger."""
