"""Reading results folders."""
