// Kinetic energy with Haff's law and mean pressure over time, and the speeds now with Maxwell's law.
// What rests is drawn once: the axes, and curves of the whole film, shown up to the present.
"use strict";

const MARGIN = 12; // px to the right of a curve
const BIN = 0.2, BINS = 15; // of speeds over √(2T/m); the last bin has all faster balls
const MOST_SHARE = 0.25; // of the balls in a bin, at the top of the panel
const FILM_COLOURS = ["first", "second", "third", "fourth"]; // of several films

// A film's kinetic energy (J) and mean pressure since t = 0 (Pa m), after each of its collisions.
class Course {
  constructor(film, motion) {
    this.film = film;
    this.motion = motion;
    this.energy = unpacked(film.kineticEnergy, Float64Array);
    this.sum = unpacked(film.pressureSum, Float64Array);
    this.gain = film.pressureGain ? unpacked(film.pressureGain, Float64Array) : null;
    this.rows = [motion.start, ...motion.time];
    this.masses = unpacked(film.masses, Float64Array);
  }

  // Mean pressure to a time after a number of the film's collisions.
  pressure(row, time) {
    const gain = this.gain ? this.gain[row] : 0;
    return time > 0 ? (this.sum[row] + gain * (time - this.rows[row])) / time : gain;
  }

  temperature(row) {
    return this.energy[row] / this.motion.number;
  }

  // Haff's law at a time, with the rate fitted to the repeat.
  haff(time) {
    return this.film.startEnergy / (1 + this.film.haffRate * time) ** 2;
  }

  // The share of the balls in each bin of speed over √(2T/m).
  speeds(row) {
    const shares = new Float64Array(BINS), number = this.motion.number;
    const double = 2 * this.temperature(row) || 1;
    for (let ball = 0; ball < number; ball++) {
      const reduced = this.motion.speed(ball) * Math.sqrt(this.masses[ball] / double);
      shares[Math.min(Math.floor(reduced / BIN), BINS - 1)] += 1 / number;
    }
    return shares;
  }
}

// Draws a line through points in order of x. At most four of a pixel's column are kept: the first,
// the lowest, the highest and the last, so that it looks the same and takes as long for any number.
class ThinLine {
  constructor(pen) {
    this.pen = pen;
    pen.beginPath();
  }

  add(x, y) {
    const column = Math.floor(2 * x);
    if (column !== this.column) {
      this.leave();
      this.pen.lineTo(x, y);
      [this.column, this.low, this.high] = [column, y, y];
    }
    [this.x, this.y] = [x, y];
    this.low = Math.min(this.low, y);
    this.high = Math.max(this.high, y);
  }

  leave() {
    if (this.column === undefined) return;
    if (this.low < this.high) for (const y of [this.low, this.high, this.y]) this.pen.lineTo(this.x, y);
  }

  stroke() {
    this.leave();
    this.pen.stroke();
  }
}

class Charts {
  constructor(canvas, courses) {
    this.canvas = canvas;
    this.courses = courses;
    this.axes = document.createElement("canvas");
    this.curves = document.createElement("canvas");
    const all = (value) => Math.max(...courses.map(value));
    this.panels = [
      { name: "kinetic energy", unit: "J", colour: "first",
        at: (course, row) => course.energy[row], law: "Haff’s law, fitted",
        most: all((course) => course.energy.reduce((most, value) => Math.max(most, value), 0)) },
      { name: "mean pressure since t = 0", unit: "Pa m", colour: "third",
        at: (course, row, time) => course.pressure(row, time),
        most: all((course) => course.film.pressureTop) },
      { name: "balls by speed now", unit: "J", colour: "second", speeds: true, sign: "T = ",
        at: (course, row) => course.temperature(row), law: "Maxwell’s law" },
    ];
    for (const panel of this.panels) panel.top = panel.speeds ? MOST_SHARE : 1.08 * panel.most || 1;
  }

  // The colour of a film in a panel.
  colour(panel, film) {
    return paint(this.courses.length > 1 ? FILM_COLOURS[film] : panel.colour);
  }

  // reels: the moments of the films, in their order.
  draw(reels, pace) {
    const [pen, width, height] = sharp(this.canvas);
    const size = parseFloat(getComputedStyle(this.canvas).fontSize);
    const made = [width, height, window.devicePixelRatio, size, pace, paint("ink")].join();
    if (made !== this.made) this.prepare(width, height, size, pace);
    this.made = made;
    const x = Math.max(...reels.map((reel) => this.across(pace === "events" ? reel.step : reel.time)));
    pen.drawImage(this.axes, 0, 0, width, height);
    pen.save();
    pen.beginPath();
    pen.rect(0, 0, Math.max(x, this.left), height);
    pen.clip();
    pen.drawImage(this.curves, 0, 0, width, height);
    pen.restore();
    for (const panel of this.panels) {
      let right = panel.right;
      pen.font = `600 ${this.font}`;
      pen.textAlign = "right";
      pen.textBaseline = "alphabetic";
      for (let k = reels.length - 1; k >= 0; k--) {
        const value = panel.at(this.courses[k], reels[k].done, reels[k].time);
        pen.fillStyle = this.colour(panel, k);
        if (panel.speeds) this.bars(pen, panel, this.courses[k].speeds(reels[k].done));
        else this.dot(pen, panel, reels[k], pace, value);
        const text = `${panel.sign ?? ""}${short(value)} ${panel.unit}`;
        pen.fillText(text, right, panel.head);
        right -= pen.measureText(text).width + size;
      }
      pen.font = this.font;
      pen.textAlign = "left";
      pen.fillStyle = paint("ink");
      pen.fillText(panel.name, this.left, panel.head, Math.max(right - this.left, 1));
    }
  }

  // What the charts show now, for screen readers.
  sentence(reels) {
    const texts = this.panels.map((panel) => {
      const value = (reel, k) => `${short(panel.at(this.courses[k], reel.done, reel.time))} ${panel.unit}`;
      return `${panel.speeds ? "temperature" : panel.name} ${reels.map(value).join(" and ")}`;
    });
    return `Now: ${texts.join(", ")}`;
  }

  dot(pen, panel, reel, pace, value) {
    pen.beginPath();
    const x = this.across(pace === "events" ? Math.min(reel.step, this.high) : reel.time);
    pen.arc(x, this.up(panel, Math.min(value, panel.top)), 3.5, 0, 2 * Math.PI);
    pen.fill();
  }

  bars(pen, panel, shares) {
    const width = (panel.right - this.left) / BINS;
    pen.strokeStyle = pen.fillStyle;
    pen.lineWidth = 1.6;
    pen.beginPath();
    pen.moveTo(this.left, panel.bottom);
    shares.forEach((share, bin) => {
      const y = this.up(panel, Math.min(share, panel.top));
      pen.lineTo(this.left + bin * width, y);
      pen.lineTo(this.left + (bin + 1) * width, y);
    });
    pen.lineTo(panel.right, panel.bottom);
    pen.stroke();
    if (this.courses.length > 1) return; // filled ones would hide each other
    pen.globalAlpha = 0.25;
    pen.fill();
    pen.globalAlpha = 1;
  }

  up(panel, value) {
    return panel.bottom - (value / panel.top) * (panel.bottom - panel.head - this.gap);
  }

  // Draws axes and curves for a size and a pace. The labels decide where the panels begin.
  prepare(width, height, size, pace) {
    const pen = sized(this.axes, width, height), motions = this.courses.map(({ motion }) => motion);
    const byStep = pace === "events", foot = 2.9 * size, room = (height - 2 * foot) / 3;
    this.font = pen.font = `${size}px system-ui, "Segoe UI", "DejaVu Sans", sans-serif`;
    this.gap = 0.75 * size;
    this.panels.forEach((panel, k) => {
      panel.head = k * room + (k > 1 ? foot : 0) + 1.25 * size;
      panel.bottom = (k + 1) * room + (k > 1 ? foot : 0) - 0.5 * size;
      panel.right = width - MARGIN;
      const step = niceStep(panel.top, 4);
      panel.ticks = [];
      for (let value = 0; value <= panel.top; value += step) {
        const text = panel.speeds ? `${Math.round(100 * value)} %` : tickLabel(value, step);
        panel.ticks.push([value, text]);
      }
    });
    const labels = this.panels.flatMap(({ ticks }) => ticks.map(([, text]) => text));
    this.left = Math.max(...labels.map((text) => pen.measureText(text).width)) + size;
    const [low, high] = byStep
      ? [0, Math.max(1, ...motions.map(({ time }) => time.length))]
      : [Math.min(...motions.map(({ start }) => start)), Math.max(...motions.map(({ end }) => end))];
    this.high = high;
    const wide = width - MARGIN - this.left;
    this.across = (value) => this.left + ((value - low) / (high - low)) * wide;
    const soft = paint("soft"), rule = paint("rule");
    for (const panel of this.panels) {
      pen.textBaseline = "middle";
      pen.textAlign = "right";
      for (const [value, text] of panel.ticks) {
        const y = Math.round(this.up(panel, value)) + 0.5;
        pen.strokeStyle = value === 0 ? soft : rule;
        pen.beginPath();
        pen.moveTo(this.left, y);
        pen.lineTo(panel.right, y);
        pen.stroke();
        pen.fillStyle = soft;
        pen.fillText(text, this.left - size / 2, y);
      }
    }
    const [energy, pressure, speeds] = this.panels, reduced = (value) => this.left + (value / (BIN * BINS)) * wide;
    this.footer(pen, pressure, size, this.across, low, high, byStep ? 1 : 0, byStep ? "collisions shown" : "time (s)");
    this.footer(pen, speeds, size, reduced, 0, BIN * BINS, 0, "speed ÷ √(2T/m)");
    this.laws(pen, energy, speeds, size, byStep, reduced);
    this.drawCurves(sized(this.curves, width, height), [energy, pressure], byStep);
  }

  // The curves of the whole film: values just before and just after each collision.
  drawCurves(pen, panels, byStep) {
    pen.lineWidth = 1.6;
    pen.lineJoin = "round";
    for (const panel of panels) {
      pen.save();
      pen.beginPath();
      pen.rect(this.left, panel.head + this.gap, panel.right - this.left, panel.bottom - panel.head - this.gap + 1);
      pen.clip();
      this.courses.forEach((course, k) => {
        const line = new ThinLine(pen), { rows, motion } = course, last = rows.length - 1;
        let begun = false; // a mean since t = 0 begins with a collision
        const add = (row, x, time) => {
          const value = panel.at(course, row, time);
          begun ||= value !== 0;
          if (begun) line.add(this.across(x), this.up(panel, value));
        };
        rows.forEach((time, row) => {
          if (row > 0) add(row - 1, byStep ? row : time, time);
          add(row, byStep ? row : time, time);
        });
        if (!byStep) add(last, motion.end, motion.end);
        pen.strokeStyle = this.colour(panel, k);
        line.stroke();
      });
      pen.restore();
    }
  }

  // Dashed curves: Haff's law of films that cool, and Maxwell's; with their names.
  laws(pen, energy, speeds, size, byStep, reduced) {
    pen.setLineDash([5, 4]);
    pen.lineWidth = 1.4;
    const cooling = this.courses.filter(({ film }) => film.haffRate !== null);
    for (const course of cooling) {
      const line = new ThinLine(pen), { rows, motion } = course;
      pen.strokeStyle = this.courses.length > 1 ? this.colour(energy, this.courses.indexOf(course)) : paint("ink");
      const add = (x, time) => line.add(this.across(x), this.up(energy, Math.min(course.haff(time), energy.top)));
      if (byStep) rows.forEach((time, row) => add(row, time));
      else for (let part = 0; part <= 1; part += 1 / 256) {
        const time = motion.start + part * (motion.end - motion.start);
        add(time, time);
      }
      line.stroke();
    }
    pen.strokeStyle = paint("ink");
    pen.beginPath();
    for (let v = 0; v <= BIN * BINS; v += BIN / 8) {
      pen.lineTo(reduced(v), this.up(speeds, BIN * 2 * v * Math.exp(-v * v)));
    }
    pen.stroke();
    pen.setLineDash([]);
    pen.fillStyle = paint("ink");
    pen.textAlign = "right";
    pen.textBaseline = "top";
    const rate = this.courses.length > 1 ? "" : `: α = ${short(cooling[0]?.film.haffRate ?? 0)} 1/s`;
    for (const panel of cooling.length ? [energy, speeds] : [speeds]) {
      const text = `- - ${panel.law}${panel === energy ? rate : ""}`;
      pen.fillText(text, panel.right, panel.head + this.gap + 0.4 * size, panel.right - this.left);
    }
  }

  // The labels and the name of an axis below a panel, as many as there is room for.
  footer(pen, panel, size, across, low, high, least, name) {
    pen.fillStyle = paint("soft");
    pen.textBaseline = "top";
    pen.textAlign = "center";
    let ticks = [];
    for (let most = 6; most > 1; most--) {
      const step = Math.max(niceStep(high - low, most), least);
      ticks = [];
      for (let value = Math.ceil(low / step) * step; value <= high * (1 + 1e-12); value += step) {
        ticks.push([value, tickLabel(value, step)]);
      }
      const needed = Math.max(...ticks.map(([, text]) => pen.measureText(text).width)) + size;
      if (needed * (high - low) <= step * (across(high) - across(low))) break;
    }
    for (const [value, text] of ticks) {
      const end = panel.right + MARGIN - pen.measureText(text).width / 2;
      pen.fillText(text, Math.min(across(value), end), panel.bottom + size / 2);
    }
    pen.textAlign = "right";
    pen.fillText(name, panel.right, panel.bottom + 1.75 * size);
  }
}
