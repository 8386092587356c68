"""The trade-off between speed and accuracy: fidelity levels, measured."""
