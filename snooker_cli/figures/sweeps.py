"""The main result of a run against a swept key, beside theory."""

import numpy as np

from snooker_cli.analysis.comparison import comparisons_of
from snooker_cli.analysis.decay import decays_of
from snooker_cli.analysis.trend import Trend, trend_of
from snooker_cli.config import unit_of
from snooker_cli.errors import FigureError
from snooker_cli.figures.captions import FigureBuilder
from snooker_cli.figures.figure_data import (
    FigureData,
    Line,
    Points,
    legend_line,
    more_than_a_decade,
)
from snooker_cli.figures.selection import swept_number


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
        for trend in filter(None, [trend_of(rows, key, key_unit)]):
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
        raise FigureError(f"fewer than two points have a result along {key}; run longer")
    first = drawn[0]
    build.lines += [legend_line(name, "dashed") for name in {t.theory for t in drawn} if name]
    unit, symbol = first.quantity.unit_text, first.quantity.symbol
    build.beside_theory = len(drawn) == 1
    seen = f"{first.sentence()}." if build.beside_theory else ""
    values = np.concatenate([trend.column("measured") for trend in drawn])
    return build.figure(
        seen,
        numbers={"units": dict.fromkeys(("value", "theory", "difference"), unit)},
        title=f"{symbol} against {key}",
        x_label=f"{key} ({key_unit})" if key_unit else key,
        y_label=f"{symbol} ({unit.replace('1/s', 's⁻¹')})" if unit else symbol,
        logarithmic=more_than_a_decade([values]) and bool(values.min() > 0),
    )
