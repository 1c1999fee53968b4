"""Traces -> observables, fits, decay constants and comparisons with theory."""
