"""Search for the values of a case at which a figure of its response is least."""
