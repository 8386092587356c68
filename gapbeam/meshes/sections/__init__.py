"""Cross-sections as patches that structured meshes are made of."""
