// The student's table: a row for each measurement, and a plot of its columns with theory.
"use strict";

// The columns: heading, unit, what is read of a row. One that is ``varied`` is shown if rows differ in it.
const COLUMNS = [
  { key: "starts", text: "starts" },
  { key: "N", text: "N", axis: true },
  { key: "r", text: "r", unit: "m", axis: true },
  { key: "R", text: "R", unit: "m", axis: true, help: "radius of the circle, or width" },
  { key: "cor", text: "CoR", axis: true },
  { key: "packing", text: "packing", axis: true, help: "area of the balls over that of the container" },
  { key: "temperature", text: "T", unit: "J", measured: true, axis: true },
  { key: "pressure", text: "P", unit: "Pa m", measured: true, axis: true },
  { key: "ratio", text: "PV/NT", measured: true, axis: true },
  { key: "k", text: "k", unit: "1/s", measured: true, axis: true, help: "decay constant of the energy" },
  { key: "alpha", text: "α", unit: "1/s", measured: true, axis: true, help: "constant of Haff’s law" },
  { key: "early", text: "ended early", help: "in a wall trap or a collapse" },
  { key: "wallCor", text: "wall CoR", axis: true, varied: true },
  { key: "wallTemperature", text: "wall T", unit: "J", axis: true, varied: true },
  { key: "wallSpeed", text: "wall speed", unit: "m/s", axis: true, varied: true },
  { key: "seed", text: "seed", varied: true },
];

// The theories of a column: name, colour, and the value for a row, null where there is none.
function theoriesOf(key, fluid) {
  const ideal = (row) => (row.N * row.temperature) / areaOf(row.container);
  const disks = (row) => (row.equal ? fluid.ratio(row.N, row.r, row.container, row.cor) : null);
  return {
    pressure: [
      ["ideal gas", "soft", ideal],
      ["hard disks", "ink", (row) => (disks(row) === null ? null : disks(row) * ideal(row))],
    ],
    ratio: [["ideal gas", "soft", () => 1], ["hard disks", "ink", disks]],
    alpha: [["Haff’s law, Enskog’s rates", "ink", (row) => (row.equal && row.cools ? fluid.haffRate({
      ...row, number: row.N, radius: row.r, temperature: row.startTemperature,
    }) : null)]],
  }[key] ?? [];
}

// A row between two: its numbers, of which theories are made, are between theirs.
function between(first, second, part) {
  const mix = (a, b) => a + part * (b - a), row = { ...first };
  for (const key of ["r", "R", "cor", "wallCor", "packing", "temperature", "startTemperature"]) {
    row[key] = mix(first[key], second[key]);
  }
  row.N = Math.round(mix(first.N, second.N));
  const size = first.container.size.map((side, k) => mix(side, second.container.size[k]));
  row.container = { ...first.container, size };
  return row;
}

// The ends of an axis: from zero, but for values that are all near to each other.
function rangeOf(values) {
  const least = Math.min(...values, Infinity), most = Math.max(...values, 0), room = 0.1 * (most - least);
  return least > most / 2 && room > 0 ? [least - room, most + room] : [0, roomy(most)];
}

const valueWithError = (value, error) => {
  if (!Number.isFinite(value)) return "–";
  if (!(error > 1e-9 * Math.abs(value))) return short(value, 4); // only rounding
  const rounded = Number(error.toPrecision(2));
  const digits = Math.min(Math.max(1, 2 + magnitude(value) - magnitude(rounded)), 7);
  return `${short(value, digits)} ± ${short(error, 2)}`;
};

class Table {
  constructor(fluid) {
    this.fluid = fluid;
    this.rows = [];
    this.plot = new Panels(find("plot"), [{ name: "", foot: true }]);
    for (const [menu, chosen] of [["plot-x", "packing"], ["plot-y", "ratio"]]) {
      for (const { key, text, unit } of COLUMNS.filter(({ axis }) => axis)) {
        find(menu).append(new Option(unit ? `${text} (${unit})` : text, key));
      }
      find(menu).value = chosen;
      find(menu).onchange = () => this.draw();
    }
    find("clear-table").onclick = () => {
      this.rows = [];
      find("measured").textContent = "";
      this.show();
    };
    find("copy-table").onclick = () => copy(this.text("\t"), "The table is copied.");
    find("save-table").onclick = () => save(new Blob([this.text(",")], { type: "text/csv" }), "measurements.csv");
    find("plot-image").onclick = () => saveCanvas(find("plot"), "plot.png");
  }

  add(row) {
    this.rows.push(row);
    this.show();
  }

  get columns() {
    const differ = (key) => new Set(this.rows.map((row) => row[key])).size > 1;
    return COLUMNS.filter(({ key, varied }) => !varied || differ(key));
  }

  show() {
    find("results").hidden = !this.rows.length;
    const head = element("tr"), body = this.rows.map(() => element("tr"));
    for (const { key, text, unit, measured, help } of this.columns) {
      const cell = element("th", { textContent: unit ? `${text}, ${unit}` : text, title: help ?? "", scope: "col" });
      head.append(cell);
      this.rows.forEach((row, k) => {
        const value = row[key], error = row[`${key}Error`];
        const textContent = measured || value === null ? valueWithError(value ?? NaN, error)
          : String(Number(value.toPrecision(4)));
        body[k].append(element("td", { textContent }));
      });
    }
    find("table").replaceChildren(element("thead"), element("tbody"));
    find("table").tHead.append(head);
    find("table").tBodies[0].append(...body);
    this.draw();
  }

  // The table as text: a line for each row; errors have columns of their own, numbers all digits.
  text(comma) {
    const columns = this.columns.flatMap(({ key, text, unit, measured }) => {
      const heading = unit ? `${text} (${unit})` : text;
      return measured ? [[heading, key], [`error of ${text}`, `${key}Error`]] : [[heading, key]];
    });
    const number = (value) => (Number.isFinite(value) ? String(value) : "");
    const rows = this.rows.map((row) => columns.map(([, key]) => number(row[key])));
    const lines = [columns.map(([heading]) => heading), ...rows];
    return lines.map((cells) => `${cells.join(comma)}\n`).join("");
  }

  draw() {
    if (!this.rows.length) return;
    const [pen, width, height] = sharp(find("plot")), [panel] = this.plot.panels;
    const size = parseFloat(getComputedStyle(find("plot")).fontSize);
    const [x, y] = ["plot-x", "plot-y"].map((menu) => COLUMNS.find(({ key }) => key === find(menu).value));
    const points = this.rows.filter((row) => [x, y].every(({ key }) => Number.isFinite(row[key])));
    points.sort((first, second) => first[x.key] - second[x.key]);
    const theories = theoriesOf(y.key, this.fluid);
    const curves = theories.map(([name, colour, law]) => ({ name, colour, points: this.curve(points, x.key, law) }));
    const highest = points.map((row) => row[y.key] + (row[`${y.key}Error`] || 0));
    panel.name = y.unit ? `${y.text} (${y.unit})` : y.text;
    panel.top = roomy(Math.max(...highest, ...curves.flatMap((curve) => curve.points.map(([, value]) => value)), 0));
    const [low, high] = rangeOf(points.map((row) => row[x.key]));
    this.plot.layOut(pen, width, height, size);
    const across = (value) => this.plot.left + ((value - low) / (high - low)) * this.plot.wide;
    this.plot.grid(pen);
    this.plot.footer(pen, panel, across, low, high, 0, x.unit ? `${x.text} (${x.unit})` : x.text);
    this.plot.heading(pen, panel, []);
    const up = (value) => this.plot.up(panel, value);
    pen.setLineDash([5, 4]);
    pen.lineWidth = 1.4;
    curves.forEach((curve, line) => {
      pen.strokeStyle = pen.fillStyle = paint(curve.colour);
      pen.beginPath();
      for (const [at, value] of curve.points) pen.lineTo(across(at), up(value));
      pen.stroke();
      if (curve.points.length) this.plot.note(pen, panel, `- - ${curve.name}`, line, true);
    });
    pen.setLineDash([]);
    pen.strokeStyle = pen.fillStyle = paint("second");
    for (const row of points) {
      const at = across(row[x.key]), error = row[`${y.key}Error`] || 0;
      pen.beginPath();
      pen.arc(at, up(row[y.key]), 3.5, 0, 2 * Math.PI);
      pen.fill();
      pen.beginPath();
      pen.moveTo(at, up(row[y.key] - error));
      pen.lineTo(at, up(row[y.key] + error));
      const wide = x.measured ? row[`${x.key}Error`] || 0 : 0;
      pen.moveTo(across(row[x.key] - wide), up(row[y.key]));
      pen.lineTo(across(row[x.key] + wide), up(row[y.key]));
      pen.stroke();
    }
    const values = points.map((row) => `${short(row[y.key])} at ${short(row[x.key])}`).join(", ");
    find("plot").setAttribute("aria-label", `${panel.name} against ${x.text}: ${values}`);
  }

  // A theory at the rows, which are in order of x, and between those with containers of one shape.
  curve(rows, key, law) {
    const points = [], steps = 16;
    rows.forEach((row, k) => {
      const next = rows[k + 1], smooth = next && next.container.shape === row.container.shape;
      for (let part = 0; part < (smooth ? steps : 1); part++) {
        const at = part ? between(row, next, part / steps) : row, value = law(at);
        if (value !== null && Number.isFinite(value)) points.push([at[key], value]);
      }
    });
    return points;
  }
}
