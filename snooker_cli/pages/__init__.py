"""What all HTML pages share: how they are made, their arena and charts in JavaScript, their style.

A page is one file without a network: its scripts and its data are inside.
"""
