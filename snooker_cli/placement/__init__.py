"""A point and a repeat number -> the scene that a repeat starts from."""
