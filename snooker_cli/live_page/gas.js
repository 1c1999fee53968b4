// The gas that the page shows: a simulation that runs as far as it is asked to, and what is kept of
// it for the arena and the charts. It has no part of the page, so that tests can run it.

const TC = 0.01; // the duration of contacts, in mean free times, that prevents a collapse
const LEAST_SHARE = 1e-200; // of the energy at the start, below which the gas ends: numbers end at 1e-308
const KEPT_PARTS = 6000; // of a path, of which the arena draws the latest half
const SMALL_TURN = 0.1; // rad, of a part of the path of a ball that slides
const MOST_KEPT = 64, FIRST_STRIDE = 1000; // moments to go back to, and collisions between them
const PATH_BEGINS = 20000; // collisions ago, at most
const FLASH_NUMBERS = 7; // time, ball, other ball or wall, places of both
const SLIDING = { slides: true, contactDuration: 0, elasticBelow: 0 }; // of a scene whose balls slide

class Gas {
  // The first repeat of a config. Throws an error with a sentence for a scene that does not fit. The
  // gas runs on after the config's number of collisions, but not after its time. own: see ``startingScene``.
  // scene: with a stored start; then the config has a time only.
  constructor(config, own = null, scene = startingScene(config, 0, own)) {
    this.config = config;
    this.changed = false; // whether no config describes it any more
    this.time = 0; // s, that is shown
    this.watch = null; // what a stopwatch began with, and its end
    this.flashes = new Float64Array(FLASH_NUMBERS * MOST_FLASHES); // of each of the last events
    this.tagged = this.course = null; // the ball whose path is shown, and the path
    this.known = 0; // collisions up to which the path is known
    this.start = scene;
    this.simulation = new Simulation(scene, { time: config.time }, { hash: true });
    this.meter = new Meter(scene, this.simulation);
    this.startEnergy = this.meter.totalEnergy; // J
    this.radii = scene.radii;
    this.number = scene.radii.length;
    this.series = new Series();
    this.series.add(() => this.row());
    this.followed = 0; // collisions that ``series`` has
    this.times = null; // s, of all collisions, where a page needs them
    this.forgetMeans();
    this.forgetMoments();
  }

  get scene() {
    return this.simulation.scene;
  }

  get stop() {
    return this.simulation.stop;
  }

  get collisions() {
    return this.simulation.collisions;
  }

  // Simulates at most a number of collisions, up to a time, s, and a deadline of the computer's clock,
  // ms. Whether it got as far as it was asked to.
  advance(until, most = Infinity, deadline = Infinity) {
    const { simulation } = this;
    for (let done = 0; done < most && !this.stop; done += simulation.eventCount) {
      const toSample = Math.ceil(this.nextSample - this.collisions); // then velocities are needed
      const stop = simulation.advance(Math.min(most - done, toSample), until), { eventCount, reached } = simulation;
      if (eventCount) this.follow();
      if (this.collisions >= this.nextKept) this.keepMoment();
      if (this.meter.totalEnergy < LEAST_SHARE * this.startEnergy) {
        simulation.halt(phrase`the gas has lost all but ${LEAST_SHARE} of its energy`);
      }
      // Where no collision can happen any more, balls still move.
      const isFree = stop?.reason === NOTHING_LEFT && until < simulation.timeLimit;
      if (isFree) simulation.stop = null;
      if (isFree || (!stop && reached === until)) {
        this.time = until;
        return true;
      }
      // A step to the next collision gives up when it is far.
      const isFar = !eventCount && deadline === Infinity;
      if (!stop && (isFar || Date.now() >= deadline)) {
        this.time = Math.max(this.time, reached);
        return false;
      }
    }
    this.time = Math.max(this.time, this.stop?.time ?? simulation.time);
    return true;
  }

  // Keeps what the charts need of the events that have just happened.
  follow() {
    const { simulation, meter, series, tagged } = this, { eventCount, eventTime, eventI, eventJ } = simulation;
    const { eventPlaces, eventVelocities } = simulation, rowNow = () => this.row(), before = this.collisions - eventCount;
    for (let row = 0; row < eventCount; row++) {
      if (eventTime(row) > this.watch?.end) this.stopWatch();
      meter.follow(row);
      if (before + row >= this.followed) {
        series.add(rowNow);
        this.times?.push(eventTime(row));
      }
      if (this.course && before + row >= this.known && (eventI(row) === tagged || eventJ(row) === tagged)) {
        const begin = 4 * row + (eventI(row) === tagged ? 0 : 2);
        this.addToPath(eventTime(row), eventPlaces.subarray(begin, begin + 2), eventVelocities.subarray(begin, begin + 2));
      }
    }
    this.followed = Math.max(this.followed, this.collisions);
    this.known = Math.max(this.known, this.collisions);
    if (this.course?.length > KEPT_PARTS) this.course.splice(0, this.course.length - KEPT_PARTS / 2);
    for (let row = Math.max(eventCount - MOST_FLASHES, 0); row < eventCount; row++) {
      const at = FLASH_NUMBERS * ((this.collisions - eventCount + row) % MOST_FLASHES);
      this.flashes[at] = eventTime(row);
      this.flashes[at + 1] = eventI(row);
      this.flashes[at + 2] = eventJ(row);
      for (let k = 0; k < 4; k++) this.flashes[at + 3 + k] = eventPlaces[4 * row + k];
    }
    if (this.collisions >= this.nextSample) this.sampleSpeeds();
  }

  // Forgets all moments before now: the gas cannot go back to them.
  forgetMoments() {
    this.kept = [];
    this.stride = FIRST_STRIDE;
    this.keepMoment();
  }

  // Keeps this moment. When there are too many, every second one is left out.
  keepMoment() {
    const { collisions, simulation, meter, counts, sampled, nextSample, from, flashes } = this;
    const numbers = { sampled, nextSample, from, counts: counts.slice(), flashes: flashes.slice() };
    this.kept.push({ collisions, simulation: simulation.save(), meter: { ...meter }, numbers });
    if (this.kept.length > MOST_KEPT) {
      this.kept = this.kept.filter((_, k) => k % 2 === 0);
      this.stride *= 2;
    }
    this.nextKept = this.kept[this.kept.length - 1].collisions + this.stride;
  }

  get canGoBack() {
    return this.collisions > this.kept[0].collisions;
  }

  // Goes to just after a number of collisions, from now or from a moment that is kept.
  goTo(collisions) {
    const kept = this.kept.findLast((moment) => moment.collisions <= collisions) ?? this.kept[0];
    const leavesGap = this.course && kept.collisions > this.known && collisions - this.collisions < PATH_BEGINS;
    if (collisions < this.collisions || (kept.collisions > this.collisions && !leavesGap)) this.restore(kept);
    // Where a ball slides, its path has each place at a collision.
    const most = this.course && this.simulation.motions ? 1 : Infinity;
    while (this.collisions < collisions && !this.stop) {
      this.advance(Infinity, Math.min(collisions - this.collisions, most));
      this.followSlide();
    }
  }

  restore({ simulation, meter, numbers }) {
    this.simulation.restore(simulation);
    Object.assign(this.meter, meter);
    Object.assign(this, numbers, { counts: numbers.counts.slice(), flashes: numbers.flashes.slice() });
    this.time = this.simulation.time;
    if (this.course && (this.time < this.course[0][0] || this.collisions > this.known)) this.beginPath();
  }

  // Begins the path of the tagged ball here.
  beginPath() {
    this.course = [];
    this.addToPath(this.time, this.place(this.tagged, this.time), this.simulation.velocityOf(this.tagged, this.time));
    this.known = this.collisions;
  }

  // Adds a place of the tagged ball, or in a container that repeats the image of it where the path goes on.
  addToPath(time, place, velocity) {
    const before = this.course[this.course.length - 1];
    this.course.push([time, ...(before ? this.imageOnPath(before, time, place) : place), ...velocity]);
  }

  // The image of a place that a ball reaches at a time, if it was at a point of its path before.
  imageOnPath([before, x, y, u, v], time, place) {
    const { container } = this.scene, ahead = [x + u * (time - before), y + v * (time - before)];
    return place.map((at, axis) => {
      const side = container.size[axis];
      return repeatsAlong(axis, container) ? at + side * Math.round((ahead[axis] - at) / side) : at;
    });
  }

  // The tagged ball's path until now: [time, x, y, velocity after it], at most this many points.
  pathUntil(time, most) {
    const path = this.course.filter(([at]) => at <= time).slice(-most), before = path[path.length - 1];
    if (before) path.push([time, ...this.imageOnPath(before, time, this.place(this.tagged, time))]);
    return path;
  }

  // The contacts of the last events, the latest one last: { time, step, x, y, radius }.
  get contacts() {
    const { collisions } = this, known = Math.min(collisions, MOST_FLASHES);
    return Array.from({ length: known }, (_, k) => {
      const before = collisions - known + k, begin = FLASH_NUMBERS * (before % MOST_FLASHES);
      const [time, i, j, ...places] = this.flashes.subarray(begin, begin + FLASH_NUMBERS);
      return { time, step: before + 1, ...this.contact(i, j, places) };
    });
  }

  // Where balls i and j touch each other, or ball i the wall, m; and the radius of ball i.
  contact(i, j, [x, y, otherX, otherY]) {
    const { container } = this.scene, radius = this.radii[i], [width, height] = container.size;
    let across, along;
    if (j >= 0) {
      [across, along] = [otherX - x, otherY - y];
      if (repeatsAlong(0, container)) across -= width * Math.round(across / width);
      if (repeatsAlong(1, container)) along -= height * Math.round(along / height);
    } else {
      [across, along] = [x - otherX, y - otherY];
      if (container.shape !== "circle") {
        const isNearer = width / 2 - Math.abs(across) <= height / 2 - Math.abs(along);
        const isAcross = keepsDrift(container) ? repeatsAlong(1, container) : isNearer;
        [across, along] = isAcross ? [Math.sign(across), 0] : [0, Math.sign(along)];
      }
    }
    const length = Math.hypot(across, along) || 1;
    return { x: x + (radius * across) / length, y: y + (radius * along) / length, radius };
  }

  // Where a ball, or as number N the container, is at a time after the last collision, m.
  place(ball, time) {
    const [x, y] = this.simulation.positionOf(ball, time);
    return [x, y];
  }

  speed(ball) {
    const [u, v] = this.simulation.velocityOf(ball, this.time);
    return Math.hypot(u, v);
  }

  // Follows the path of a ball, [time, x, y, velocity after it] at its collisions, since a moment that is kept or else
  // since now; null follows none.
  tag(ball) {
    const { collisions, time } = this, { stop } = this.simulation;
    this.tagged = ball;
    this.course = null;
    if (ball === null) return;
    const begin = this.kept.find((moment) => moment.collisions >= collisions - PATH_BEGINS);
    const isBefore = begin?.collisions <= collisions;
    if (isBefore) this.restore(begin);
    this.beginPath();
    if (isBefore) {
      this.goTo(collisions);
      this.simulation.stop = stop;
      this.time = time;
    }
    this.followSlide();
  }

  // Adds where the tagged ball is while it slides: then its path is no line between its collisions.
  followSlide() {
    if (!this.course || !this.simulation.isCurved(this.tagged)) return;
    const { time, tagged, course } = this, from = Math.max(course[course.length - 1][0], this.simulation.time);
    if (time < from) return;
    const turn = ((time - from) * this.speed(tagged)) / (this.scene.container.size[0] / 2 - this.radii[tagged]);
    const parts = Math.max(1, Math.min(Math.ceil(turn / SMALL_TURN), MOST_PARTS));
    for (let part = 1; part <= parts; part++) {
      const at = part < parts ? from + (part / parts) * (time - from) : time;
      this.addToPath(at, this.place(tagged, at), this.simulation.velocityOf(tagged, at));
    }
  }

  // The mean speed of the balls now, m/s.
  meanSpeed() {
    return this.radii.reduce((sum, _, ball) => sum + this.speed(ball), 0) / this.number;
  }

  row() {
    const { meter } = this;
    return { ...meter.sums(), energy: meter.totalEnergy, temperature: meter.energy / this.number };
  }

  // All that has added up until now.
  get sums() {
    return this.meter.sums(Math.max(this.time, this.simulation.time));
  }

  // Counts time and collisions from now on, for a duration, s.
  startWatch(duration = Infinity) {
    const { sums } = this;
    this.watch = { from: sums, end: sums.time + duration, to: null };
  }

  stopWatch() {
    this.watch.to ??= { ...this.watched, isOver: true };
  }

  // What the stopwatch has counted, up until now or its end; null if it was not started.
  get watched() {
    if (!this.watch) return null;
    const { from, end, to } = this.watch, { time, wallEvents, pairEvents } = this.sums;
    return to ?? {
      isOver: time >= end, time: Math.min(time, end) - from.time,
      wallEvents: wallEvents - from.wallEvents, pairEvents: pairEvents - from.pairEvents,
    };
  }

  // Means, rates and the histogram of speeds begin again: at the start, when a slider was moved, when
  // the gas continues with other rules, and with the button for it.
  forgetMeans() {
    const { sums } = this;
    this.from = { ...sums, energy: this.meter.totalEnergy };
    this.counts = new Float64Array(BINS);
    this.sampled = 0;
    this.nextSample = this.collisions;
    this.sampleSpeeds();
  }

  // Adds the speeds over √(2T/m) to the histogram, once in a collision of each ball.
  sampleSpeeds() {
    this.nextSample = this.collisions + Math.max(1, this.number / 2);
    const twiceTemperature = (2 * this.meter.energy) / this.number;
    if (!(twiceTemperature > 0)) return;
    const { flights, time } = this.simulation;
    this.simulation.show(time);
    for (let ball = 0; ball < this.number; ball++) {
      const u = flights[4 * ball + BALL.U], v = flights[4 * ball + BALL.V];
      const reduced = Math.sqrt((this.scene.masses[ball] * (u * u + v * v)) / twiceTemperature);
      this.counts[binOf(reduced)]++;
    }
    this.sampled += this.number;
  }

  // The share of the counted speeds in each bin.
  get shares() {
    return Array.from(this.counts, (count) => (this.sampled ? count / this.sampled : 0));
  }

  // The share of the counted speeds above one, over √(2T/m), which is at the edge of a bin.
  shareAbove(speed) {
    const above = this.counts.slice(Math.round(speed / BIN)).reduce((sum, count) => sum + count, 0);
    return this.sampled ? above / this.sampled : 0;
  }

  // Means since they began, or null before the first collision.
  means() {
    const to = this.sums;
    return to.time > this.from.time ? this.meter.means(this.from, to) : null;
  }

  // Rows since the start, at most a number of them, the latest one last; also those that are still to
  // come, of a gas that went back.
  rows(most = 1000) {
    const rows = this.series.rows, step = Math.ceil(rows.length / most);
    const chosen = rows.filter((_, k) => k % step === 0), last = rows[rows.length - 1];
    if (last && chosen[chosen.length - 1] !== last) chosen.push(last);
    return chosen;
  }

  // k and α (1/s) of the energy since the means began, and the energy (J) and time (s) then; null if
  // the energy does not fall, or is known too shortly.
  decay() {
    const { time: from, energy } = this.from, rows = this.rows().filter(({ time }) => time >= from && time <= this.time);
    if (rows.length < 10 || !(energy > 0) || !FACTS.cooling(traitsOf(this.scene))) return null;
    const times = [0, ...rows.map(({ time }) => time - from)];
    const values = [1, ...rows.map((row) => row.energy / energy)];
    const k = decayRate(times, values, 0), alpha = decayRate(times, values, 2);
    return Number.isFinite(k) && Number.isFinite(alpha) ? { from, energy, k, alpha } : null;
  }

  // [number, hash] of the first 1,000, 10,000 … collisions, and at the end of all.
  get hashes() {
    const { hashes, hash } = this.simulation;
    if (!this.stop || hashes.some(([count]) => count === hash.count)) return hashes;
    return [...hashes, [hash.count, hash.digest()]];
  }

  // The config of the program that gives the same collisions, unless the gas has changed since its start.
  get program() {
    return configOfStart(this.config, this.start);
  }

  // Other laws of collision from now on.
  setLaws(config) {
    this.config = config;
    const { pairLaw, wallLaw, surface } = rulesOf(config);
    this.simulation.setLaws(pairLaw, wallLaw, surface);
    this.changed = true;
    this.forgetMeans();
    this.forgetMoments();
  }

  // Continues after an end: `on` after its time, or from a wall trap with a ball that slides.
  continueWith(way) {
    this.changed ||= way === "slide" || this.simulation.timeLimit < Infinity;
    this.simulation.continueWith(way === "slide" ? SLIDING : null);
    if (way === "slide") this.forgetMeans();
    this.forgetMoments();
  }

  // How a gas that ended can go on: not at all, `on`, with `slide`, or from its start with `tc`. After a
  // collapse the balls that touch have velocities that differ by roundings, and go on for ever.
  get continuation() {
    const { reason } = this.stop ?? {}, { container, containerMass, contactDuration, wallLaw, surface } = this.scene;
    if (reason === TIME || reason === NOTHING_LEFT) return "on";
    if ((reason !== WALL_TRAP && reason !== COLLAPSE) || contactDuration) return null;
    const fixed = container.shape === "circle" && !Number.isFinite(containerMass);
    const slides = fixed && !rubsWall(surface) && wallLaw.name === "constant" && wallLaw.cor <= 1 - 1e-6;
    return reason === WALL_TRAP && slides ? "slide" : "tc";
  }
}

// The balls of each radius and mass: [{ radius, mass, balls }], in the order of their first ones.
function speciesIn({ radii, masses }) {
  const species = new Map();
  radii.forEach((radius, ball) => {
    const mass = masses[ball], key = `${radius} ${mass}`;
    if (!species.has(key)) species.set(key, { radius, mass, balls: [] });
    species.get(key).balls.push(ball);
  });
  return [...species.values()];
}
