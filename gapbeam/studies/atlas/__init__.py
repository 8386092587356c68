"""All responses of a scene: starts in lock-step, orbits by shooting, shares of starts."""
