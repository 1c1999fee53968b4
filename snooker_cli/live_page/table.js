// The student's table: a row for each measurement, and a plot of its columns with theory.

// The columns: heading, unit, what is read of a row. One that is ``varied`` is shown if rows differ in
// it, and one that is ``rare`` if a row has a number in it that is not zero.
const COLUMNS = [
  { key: "title", text: phrase`scene`, varied: true },
  { key: "starts", text: phrase`starts` },
  { key: "N", text: "N", axis: true },
  { key: "r", text: "r", unit: "m", axis: true },
  { key: "R", text: "R", unit: "m", axis: true, rare: true, help: phrase`radius of the container` },
  { key: "width", text: phrase`width`, unit: "m", axis: true, rare: true, help: phrase`width of the container` },
  { key: "cor", text: phrase`CoR`, axis: true },
  { key: "packing", text: phrase`packing`, axis: true, help: phrase`area of the balls over that of the container` },
  { key: "temperature", text: "T", unit: "J", measured: true, axis: true },
  { key: "pressure", text: "P", unit: "Pa m", measured: true, axis: true },
  { key: "ratio", text: "PV/NT", measured: true, axis: true },
  { key: "k", text: "k", unit: "1/s", measured: true, axis: true, rare: true, help: phrase`decay constant of the energy` },
  { key: "alpha", text: "α", unit: "1/s", measured: true, axis: true, rare: true, help: phrase`constant of Haff’s law` },
  { key: "ratioTheory", text: `PV/NT, ${THEORIES.ratio.finite.model}`, rare: true, help: phrase`theory` },
  { key: "alphaTheory", text: `α, ${THEORIES.alpha.finite.model}`, unit: "1/s", rare: true, help: phrase`theory` },
  { key: "early", text: phrase`ended early`, rare: true, help: phrase`in a wall trap or a collapse` },
  { key: "wallCor", text: phrase`wall CoR`, axis: true, varied: true },
  { key: "wallTemperature", text: phrase`wall T`, unit: "J", axis: true, varied: true },
  { key: "wallSpeed", text: phrase`wall speed`, unit: "m/s", axis: true, varied: true },
  ...Object.entries(SURFACE_NAMES).map(([key, text]) => ({ key: `surface_${key}`, text, axis: true, varied: true })),
  ...SIDES.flatMap((side) => [
    { key: `${side}Temperature`, text: `${SIDE_NAMES[side]} ${phrase`wall T`}`, unit: "J", axis: true, varied: true },
    { key: `${side}Speed`, text: `${SIDE_NAMES[side]} ${phrase`wall speed`}`, unit: "m/s", axis: true, varied: true },
  ]),
  { key: "seed", text: phrase`seed`, varied: true },
];

const ALONE = 9; // px: half of the line of a theory that is known at one row only

// The value of a theory for a row, null where it does not hold.
function valueAtRow(theory, row) {
  const { N: number, r: radius, cor, container } = row, packing = packingOf({ container, radii: Array(number).fill(radius) });
  const traits = { ...row.traits, number, cor, ...fullness(packing, radius, container) };
  if (!applies(theory, traits)) return null;
  const balls = equalBalls({ ...row, number, radius, energy: number * row.startEnergy });
  return theory.value(gasOf(balls, row.temperature));
}

// A row between two: all numbers that both have are between theirs.
function between(first, second, part) {
  const mix = (a, b) => a + part * (b - a), row = { ...first };
  const areKnown = (key) => Number.isFinite(first[key]) && Number.isFinite(second[key]);
  for (const key of Object.keys(first).filter(areKnown)) row[key] = mix(first[key], second[key]);
  row.N = Math.round(mix(first.N, second.N));
  const size = first.container.size.map((side, k) => mix(side, second.container.size[k]));
  row.container = { ...first.container, size };
  return row;
}

// The ends of an axis: from zero, but for values that are all near to each other.
function axisEnds(values) {
  const least = Math.min(...values, Infinity), most = Math.max(...values, 0), room = 0.1 * (most - least);
  return least > most / 2 && room > 0 ? [least - room, most + room] : [bottomOf(values), roomy(most)];
}

// The lower end of an axis from zero, or below it.
const bottomOf = (values) => (Math.min(...values) < 0 ? -roomy(-Math.min(...values)) : 0);

const valueWithError = (value, error) => {
  if (!Number.isFinite(value)) return "–";
  if (!(error > 1e-9 * Math.abs(value))) return short(value, 4); // only rounding
  const rounded = Number(error.toPrecision(2));
  const digits = Math.min(Math.max(1, 2 + magnitude(value) - magnitude(rounded)), 7);
  return `${short(value, digits)} ± ${short(error, 2)}`;
};

class Table {
  constructor() {
    this.plot = new Panels(find("plot"), [{ name: "", foot: true }]);
    this.axes = { "plot-x": "packing", "plot-y": "ratio" };
    this.rows = [];
    this.restore();
    for (const menu of Object.keys(this.axes)) {
      find(menu).onchange = () => {
        this.axes[menu] = find(menu).value;
        this.keep();
        this.draw();
      };
    }
    find("clear-table").onclick = () => {
      this.rows = [];
      find("measured").textContent = "";
      this.show();
    };
    find("copy-table").onclick = () => copy(this.text("\t"), phrase`The table is copied.`);
    find("save-table").onclick = () => save(new Blob([this.text(",")], { type: "text/csv" }), "measurements.csv", COPY);
    find("plot-image").onclick = () => saveCanvas(find("plot"), "plot.png");
  }

  // The browser keeps the table of a page until its tab is closed, if it may. JSON has no NaN and no Infinity.
  keep() {
    const packed = (_, value) => (typeof value !== "number" || Number.isFinite(value) ? value : { as: String(value) });
    try {
      sessionStorage.setItem(location.pathname, JSON.stringify([this.rows, this.axes], packed));
    } catch {}
  }

  restore() {
    const unpacked = (_, value) => (value?.as ? Number(value.as) : value);
    try {
      [this.rows, this.axes] = JSON.parse(sessionStorage.getItem(location.pathname), unpacked) ?? [[], this.axes];
    } catch {}
    if (this.rows.length) this.show();
  }

  add(row) {
    row.ratioTheory = valueAtRow(THEORIES.ratio.finite, row);
    row.alphaTheory = valueAtRow(THEORIES.alpha.finite, row);
    this.rows.push(row);
    this.show();
  }

  // The menus offer the columns that the table has.
  showAxes() {
    for (const [menu, chosen] of Object.entries(this.axes)) {
      const axes = this.columns.filter(({ axis }) => axis);
      find(menu).replaceChildren(...axes.map(({ key, text, unit }) =>
        new Option(unit ? `${text} (${unit})` : text, key)));
      const isThere = axes.some(({ key }) => key === chosen);
      find(menu).value = isThere ? chosen : axes[0].key;
    }
  }

  get columns() {
    const differ = (key) => new Set(this.rows.map((row) => row[key])).size > 1;
    const known = (key) => this.rows.some((row) => row[key]); // neither zero nor nan
    return COLUMNS.filter(({ key, varied, rare }) => (!varied || differ(key)) && (!rare || known(key)));
  }

  show() {
    this.keep();
    find("results").hidden = !this.rows.length;
    const head = element("tr"), body = this.rows.map(() => element("tr"));
    for (const { key, text, unit, measured, help } of this.columns) {
      const className = key === "title" ? "text" : "", textContent = unit ? `${text}, ${unit}` : text;
      const cell = element("th", { textContent, className, title: help ?? "", scope: "col" });
      head.append(cell);
      this.rows.forEach((row, k) => {
        const value = row[key], error = row[`${key}Error`];
        let content = String(value);
        if (measured || value === null || Number.isNaN(value)) content = valueWithError(value ?? NaN, error);
        else if (typeof value === "number") content = String(Number(value.toPrecision(4)));
        body[k].append(element("td", { textContent: content, className }));
      });
    }
    find("table").replaceChildren(element("thead"), element("tbody"));
    find("table").tHead.append(head);
    find("table").tBodies[0].append(...body);
    this.showAxes();
    this.draw();
  }

  // The table as text: a line for each row; errors have columns of their own, numbers all digits. comma: between cells
  text(comma) {
    const columns = this.columns.flatMap(({ key, text, unit, measured }) => {
      const heading = unit ? `${text} (${unit})` : text;
      return measured ? [[heading, key], [phrase`error of ${text}`, `${key}Error`]] : [[heading, key]];
    });
    const known = (value) => (Number.isFinite(value) || typeof value === "string" ? String(value) : "");
    const rows = this.rows.map((row) => columns.map(([, key]) => known(row[key])));
    const needsQuotes = (text) => [comma, '"', "\n", "\r"].some((sign) => text.includes(sign));
    const quoted = (text) => (needsQuotes(text) ? `"${text.replaceAll('"', '""')}"` : text);
    return [columns.map(([heading]) => heading), ...rows].map((cells) => `${cells.map(quoted).join(comma)}\n`).join("");
  }

  draw() {
    if (!this.rows.length) return;
    const [pen, width, height] = sharp(find("plot")), [panel] = this.plot.panels;
    const size = parseFloat(getComputedStyle(find("plot")).fontSize);
    const [x, y] = ["plot-x", "plot-y"].map((menu) => COLUMNS.find(({ key }) => key === find(menu).value));
    const points = this.rows.filter((row) => [x, y].every(({ key }) => Number.isFinite(row[key])));
    points.sort((first, second) => first[x.key] - second[x.key]);
    const curves = Object.entries(THEORIES[y.key] ?? {}).map(([key, theory]) => {
      const [colour, dash] = STYLES[key], law = (row) => valueAtRow(theory, row);
      return { name: theory.model, colour, dash, pieces: this.pieces(points, x.key, law) };
    });
    const errorOf = (row, { key, measured }) => (measured ? row[`${key}Error`] || 0 : 0);
    const ends = (row, axis) => [-1, 1].map((sign) => row[axis.key] + sign * errorOf(row, axis));
    const highest = points.map((row) => ends(row, y)[1]);
    const predicted = curves.flatMap(({ pieces }) => pieces.flat().map(([, value]) => value));
    panel.name = y.unit ? `${y.text} (${y.unit})` : y.text;
    panel.low = bottomOf(points.map((row) => row[y.key]));
    panel.top = roomy(Math.max(...highest, ...predicted, 0));
    const [low, high] = axisEnds(points.flatMap((row) => ends(row, x)));
    this.plot.layOut(pen, width, height, size);
    const across = (value) => this.plot.left + ((value - low) / (high - low)) * this.plot.wide;
    this.plot.grid(pen);
    this.plot.footer(pen, panel, across, low, high, 0, x.unit ? `${x.text} (${x.unit})` : x.text);
    this.plot.heading(pen, panel, []);
    const up = (value) => this.plot.up(panel, value);
    pen.lineWidth = 1.4;
    const shown = curves.filter(({ pieces }) => pieces.length);
    for (const { colour, dash, pieces } of shown) {
      pen.strokeStyle = paint(colour);
      for (const piece of pieces) {
        pen.setLineDash(dash.line);
        pen.beginPath();
        for (const [at, value] of piece) pen.lineTo(across(at), up(value));
        const [[at, value]] = piece; // one alone is a short line
        if (piece.length === 1) {
          pen.moveTo(across(at) - ALONE, up(value));
          pen.lineTo(across(at) + ALONE, up(value));
        }
        pen.stroke();
      }
    }
    pen.setLineDash([]);
    shown.forEach(({ name, colour, dash }, line) => {
      pen.fillStyle = paint(colour);
      this.plot.note(pen, panel, `${dash.text} ${name}`, line, true);
    });
    pen.strokeStyle = pen.fillStyle = paint("second");
    for (const row of points) {
      const at = across(row[x.key]), high = up(row[y.key]), [left, right] = ends(row, x), [bottom, top] = ends(row, y);
      pen.beginPath();
      pen.arc(at, high, 3.5, 0, 2 * Math.PI);
      pen.fill();
      this.plot.inside(pen, panel, () => {
        pen.beginPath();
        pen.moveTo(at, up(bottom));
        pen.lineTo(at, up(top));
        pen.moveTo(across(left), high);
        pen.lineTo(across(right), high);
        pen.stroke();
      });
    }
    if (!points.length) this.plot.note(pen, panel, phrase`no row has both quantities`);
    const values = points.map((row) => phrase`${short(row[y.key])} at ${short(row[x.key])}`).join(", ");
    find("plot").setAttribute("aria-label", phrase`${panel.name} against ${x.text}: ${values}`);
  }

  // A theory at the rows, which are in order of x, in pieces: a line between rows of the same scene
  // that differ in x, a point where a row is alone.
  pieces(rows, key, law) {
    const steps = 16, pieces = [];
    for (const title of new Set(rows.map((row) => row.title))) {
      const alike = rows.filter((row) => row.title === title);
      let piece = [];
      alike.forEach((row, k) => {
        const next = alike[k + 1], shape = next?.container.shape;
        const goesOn = shape === row.container.shape && next[key] > row[key];
        for (let part = 0; part < (goesOn ? steps : 1); part++) {
          const at = part ? between(row, next, part / steps) : row, value = law(at);
          if (value !== null && Number.isFinite(value)) piece.push([at[key], value]);
        }
        if (goesOn) return;
        if (piece.length) pieces.push(piece);
        piece = [];
      });
    }
    return pieces;
  }
}
