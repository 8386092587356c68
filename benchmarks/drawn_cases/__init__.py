"""Cases drawn by hypothesis: their error estimates against a second computation."""
