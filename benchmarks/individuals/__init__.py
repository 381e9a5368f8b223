"""Whether an agent knows each building as one individual, judged by the truth."""
