"""Memory that a model needs, free memory, and the refusal of models that do not fit."""
