"""Measurements of the engine itself."""
