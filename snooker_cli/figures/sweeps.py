"""The main result of a run against a swept key, beside theory."""

import numpy as np

from snooker_cli.analysis.comparison import comparisons_of
from snooker_cli.analysis.decay import decays_of
from snooker_cli.analysis.trend import Trend, trend_of
from snooker_cli.config import unit_of
from snooker_cli.errors import FigureError
from snooker_cli.figures.captions import FigureBuilder
from snooker_cli.figures.declared_result import Result
from snooker_cli.figures.figure_data import (
    FigureData,
    Line,
    Points,
    legend_line,
    more_than_a_decade,
)
from snooker_cli.figures.selection import (
    axis_label,
    changing_with,
    described,
    swept_number,
    value_at,
)
from snooker_cli.formatting import counted

MOST_NAMED = 3  # points that a caption names


def against_key(build: FigureBuilder) -> FigureData:
    """The main result of each point against the swept key, with theory at the same points."""
    key, names = swept_number(build.points), [group[0] for group in build.groups]
    key_unit = unit_of(build.points[0].experiment, key)
    drawn: list[Trend] = []
    for index, group in enumerate(build.groups):
        rows = []
        for point in group:
            measurement = build.measurement(point)
            compared, _ = comparisons_of(measurement, decays_of(measurement))
            rows += [{"parameters": point.as_json(), **row.as_json()} for row in compared]
        words = {float(value_at(point, key)): described(point, key) for point in group}
        for trend in filter(None, [trend_of(rows, key, key_unit, words)]):
            drawn.append(trend)
            x, y, error = trend.x, trend.column("measured"), trend.column("error")
            label = build.label(group[0], names) or "simulation"
            build.lines.append(Points(x, y, error, label, index))
            if trend.theory:
                expected = trend.column("predicted")
                build.lines.append(Line(x, expected, None, index, "dashed"))
                build.add_residuals(index, x, y, trend.column("difference_error"), expected)
            for row in trend.rows:
                (point,) = (p for p in group if p.as_json() == row["parameters"])
                build.record(
                    point,
                    value=(row["measured"], row["error"]),
                    theory=row["predicted"],
                    difference=(row["difference"], row["difference_error"]),
                )
    if not drawn:
        raise FigureError(
            f"no two points along {key} have the same main result and theory; sweep more values of "
            "it, or run longer"
        )
    first = drawn[0]
    build.lines += [legend_line(name, "dashed") for name in {t.theory for t in drawn} if name]
    symbol = first.quantity.symbol
    build.result = Result(first.rows[0]["quantity"], "value", theory="theory")
    unit = f" ({build.result.unit})" if build.result.unit else ""
    build.beside_theory = len(drawn) == 1
    seen = f"{first.sentence()}." if build.beside_theory else ""
    build.shows = (
        f"{build.result.name} of each point{', and ' + first.theory if first.theory else ''}."
    )
    x_label = axis_label(build.points[0], key)
    values = np.concatenate([trend.column("measured") for trend in drawn])
    linked = [axis_label(build.points[0], name) for name in changing_with(build.points, key)]
    others = ", ".join(label.partition(" (")[0] for label in linked)
    also = f"Along with it changes: {others}." if linked else ""
    return build.figure(
        " ".join(filter(None, [seen, also, _left_out(build)])),
        title=f"{symbol} against {x_label.partition(' (')[0]}",
        x_label=x_label,
        y_label=f"{symbol}{unit}",
        logarithmic=more_than_a_decade([values]) and bool(values.min() > 0),
    )


def _left_out(build: FigureBuilder) -> str:
    """A sentence on the points that have another main result than the others, or none."""
    shown = [record["parameters"] for record in build.records]
    missing = [build.label(p) or "" for p in build.points if p.as_json() not in shown]
    if not missing:
        return ""
    number = f"{len(missing)} of {counted(len(build.points), 'point')}"
    named = missing if len(missing) <= MOST_NAMED else [*missing[:MOST_NAMED], "others"]
    reason = "without this result or this theory"
    return f"Left out: {number} {reason} ({'; '.join(named)})."
