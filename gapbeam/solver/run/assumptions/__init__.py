"""How close a run comes to the limits of the assumptions behind its equations."""
