"""Experiment runner for inelastic hard disks in a container."""

__version__ = "0.1.0"
