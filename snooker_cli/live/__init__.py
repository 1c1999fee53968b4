"""The live page: an HTML page that simulates a gas in the browser, with the bits of the engine.

engine.js is the twin of ``engine/all_pairs.py``, start.js that of ``placement``.
"""
