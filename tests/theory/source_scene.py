"""The scene of the source report, and what an independent simulation of it measured."""

from snooker_cli.containers import Circle

# 37 balls of 1 kg with 10 m/s in a circle of 10 m.
N, T, R = 37, 50.0, 10.0
CIRCLE = Circle(R)
DENSITY = N / CIRCLE.area

# At e = 1 by ball radius: pressure on the wall, ball-ball and wall collisions per second, each with
# its error.
SIMULATED = {
    1.0: ((17.18, 0.03), (240.8, 0.4), (61.11, 0.03)),
    0.1: ((5.9917, 0.0002), (10.81, 0.005), (21.30, 0.005)),
}


def packing(radius: float) -> float:
    """Packing fraction of the balls if they have this radius."""
    return N * radius**2 / R**2


def digits(value: float, text: str) -> bool:
    """Whether a value rounds to a printed number, to all of its digits."""
    return f"{value:.{len(text.partition('.')[2])}f}" == text
