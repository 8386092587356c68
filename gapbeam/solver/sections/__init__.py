"""Cross-sections of a beam: what beam theory takes from them, and the patches that their meshes are made of."""
