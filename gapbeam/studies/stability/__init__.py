"""The grid of stiffness, step and scheme over which a case can be trusted."""
