"""A direct solver by substructuring: one factor per rank and one for the interface unknowns."""
