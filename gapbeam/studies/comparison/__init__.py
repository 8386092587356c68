"""Two runs side by side, from their folders to a folder of the comparison."""
