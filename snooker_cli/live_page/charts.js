// The charts of the gas that runs: its energy with the fitted laws, pressures beside theory, and the
// speeds beside Maxwell's law and the law at fixed energy. Of several gases, each has a colour; then
// there is one pressure of each, and no law but Maxwell's.

const STYLES = { ideal: ["soft", DOTS], finite: ["ink", DASHES] }; // of theories: colour and dashes
const GAS_COLOURS = ["first", "second", "third", "fourth"];
const FIT_EVERY = 300; // ms
const FIRST_SPAN = 2; // crossings of the container at the start, on the axis of time
const GROWTH = 1.5; // of that axis, when the time reaches its end
const FIRST_COLLISIONS = 100; // collisions whose mean pressure may leave the panel; at most a tenth of all

class GasCharts extends Panels {
  constructor(canvas) {
    super(canvas, [
      { name: phrase`kinetic energy`, foot: false },
      { name: phrase`mean pressure`, foot: true },
      { name: phrase`balls by speed`, foot: true, percent: true, top: MOST_SHARE },
    ]);
    this.log = false;
    this.isBrief = false; // for beginners: without the virial, where there is a wall
  }

  // Gases from their start. low, high: s, of the axis of time, which grows with them.
  show(gases, high, low = 0) {
    this.gases = gases;
    [this.gas] = gases;
    this.low = low;
    this.high = high;
    this.decay = null;
  }

  get several() {
    return this.gases.length > 1;
  }

  // The laws of the energy are fitted again; this takes longer than a drawing.
  fit() {
    this.decay = this.several ? null : this.gas.decay();
  }

  draw() {
    const [pen, width, height] = sharp(this.canvas), { gases } = this;
    const [energy, pressure, speeds] = this.panels, size = parseFloat(getComputedStyle(this.canvas).fontSize);
    while (Math.max(...gases.map(({ time }) => time)) > this.high) this.high *= GROWTH;
    const courses = gases.map((gas, k) => this.courseOf(gas, k));
    this.scaleEnergy(energy, courses);
    pressure.top = roomy(Math.max(...courses.flatMap(({ seen }) => seen), 0));
    speeds.top = Math.max(...gases.map(({ shares }) => speedsTop(shares)));
    this.layOut(pen, width, height, size);
    this.across = (time) => this.left + ((time - this.low) / (this.high - this.low)) * this.wide;
    this.grid(pen);
    this.footer(pen, pressure, this.across, this.low, this.high, 0, phrase`time (s)`);
    this.footer(pen, speeds, (v) => this.reduced(v), 0, BIN * BINS, 0, SPEED_AXIS);
    this.drawEnergy(pen, energy, courses);
    this.drawPressures(pen, pressure, courses);
    this.drawSpeeds(pen, speeds, courses);
    this.canvas.setAttribute("aria-label", this.sentence(courses));
  }

  // What is drawn of a gas: its colour, if there are several; rows up until now, and those still to come; the
  // pressures of all; and those that the panel has room for.
  courseOf(gas, k) {
    const now = { ...gas.row(), ...gas.sums, time: gas.time }, all = gas.rows().filter(({ time }) => time >= this.low);
    const rows = [...all.filter(({ time }) => time < now.time), now], later = all.filter(({ time }) => time > now.time);
    // The mean of a few collisions may be far off, so that of the first ones may leave the panel; theory may not.
    const shown = [...rows, ...later], times = shown.map(({ time }) => time), counts = shown.map((row) => this.meant(gas, row));
    const enough = Math.min(counts[counts.length - 1] / 10, FIRST_COLLISIONS);
    const late = counts.findIndex((count) => count >= enough);
    const pressures = this.pressures(gas, shown);
    const seen = pressures.flatMap(({ values, dash }) => (dash ? values : values.slice(late))).filter(Number.isFinite);
    return { gas, now, rows, later, times, pressures, seen, colour: this.several ? paint(GAS_COLOURS[k]) : null };
  }

  // The collisions of a gas's means up to a row.
  meant({ from }, { wallEvents, pairEvents }) {
    return wallEvents + pairEvents - from.wallEvents - from.pairEvents;
  }

  // The energy of a gas that is as warm as its wall, J; 0 where nothing is compared with it.
  get wallEnergy() {
    const traits = traitsOf(this.gas.scene), { wall } = THEORIES.energy;
    return applies(wall, traits) ? wall.value(traits) : 0;
  }

  scaleEnergy(panel, courses) {
    const all = courses.flatMap(({ rows, later }) => [...rows, ...later].map(({ energy }) => energy));
    const values = [...all, this.several ? 0 : this.wallEnergy].filter((value) => value > 0);
    const most = Math.max(...values, 0) || 1;
    panel.log = this.log && values.length > 0;
    panel.top = panel.log ? 10 ** Math.ceil(Math.log10(most) + 1e-9) : roomy(most);
    panel.low = panel.log ? Math.min(10 ** Math.floor(Math.log10(Math.min(...values))), panel.top / 10) : 0;
  }

  drawEnergy(pen, panel, courses) {
    const warm = this.several ? 0 : this.wallEnergy, { from, energy, k, alpha } = this.decay ?? {};
    const laws = this.decay ? [
      ["ink", DASHES, phrase`Haff’s law: α = ${short(alpha)} 1/s`, (t) => FORMULAS.haffRatio(t, alpha)],
      ["fourth", DOTS, phrase`exponential: k = ${short(k)} 1/s`, (t) => Math.exp(-k * t)],
    ] : [];
    this.inside(pen, panel, () => {
      for (const { rows, colour } of courses) {
        this.line(pen, panel, rows.map(({ time, energy: value }) => [time, value]), colour ?? paint("first"), true);
      }
      if (warm) this.dashed(pen, panel, [[this.low, warm], [this.high, warm]], paint("second"), DASHES);
      for (const [colour, dash, , law] of laws) {
        const times = Array.from({ length: 201 }, (_, part) => (part / 200) * (this.high - from));
        this.dashed(pen, panel, times.map((t) => [from + t, energy * law(t)]), paint(colour), dash);
      }
    });
    this.heading(pen, panel, courses.map(({ now, colour }) => [colour ?? paint("first"), `${short(now.energy)} J`]));
    if (warm) {
      pen.fillStyle = paint("second");
      this.note(pen, panel, `${DASHES.text} ${phrase`N T of the wall: ${short(warm)} J`}`, 0, true);
    }
    laws.forEach(([colour, dash, text], line) => {
      pen.fillStyle = paint(colour);
      this.note(pen, panel, `${dash.text} ${text}`, line);
    });
  }

  // Mean pressures since the means began, at each row: at the wall, by the virial, and by theory; one of
  // several gases.
  pressures(gas, rows) {
    const all = [], { scene, from } = gas, traits = traitsOf(scene), balls = equalBallsOf(scene);
    const add = (name, colour, dash) => all.push({ name, colour, dash, values: [] }) && all[all.length - 1].values;
    const wall = hasWalls(scene.container) ? add(phrase`at the wall`, "third") : null;
    const virial = gas.number > 1 && !(wall && (this.isBrief || this.several)) ? add(phrase`by the virial`, "first") : null;
    const theories = Object.entries(this.several ? {} : THEORIES.pressure).filter(([, theory]) => applies(theory, traits));
    const laws = theories.map(([name, { model, value }]) => [value, add(model, ...STYLES[name])]);
    for (const row of rows) {
      const means = row.time > from.time ? gas.meter.means(from, row) : null;
      wall?.push(means?.wall);
      virial?.push(means?.virial);
      for (const [value, values] of laws) values.push(means ? value(gasOf(balls, means.temperature)) : undefined);
    }
    return all;
  }

  drawPressures(pen, panel, courses) {
    const known = ({ times, now }, values) => values.map((value, k) => [times[k], value])
      .filter(([time, value]) => value !== undefined && time <= now.time);
    const texts = [], names = [];
    this.inside(pen, panel, () => {
      for (const course of courses) {
        for (const { name, colour, dash, values } of course.pressures) {
          const points = known(course, values), shade = course.colour ?? paint(colour);
          if (!points.length) continue;
          if (dash) this.dashed(pen, panel, points, shade, dash);
          else this.line(pen, panel, points, shade, false);
          const [, now] = points[points.length - 1], value = `${short(now)} Pa m`;
          if (!dash) texts.push([shade, value]);
          if (!this.several) names.push([shade, `${dash?.text ?? "—"} ${name}${dash ? `: ${value}` : ""}`, now]);
        }
      }
    });
    this.heading(pen, panel, texts);
    // The names are where the curves do not end.
    const low = names.some(([, , now]) => now > panel.top / 2);
    names.forEach(([shade, text], line) => {
      pen.fillStyle = shade;
      this.note(pen, panel, text, line, low);
    });
  }

  drawSpeeds(pen, panel, courses) {
    for (const { gas, colour } of courses) {
      pen.fillStyle = colour ?? paint("second");
      this.bars(pen, panel, gas.shares, !this.several);
    }
    pen.setLineDash(DASHES.line);
    pen.lineWidth = 1.4;
    pen.strokeStyle = paint("ink");
    const { scene } = this.gas, balls = equalBallsOf(scene), { maxwell, fixed } = THEORIES.speeds;
    this.density(pen, panel, (v) => maxwell.value(balls, v));
    const isFixed = !this.several && applies(fixed, traitsOf(scene));
    if (isFixed) {
      pen.setLineDash(DOTS.line);
      pen.strokeStyle = paint("first");
      this.density(pen, panel, (v) => fixed.value(balls, v));
    }
    pen.setLineDash([]);
    this.heading(pen, panel, courses.map(({ now, colour }) => [colour ?? paint("second"), `T = ${short(now.temperature)} J`]));
    pen.fillStyle = paint("ink");
    this.note(pen, panel, `${DASHES.text} ${maxwell.model}`);
    pen.fillStyle = paint("first");
    if (isFixed) this.note(pen, panel, `${DOTS.text} ${fixed.model}`, 1);
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
  sentence(courses) {
    const texts = courses.map(({ now, rows, pressures }) => {
      const last = (values) => values[rows.length - 1];
      const shown = pressures.filter(({ dash, values }) => !dash && last(values) !== undefined)
        .map(({ name, values }) => phrase`mean pressure ${name} ${short(last(values))} Pa m`);
      const energy = phrase`kinetic energy ${short(now.energy)} J`;
      return [energy, ...shown, phrase`temperature ${short(now.temperature)} J`].join(", ");
    });
    return phrase`Now: ${texts.join("; ")}`;
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
