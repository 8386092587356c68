"""The engine that computes the points of all studies, in this process or in workers here and elsewhere."""
