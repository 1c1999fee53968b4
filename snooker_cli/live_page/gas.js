// The gas that the page shows: a simulation that runs as far as it is asked to, and what is kept of
// it for the arena and the charts. It has no part of the page, so that tests can run it.
"use strict";

const KEPT_CONTACTS = 60;
const TC = 0.01; // the duration of contacts, in mean free times, that prevents a collapse

class Gas {
  // The first repeat of a config. Throws an error with a sentence for a scene that does not fit.
  constructor(config) {
    this.config = config;
    this.begun = 0; // s, and collisions, before the simulation that runs now
    this.before = 0;
    this.changed = false; // whether no config describes it any more
    this.time = 0; // s, that is shown
    this.end = config.collisions === null ? config.time : Infinity; // s; other gases run on
    this.contacts = []; // the last ones: { time, step, x, y, radius }
    this.start(startingScene(config, 0));
    this.startEnergy = this.meter.startEnergy;
    this.series = new Series();
    this.addRow();
    this.forgetMeans();
  }

  start(scene) {
    this.scene = scene;
    this.simulation = new Simulation(scene, {}, { hash: true });
    this.meter = new Meter(scene, this.simulation);
    this.radii = scene.radii;
    this.number = scene.radii.length;
    this.stop = null;
  }

  get collisions() {
    return this.before + this.simulation.wallEvents + this.simulation.pairEvents;
  }

  // Simulates at most a number of collisions, up to a time, s, and a deadline of the computer's clock,
  // ms. Whether it got as far as it was asked to.
  advance(until, most = Infinity, deadline = Infinity) {
    until = Math.min(until, this.end);
    for (let done = 0; done < most && !this.stop; done++) {
      this.stop = this.simulation.advance(1, until - this.begun);
      if (this.simulation.eventCount) this.follow();
      else if (!this.stop && until === Infinity) return false; // very long without a collision
      else {
        this.time = this.stop ? Math.min(until, this.begun + this.stop.time) : until;
        if (until === this.end) {
          this.stop ??= { reason: "end", message: `${until} s reached after ${this.collisions} collisions` };
        }
        return true;
      }
      if (done % 16 === 15 && Date.now() >= deadline) {
        this.time = this.begun + this.simulation.time;
        return false;
      }
    }
    this.time = Math.max(this.time, this.begun + this.simulation.time);
    return true;
  }

  // Keeps what the charts need of the event that has just happened.
  follow() {
    this.meter.follow();
    const { simulation } = this, time = this.begun + simulation.time;
    const i = simulation.eventI[0], j = simulation.eventJ[0];
    this.contacts.push({ time, step: this.collisions, ...this.contact(i, j) });
    if (this.contacts.length > KEPT_CONTACTS) this.contacts.shift();
    if (this.course && (i === this.tagged || j === this.tagged)) {
      this.course.push([time, ...this.place(this.tagged, time)]);
    }
    this.series.add(() => this.row());
    if (this.collisions >= this.nextSample) this.sampleSpeeds();
  }

  // Where ball i touches ball j or the wall, m, and the radius of ball i.
  contact(i, j) {
    const { container } = this.scene, time = this.begun + this.simulation.time, radius = this.radii[i];
    const [x, y] = this.place(i, time), [width, height] = container.size;
    let across, along;
    if (j >= 0) {
      const [otherX, otherY] = this.place(j, time);
      [across, along] = [otherX - x, otherY - y];
      if (container.shape === "periodic") across -= width * Math.round(across / width);
      if (container.shape !== "box" && container.shape !== "circle") along -= height * Math.round(along / height);
    } else {
      const [cx, cy] = this.place(this.number, time);
      [across, along] = [x - cx, y - cy];
      if (container.shape !== "circle") {
        const isNearer = width / 2 - Math.abs(across) <= height / 2 - Math.abs(along);
        [across, along] = isNearer || container.shape === "channel" ? [Math.sign(across), 0] : [0, Math.sign(along)];
      }
    }
    const length = Math.hypot(across, along) || 1;
    return { x: x + (radius * across) / length, y: y + (radius * along) / length, radius };
  }

  // Where a ball, or as number N the container, is at a time after the last collision, m.
  place(ball, time) {
    const [x, y] = this.simulation.positionOf(ball, time - this.begun);
    return [x, y];
  }

  speed(ball) {
    const [u, v] = this.simulation.velocityOf(ball, this.time - this.begun);
    return Math.hypot(u, v);
  }

  // The path of a ball from now on: [time, x, y] at its collisions, which are added as they happen.
  path(ball) {
    this.tagged = ball;
    this.course = [[this.time, ...this.place(ball, this.time)]];
    return this.course;
  }

  row() {
    const { meter } = this, sums = meter.sums();
    const energies = { energy: meter.totalEnergy, temperature: meter.energy / this.number };
    return { ...sums, time: this.begun + sums.time, simulated: sums.time, ...energies };
  }

  addRow() {
    this.series.add(() => this.row());
  }

  // Means, rates and the histogram of speeds begin again: at the start, and when a slider was moved.
  forgetMeans() {
    const sums = this.meter.sums(Math.max(this.time - this.begun, this.simulation.time));
    this.from = { ...sums, energy: this.meter.totalEnergy };
    this.counts = new Float64Array(BINS);
    this.sampled = 0;
    this.nextSample = this.collisions;
    this.sampleSpeeds();
  }

  // Adds the speeds over √(2T/m) to the histogram, once in a collision of each ball.
  sampleSpeeds() {
    this.nextSample = this.collisions + Math.max(1, this.number / 2);
    const double = (2 * this.meter.energy) / this.number;
    if (!(double > 0)) return;
    for (let ball = 0; ball < this.number; ball++) {
      const [u, v] = this.simulation.velocityOf(ball);
      const reduced = Math.sqrt((this.scene.masses[ball] * (u * u + v * v)) / double);
      this.counts[Math.min(Math.floor(reduced / BIN), BINS - 1)]++;
    }
    this.sampled += this.number;
  }

  // Means since they began, or null before the first collision.
  means() {
    const to = this.meter.sums(Math.max(this.time - this.begun, this.simulation.time));
    return to.time > this.from.time ? this.meter.means(this.from, to) : null;
  }

  // Rows since the means began, at most a number of them, the latest one last.
  rows(most = 1000) {
    const rows = this.series.rows, step = Math.ceil(rows.length / most);
    const chosen = rows.filter((_, k) => k % step === 0), last = rows[rows.length - 1];
    if (last && chosen[chosen.length - 1] !== last) chosen.push(last);
    return chosen;
  }

  // k and α (1/s) of the energy since the means began, and the energy (J) and time (s) then.
  decay() {
    const from = this.begun + this.from.time, energy = this.from.energy;
    const rows = this.rows().filter(({ time }) => time >= from);
    if (rows.length < 10 || !(energy > 0) || energyKept(this.scene) || isWarm(this.scene)) return null;
    const times = [0, ...rows.map(({ time }) => time - from)];
    const values = [1, ...rows.map((row) => row.energy / energy)];
    return { from, energy, k: decayRate(times, values, 0), alpha: decayRate(times, values, 2) };
  }

  // [number, hash] of the first 1,000, 10,000 … collisions, and at the end of all.
  get hashes() {
    const { hashes, hash } = this.simulation;
    if (!this.stop || hashes.some(([count]) => count === hash.count)) return hashes;
    return [...hashes, [hash.count, hash.digest()]];
  }

  // Other laws of collision from now on.
  setLaws(config) {
    this.config = config;
    const { pairLaw, wallLaw } = collisionRules(config);
    this.simulation.setLaws(pairLaw, wallLaw);
    this.changed = true;
    this.forgetMeans();
  }

  // Continues after a wall trap or a collapse, from the places and velocities now: the ball slides
  // along the wall (`slide`), or contacts have a duration (`tc`).
  continueWith(way) {
    if (way === "on") {
      this.end = Infinity;
      this.stop = null;
      return;
    }
    const { scene, simulation, number } = this, { time } = simulation;
    const positions = new Float64Array(2 * number), velocities = new Float64Array(2 * number);
    for (let ball = 0; ball < number; ball++) {
      positions.set(simulation.positionOf(ball, time), 2 * ball);
      velocities.set(simulation.velocityOf(ball, time), 2 * ball);
    }
    const containerPosition = [...simulation.positionOf(number, time)];
    const containerVelocity = [...simulation.velocityOf(number, time)];
    const rules = { slides: way === "slide", contactDuration: way === "tc" ? TC : 0, elasticBelow: 0 };
    this.before = this.collisions;
    this.begun += time;
    this.changed = true;
    this.start({ ...scene, ...rules, positions, velocities, containerPosition, containerVelocity });
    this.forgetMeans();
  }

  // How a repeat that ended can continue: not at all, `on` after its time, with `slide` or with `tc`.
  get continuation() {
    if (this.stop?.reason === "end") return "on";
    if (!["wall_trap", "collapse"].includes(this.stop?.reason)) return null;
    const { container, containerMass, wallLaw } = this.scene;
    const fixed = container.shape === "circle" && !Number.isFinite(containerMass);
    const slides = fixed && wallLaw.word === "constant" && wallLaw.cor <= 1 - 1e-6;
    return this.stop.reason === "wall_trap" && slides ? "slide" : "tc";
  }
}
