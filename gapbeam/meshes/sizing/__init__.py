"""Cell sizes, layers and expected size of a mesh."""
