"""Error estimates of the figures of a run from cheap comparison runs."""
