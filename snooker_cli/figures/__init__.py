"""A run -> figures: their data, then their files."""
