"""Valid small cases drawn from the whole schema of case files, each compared with another way to compute it."""
