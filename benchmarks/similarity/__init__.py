"""Cases of other sizes: the same motion, warnings and status, whatever the size of a scene."""
