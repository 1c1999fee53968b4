"""Least and most values in configs and in files, in SI units: squares and energies are doubles."""

LEAST_AMOUNT, MOST_AMOUNT = 1e-50, 1e50  # of a length, m, or a mass, kg
MOST_SPEED = 1e150  # m/s, at the start
LEAST_TIME = 1e-250  # s; no ball meets another one so soon, unless they touch
