"""Whether the objects of a map are the buildings that there are, judged by the truth."""
