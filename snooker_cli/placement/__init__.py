"""A point and a repeat number -> the scene at its start."""
