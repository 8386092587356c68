"""The assumptions behind the equations, and how close a run comes to their limits."""
