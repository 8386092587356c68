"""An identification: unknowns of a case found from measured values, and how well they are known."""
