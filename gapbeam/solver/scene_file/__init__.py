"""Case files of several structures: tables, checks, and the scene that they make."""
