// Kinetic energy with Haff's law and mean pressure over time, and the speeds now with Maxwell's law.
// What rests is drawn once: the axes, and curves of the whole film, shown up to the present.
"use strict";

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
      shares[binOf(reduced)] += 1 / number;
    }
    return shares;
  }
}

class Charts extends Panels {
  constructor(canvas, courses) {
    const all = (value) => Math.max(...courses.map(value));
    super(canvas, [
      { name: "kinetic energy", unit: "J", colour: "first",
        at: (course, row) => course.energy[row], law: "Haff’s law, fitted",
        most: all((course) => course.energy.reduce((most, value) => Math.max(most, value), 0)) },
      { name: "mean pressure since t = 0", unit: "Pa m", colour: "third", foot: true,
        at: (course, row, time) => course.pressure(row, time),
        most: all((course) => course.film.pressureTop) },
      { name: "balls by speed now", unit: "J", colour: "second", foot: true, percent: true, sign: "T = ",
        at: (course, row) => course.temperature(row), law: "Maxwell’s law" },
    ]);
    this.courses = courses;
    this.axes = element("canvas");
    this.curves = element("canvas");
    for (const panel of this.panels) panel.top = panel.percent ? MOST_SHARE : 1.08 * panel.most || 1;
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
      const texts = reels.map((reel, k) => {
        const value = panel.at(this.courses[k], reel.done, reel.time), colour = this.colour(panel, k);
        pen.fillStyle = colour;
        if (panel.percent) this.bars(pen, panel, this.courses[k].speeds(reel.done), reels.length === 1);
        else this.dot(pen, panel, reel, pace, value);
        return [colour, `${panel.sign ?? ""}${short(value)} ${panel.unit}`];
      });
      this.heading(pen, panel, texts);
    }
  }

  // What the charts show now, for screen readers.
  sentence(reels) {
    const texts = this.panels.map((panel) => {
      const value = (reel, k) => `${short(panel.at(this.courses[k], reel.done, reel.time))} ${panel.unit}`;
      return `${panel.percent ? "temperature" : panel.name} ${reels.map(value).join(" and ")}`;
    });
    return `Now: ${texts.join(", ")}`;
  }

  dot(pen, panel, reel, pace, value) {
    pen.beginPath();
    const x = this.across(pace === "events" ? Math.min(reel.step, this.high) : reel.time);
    pen.arc(x, this.up(panel, Math.min(value, panel.top)), 3.5, 0, 2 * Math.PI);
    pen.fill();
  }

  // Draws axes and curves for a size and a pace. The labels decide where the panels begin.
  prepare(width, height, size, pace) {
    const pen = sized(this.axes, width, height), motions = this.courses.map(({ motion }) => motion);
    const byStep = pace === "events";
    this.layOut(pen, width, height, size);
    const [low, high] = byStep
      ? [0, Math.max(1, ...motions.map(({ time }) => time.length))]
      : [Math.min(...motions.map(({ start }) => start)), Math.max(...motions.map(({ end }) => end))];
    this.high = high;
    this.across = (value) => this.left + ((value - low) / (high - low)) * this.wide;
    this.grid(pen);
    const [energy, pressure, speeds] = this.panels;
    this.footer(pen, pressure, this.across, low, high, byStep ? 1 : 0, byStep ? "collisions shown" : "time (s)");
    this.footer(pen, speeds, (v) => this.reduced(v), 0, BIN * BINS, 0, SPEED_AXIS);
    this.laws(pen, energy, speeds, byStep);
    this.drawCurves(sized(this.curves, width, height), [energy, pressure], byStep);
  }

  // The curves of the whole film: values just before and just after each collision.
  drawCurves(pen, panels, byStep) {
    pen.lineWidth = 1.6;
    pen.lineJoin = "round";
    for (const panel of panels) {
      this.inside(pen, panel, () => this.courses.forEach((course, k) => {
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
      }));
    }
  }

  // Dashed curves: Haff's law of films that cool, and Maxwell's; with their names.
  laws(pen, energy, speeds, byStep) {
    pen.setLineDash(DASHES.line);
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
    this.density(pen, speeds, maxwellDensity);
    pen.setLineDash([]);
    pen.fillStyle = paint("ink");
    const rate = this.courses.length > 1 ? "" : `: α = ${short(cooling[0]?.film.haffRate ?? 0)} 1/s`;
    for (const panel of cooling.length ? [energy, speeds] : [speeds]) {
      this.note(pen, panel, `${DASHES.text} ${panel.law}${panel === energy ? rate : ""}`);
    }
  }
}
