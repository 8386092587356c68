"""The functions of a Python session: `import gapbeam` finds them here when they are first asked for."""
