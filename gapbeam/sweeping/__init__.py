"""A sweep: its points, what is on disk of them, and how they are run side by side."""
