"""The scale of colours from slow to fast that the player and the pictures share."""

SPEED_COLOURS = (
    "#0d0887",
    "#41049d",
    "#6a00a8",
    "#8f0da4",
    "#b12a90",
    "#cc4778",
    "#e16462",
    "#f2844b",
    "#fca636",
    "#fcce25",
)
"""Even steps of perceived lightness, also to the colour-blind: matplotlib's plasma up to 0.9, as
its last, yellow part is too light on white.
"""
