"""Our rules for localization, maps and routes, each taken away in turn, beside the paper's."""
