"""Statistics of a stationary random motion, with intervals."""
