"""Cross-sections of a beam: figures for beam theory, and patches for meshes."""
