"""Cost of a run, predicted from trials."""
