"""Scenes with uncertain values: distributions of figures for each response, probabilities, causes of scatter."""
