"""The mechanics: case files, elasticity, contact, time integration, analyses, outputs."""
