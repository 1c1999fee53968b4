"""The Python interface: ``import snooker_cli as snooker``, then ``run``, ``open`` or ``simulate``.

Units are SI with k_B = 1. Everything that a user can get wrong raises a ``SnookerError``. What a
user should know beside files that are written is logged as a warning.
"""
