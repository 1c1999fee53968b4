"""The times from one collision of a ball with others to the next: a figure and its result."""

import numpy as np

from snooker_cli.extending import (
    FigureBuilder,
    FigureData,
    FigureError,
    FigureSpec,
    Line,
    Quantity,
    Result,
    Trace,
    mean_and_error,
)

EDGES = np.linspace(0.0, 5.0, 21)  # of bins of t/τ


def free_times(trace: Trace) -> np.ndarray:
    """The times between the collisions of each ball with others in a repeat, s."""
    events = trace.events
    between = events.j >= 0  # a wall is no ball
    times = np.repeat(events.time[between], 2)
    balls = np.column_stack([events.i, events.j])[between].ravel()
    order = np.argsort(balls, kind="stable")  # the times of a ball stay in order
    return np.diff(times[order])[np.diff(balls[order]) == 0]


def draw(build: FigureBuilder) -> FigureData:
    """The distribution at each point, and that of collisions by chance."""
    for index, point in enumerate(build.points):
        repeats = [times for times in map(free_times, build.traces(point)) if len(times)]
        if not repeats:
            raise FigureError("no ball has collided twice with others")
        means = np.array([times.mean() for times in repeats])
        rows = [
            np.histogram(times / mean, EDGES)[0] / (len(times) * np.diff(EDGES))
            for times, mean in zip(repeats, means, strict=True)
        ]
        middles = (EDGES[1:] + EDGES[:-1]) / 2
        build.add_points(index, build.label(point), middles, np.array(rows))
        build.record(point, free_time=mean_and_error(means))
    build.lines.append(Line(EDGES, np.exp(-EDGES), "collisions by chance", -1, "dashed"))
    return build.figure()


FREE_TIME = Quantity(
    name="mean free time",
    symbol="τ",
    unit="s",
    words="mean free time",
    key="mean_free_time",
    source="snapshots",
)

FIGURE = FigureSpec(
    name="free-times",
    title="Times between collisions of a ball",
    needs="A run with `record: events` that has collisions between balls.",
    shows="Times t from one collision of a ball with others to its next one.",
    draw=draw,
    requires=("several", "events"),
    axes={
        "x_label": "time over the mean free time, t/τ",
        "y_label": "probability density × τ",
        "x_limits": (0, None),
        "y_log": True,
    },
    result=Result(quantity="mean free time", number="free_time"),
)
