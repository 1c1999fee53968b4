// The charts of the gas that runs: its energy with the fitted laws, pressures beside theory, and the
// speeds beside Maxwell's law and the law at fixed energy.
"use strict";

const FIRST_SPAN = 2; // crossings of the container at the start, on the axis of time
const GROWTH = 1.5; // of that axis, when the time reaches its end

class GasCharts extends Panels {
  constructor(canvas, fluid) {
    super(canvas, [
      { name: "kinetic energy", foot: false },
      { name: "mean pressure", foot: true },
      { name: "balls by speed", foot: true, percent: true, top: MOST_SHARE },
    ]);
    this.fluid = fluid;
    this.log = false;
    this.isBrief = false; // for beginners: without the virial, where there is a wall
  }

  // A gas from its start.
  show(gas, span) {
    this.gas = gas;
    this.high = FIRST_SPAN * span;
    this.decay = null;
  }

  // The laws of the energy are fitted again; this takes longer than a drawing.
  fit() {
    this.decay = this.gas.decay();
  }

  draw() {
    const [pen, width, height] = sharp(this.canvas), { gas } = this;
    const [energy, pressure, speeds] = this.panels, size = parseFloat(getComputedStyle(this.canvas).fontSize);
    while (gas.time > this.high) this.high *= GROWTH;
    const rows = gas.rows(), now = { ...gas.row(), time: gas.time };
    const curves = this.pressures(rows);
    this.scaleEnergy(energy, rows, now);
    // A mean over a short time may be that of a single hit, so the first tenth may leave the panel.
    const begun = gas.from.time, settled = begun + (gas.time - begun) / 10;
    const late = Math.max(curves.times.findIndex((time) => time > settled), 0);
    const seen = curves.all.flatMap(({ values }) => values.slice(late)).filter(Number.isFinite);
    pressure.top = roomy(Math.max(...seen, 0));
    const shares = gas.shares;
    speeds.top = speedsTop(shares);
    this.layOut(pen, width, height, size);
    this.across = (time) => this.left + (time / this.high) * this.wide;
    this.grid(pen);
    this.footer(pen, pressure, this.across, 0, this.high, 0, "time (s)");
    this.footer(pen, speeds, (v) => this.reduced(v), 0, BIN * BINS, 0, SPEED_AXIS);
    this.drawEnergy(pen, energy, rows, now);
    this.drawPressures(pen, pressure, curves);
    this.drawSpeeds(pen, speeds, shares, now);
    this.canvas.setAttribute("aria-label", this.sentence(now, curves));
  }

  // The energy of a gas as warm as the wall, J; 0 for a wall without a temperature.
  get wallEnergy() {
    return this.gas.number * (this.gas.scene.wallLaw.temperature ?? 0);
  }

  scaleEnergy(panel, rows, now) {
    const wall = this.wallEnergy;
    const values = [...rows.map(({ energy }) => energy), now.energy, wall].filter((value) => value > 0);
    const most = Math.max(...values, 0) || 1;
    panel.log = this.log && values.length > 0;
    panel.top = panel.log ? 10 ** Math.ceil(Math.log10(most) + 1e-9) : roomy(most);
    panel.low = panel.log ? Math.min(10 ** Math.floor(Math.log10(Math.min(...values))), panel.top / 10) : 0;
  }

  drawEnergy(pen, panel, rows, now) {
    const points = [...rows, now].map(({ time, energy }) => [time, energy]);
    const warm = this.wallEnergy, { from, energy, k, alpha } = this.decay ?? {};
    const laws = this.decay ? [
      ["ink", DASHES, `Haff’s law: α = ${short(alpha)} 1/s`, (t) => (1 + alpha * t) ** -2],
      ["fourth", DOTS, `exponential: k = ${short(k)} 1/s`, (t) => Math.exp(-k * t)],
    ] : [];
    this.inside(pen, panel, () => {
      this.line(pen, panel, points, paint("first"), true);
      if (warm) this.dashed(pen, panel, [[0, warm], [this.high, warm]], paint("second"), DASHES);
      for (const [colour, dash, , law] of laws) {
        const times = Array.from({ length: 201 }, (_, part) => (part / 200) * (this.high - from));
        this.dashed(pen, panel, times.map((t) => [from + t, energy * law(t)]), paint(colour), dash);
      }
    });
    this.heading(pen, panel, [[paint("first"), `${short(now.energy)} J`]]);
    if (warm) {
      pen.fillStyle = paint("second");
      this.note(pen, panel, `${DASHES.text} N T of the wall: ${short(warm)} J`, 0, true);
    }
    laws.forEach(([colour, dash, text], line) => {
      pen.fillStyle = paint(colour);
      this.note(pen, panel, `${dash.text} ${text}`, line);
    });
  }

  // Mean pressures since the means began, after each row: at the wall, by the virial, and by theory.
  pressures(rows) {
    const { gas } = this, { scene, from } = gas, times = [], all = [];
    const { pairLaw, container } = scene, N = gas.number, drift = driftEnergy(scene);
    const ratio = isEqual(scene) && pairLaw.word === "constant"
      ? this.fluid.ratio(N, scene.radii[0], container, pairLaw.cor) : null;
    const add = (name, colour, dash) => all.push({ name, colour, dash, values: [] }) && all[all.length - 1].values;
    const wall = hasWalls(scene.container) ? add("at the wall", "third") : null;
    const virial = gas.number > 1 && !(wall && this.isBrief) ? add("by the virial", "first") : null;
    const ideal = add(THEORY.ideal, "soft", DOTS);
    const disks = ratio === null ? null : add(THEORY.finite, "ink", DASHES);
    for (const row of rows) {
      if (!(row.time > from.time)) continue;
      const means = gas.meter.means(from, row);
      times.push(row.time);
      wall?.push(means.wall);
      virial?.push(means.virial);
      ideal.push(means.ideal);
      disks?.push(means.ideal * asMet(ratio, { ...means, N, container, drift }));
    }
    return { times, all };
  }

  drawPressures(pen, panel, { times, all }) {
    this.inside(pen, panel, () => {
      for (const { colour, dash, values } of all) {
        const points = values.map((value, k) => [times[k], value]);
        if (dash) this.dashed(pen, panel, points, paint(colour), dash);
        else this.line(pen, panel, points, paint(colour), false);
      }
    });
    const texts = all.filter(({ values, dash }) => values.length && !dash)
      .map(({ colour, values }) => [paint(colour), `${short(values[values.length - 1])} Pa m`]);
    this.heading(pen, panel, texts);
    // The names are where the curves do not end.
    const low = all.some(({ values }) => values[values.length - 1] > panel.top / 2);
    all.forEach(({ name, colour, dash, values }, line) => {
      if (!values.length) return;
      pen.fillStyle = paint(colour);
      const value = dash ? `: ${short(values[values.length - 1])} Pa m` : "";
      this.note(pen, panel, `${dash?.text ?? "—"} ${name}${value}`, line, low);
    });
  }

  drawSpeeds(pen, panel, shares, now) {
    const { gas } = this;
    pen.fillStyle = paint("second");
    this.bars(pen, panel, shares, true);
    pen.setLineDash(DASHES.line);
    pen.lineWidth = 1.4;
    pen.strokeStyle = paint("ink");
    this.density(pen, panel, maxwellDensity);
    const { scene } = gas, known = energyKept(scene) && isEqual(scene);
    const fixed = gas.number > 1 && known && scene.container.shape !== "channel";
    if (fixed) {
      pen.setLineDash(DOTS.line);
      pen.strokeStyle = paint("first");
      this.density(pen, panel, fixedEnergyDensity(hasWalls(gas.scene.container) ? gas.number : gas.number - 1));
    }
    pen.setLineDash([]);
    this.heading(pen, panel, [[paint("second"), `T = ${short(now.temperature)} J`]]);
    pen.fillStyle = paint("ink");
    this.note(pen, panel, `${DASHES.text} ${THEORY.maxwell}`);
    pen.fillStyle = paint("first");
    if (fixed) this.note(pen, panel, `${DOTS.text} ${THEORY.fixed}`, 1);
  }

  // A line through points [time, value]; if it holds its values, with steps.
  line(pen, panel, points, colour, holds) {
    const line = new ThinLine(pen);
    pen.strokeStyle = colour;
    pen.lineWidth = 1.6;
    pen.lineJoin = "round";
    points.forEach(([time, value], k) => {
      if (holds && k > 0) line.add(this.across(time), this.up(panel, points[k - 1][1]));
      line.add(this.across(time), this.up(panel, value));
    });
    line.stroke();
  }

  dashed(pen, panel, points, colour, dash) {
    pen.setLineDash(dash.line);
    pen.lineWidth = 1.4;
    pen.strokeStyle = colour;
    pen.beginPath();
    for (const [time, value] of points) pen.lineTo(this.across(time), this.up(panel, value));
    pen.stroke();
    pen.setLineDash([]);
  }

  // What the charts show now, for screen readers.
  sentence(now, { all }) {
    const pressures = all.filter(({ values }) => values.length)
      .map(({ name, values }) => `mean pressure ${name} ${short(values[values.length - 1])} Pa m`);
    const texts = [`kinetic energy ${short(now.energy)} J`, ...pressures, `temperature ${short(now.temperature)} J`];
    return `Now: ${texts.join(", ")}`;
  }
}

// The top of the axis of shares: high enough for a gas that moves, and more where all balls have one speed.
const speedsTop = (shares) => Math.min(1, Math.max(MOST_SHARE, roomy(Math.max(...shares))));

// The top of an axis above a value: a number with one digit or 1.5, so that it changes rarely.
function roomy(value) {
  if (!(value > 0)) return 1;
  const power = 10 ** Math.floor(Math.log10(value)), part = (1.05 * value) / power;
  return power * [1, 1.5, 2, 3, 4, 5, 6, 8, 10, 15].find((step) => step >= part);
}
