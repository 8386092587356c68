"""Deflation: slow motions, which round-off would disturb the most, are solved for apart."""
