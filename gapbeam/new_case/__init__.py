"""New case files: copies of shipped cases, and cases made of a few answers."""
