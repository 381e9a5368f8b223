"""Place nodes in bulk: the time of a change, their memory, and how true their links are."""
