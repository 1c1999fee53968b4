// What is measured of a simulation: series over time, means, decay constants and their errors.
// As analysis/measurement.py and fitting.py, but without a page: workers and tests use it, too.

const RELAXING = 15, LEAST_RELAXING = 5; // collisions of a ball while equal speeds relax
const INSTANT = 1e-9; // collisions nearer than this share of the time are at one instant
const MOST_STEPS = 100; // of the search for a decay constant

// Ball-ball collisions in which a gas relaxes; none for one ball.
const relaxing = (number, ofABall = RELAXING) => (number > 1 ? Math.ceil((ofABall * number) / 2) : 0);

// Follows a simulation, event by event: its energies and what has added up since the start.
class Meter {
  constructor(scene, simulation) {
    this.scene = scene;
    this.simulation = simulation;
    this.number = scene.radii.length;
    this.time = simulation.time;
    this.energyTime = 0; // J s, the integral of the balls' energy
    this.wallImpulse = this.pairVirial = this.wallEvents = this.pairEvents = 0;
    this.energy = simulation.kineticEnergy(); // of the balls without their spins, J
    this.totalEnergy = this.energy + simulation.spinEnergy() + simulation.containerEnergy();
  }

  // To be called for each event of a call of the simulation's ``advance``.
  follow(row) {
    const { eventTime, eventJ, eventSums } = this.simulation, begin = FOLLOWED.FOLLOWED_SUMS * row;
    this.energyTime += this.energy * (eventTime(row) - this.time);
    this.time = eventTime(row);
    if (eventJ(row) < 0) this.wallEvents++;
    else this.pairEvents++;
    this.energy = eventSums[begin + FOLLOWED.ENERGY];
    this.totalEnergy = this.energy + eventSums[begin + FOLLOWED.SPIN_ENERGY] + eventSums[begin + FOLLOWED.CONTAINER_ENERGY];
    this.wallImpulse = eventSums[begin + FOLLOWED.WALL_IMPULSE];
    this.pairVirial = eventSums[begin + FOLLOWED.PAIR_VIRIAL];
  }

  // All that adds up, at a time (s) before the next event.
  sums(time = this.time) {
    const { wallImpulse, pairVirial, wallEvents, pairEvents } = this;
    const energyTime = this.energyTime + this.energy * (time - this.time);
    return { time, energyTime, wallImpulse, pairVirial, wallEvents, pairEvents };
  }

  means(from, to) {
    return windowMeans(this.scene, from, to);
  }
}

// Means between two sums of a meter: T (J), pressures at the wall and by the virial (Pa m), rates (1/s).
function windowMeans({ radii, container }, from, to) {
  const length = to.time - from.time, energy = (to.energyTime - from.energyTime) / length;
  const area = areaOf(container), wall = (to.wallImpulse - from.wallImpulse) / (wallLengthOf(container) * length);
  const virial = (energy + (to.pairVirial - from.pairVirial) / (2 * length)) / area;
  const temperature = energy / radii.length, pressure = hasWalls(container) ? wall : virial;
  return {
    temperature, wall, virial, pressure, length, ideal: energy / area, ratio: (pressure * area) / energy,
    wallRate: (to.wallEvents - from.wallEvents) / length, pairRate: (to.pairEvents - from.pairEvents) / length,
  };
}

// Rows of numbers over time. When there are too many, every second one is left out.
class Series {
  constructor(most = 2000) {
    this.most = most;
    this.rows = [];
    this.stride = 1;
    this.skipped = 0;
  }

  // row: a function, which is called only if the row is kept
  add(row) {
    if (++this.skipped < this.stride) return;
    this.skipped = 0;
    this.rows.push(row());
    if (this.rows.length < this.most) return;
    this.rows = this.rows.filter((_, k) => k % 2 === 0);
    this.stride *= 2;
  }

  // Keeps each row again, besides those that it has.
  beginAnew() {
    this.most += this.rows.length;
    this.stride = 1;
    this.skipped = 0;
  }
}

// The rate q (1/s) of y = exp(−qt), power 0, or y = 1/(1 + qt)^power, by least squares; nan if there
// is none. times: s, from 0 on; values: over the first.
function decayRate(times, values, power) {
  const span = times[times.length - 1];
  if (!(times.length > 2 && span > 0)) return NaN;
  const rate = (p) => (power ? Math.expm1(p) : p); // p can have any value
  const step = (p) => {
    let squares = 0, along = 0, square = 0;
    const q = rate(p), growth = power ? Math.exp(p) : 1;
    for (let k = 0; k < times.length; k++) {
      const s = times[k] / span, base = power ? 1 / (1 + q * s) : Math.exp(-q * s);
      const shape = power === 2 ? base * base : base;
      const slope = power ? -power * shape * base * s * growth : -shape * s;
      squares += (shape - values[k]) ** 2;
      along += slope * (shape - values[k]);
      square += slope * slope;
    }
    return [squares, -along / square];
  };
  const last = Math.max(values[values.length - 1], 1e-6);
  let p = power ? Math.log(Math.max(last ** (-1 / power), 1e-9)) : -Math.log(last);
  let [squares, move] = step(p);
  for (let turn = 0; turn < MOST_STEPS && Math.abs(move) > 1e-12 * Math.max(1, Math.abs(p)); turn++) {
    const [tried, next] = step(p + move);
    if (tried <= squares * (1 + 1e-14)) [p, squares, move] = [p + move, tried, next];
    else move /= 4;
  }
  return Number.isFinite(move) ? rate(p) / span : NaN;
}

const measureRepeat = (config, repeat, own = null) => measureScene(startingScene(config, repeat, own), config);

// Simulates a scene up to its limits of collisions and time, and measures it, as `snooker fit` and
// `compare` do: k and α of the energy of balls and container, and the sums of T, P and PV/NT for `meansOf`.
function measureScene(scene, { collisions, time }) {
  const simulation = new Simulation(scene, { collisions, time });
  const meter = new Meter(scene, simulation);
  const times = [0], energies = [meter.totalEnergy], sums = [meter.sums()];
  let stop = null;
  while (!stop) {
    stop = simulation.advance(Infinity);
    for (let row = 0; row < simulation.eventCount; row++) {
      meter.follow(row);
      const last = times.length - 1, again = last > 0 && meter.time - times[last] <= INSTANT * meter.time;
      if (again) [energies[last], sums[last]] = [meter.totalEnergy, meter.sums()];
      else {
        times.push(meter.time);
        energies.push(meter.totalEnergy);
        sums.push(meter.sums());
      }
    }
  }
  const end = stop.time, collapses = stop.reason === COLLAPSE && times.length > 1;
  const decay = energies.map((energy) => energy / energies[0]), traits = traitsOf(scene), cools = FACTS.cooling(traits);
  const rows = collapses ? sums.slice(0, -1) : sums; // without its collisions, which are all at the end
  const whole = { ...rows[rows.length - 1], time: end };
  if (!collapses) whole.energyTime += meter.energy * (end - meter.time);
  return {
    whole,
    pairs: simulation.pairEvents,
    starts: FACTS.warm_walls(traits) ? [rows.findLast((row) => row.time <= end / 2)] : relaxedRows(rows, scene.radii.length),
    k: cools ? decayRate(times, decay, 0) : NaN,
    alpha: cools ? decayRate(times, decay, 2) : NaN,
    early: [WALL_TRAP, COLLAPSE].includes(stop.reason),
    complete: [COLLISIONS, TIME, NOTHING_LEFT].includes(stop.reason),
  };
}

// The rows in which the relaxation may end: after the fewest ball-ball collisions, after one more …
function relaxedRows(rows, number) {
  const least = relaxing(number, LEAST_RELAXING), found = [];
  let row = 0;
  for (let skipped = least; skipped <= relaxing(number); skipped++) {
    while (row < rows.length && rows[row].pairEvents < skipped) row++;
    if (row === rows.length) break;
    found.push(rows[row]);
  }
  return found;
}

// The ball-ball collisions that all repeats of a scene skip, as `relaxation` of the program has it: 15 of
// each ball, at most half of the mean over the complete repeats, or over all if none is; null if too few.
function relaxation(number, results) {
  const complete = results.filter((result) => result.complete), counted = complete.length ? complete : results;
  const pairs = counted.reduce((sum, result) => sum + result.pairs, 0) / counted.length;
  const skipped = Math.min(relaxing(number), Math.floor(pairs / 2));
  return skipped >= relaxing(number, LEAST_RELAXING) ? skipped : null;
}

// T, P and PV/NT of a repeat: after the relaxation, or in a gas that walls keep warm in the second half
// of its time; nan if it is too short. One that ended early needs 5 more collisions of each ball.
function meansOf(scene, skipped, { whole, starts, complete }) {
  const number = scene.radii.length, least = relaxing(number, LEAST_RELAXING), none = {};
  if (FACTS.warm_walls(traitsOf(scene))) return windowMeans(scene, starts[0], whole);
  if (skipped === null || whole.pairEvents < skipped + (complete ? 0 : least)) return none;
  const from = starts[skipped - least];
  return from.time < whole.time ? windowMeans(scene, from, whole) : none;
}

// The mean of the numbers among values, and its standard error; nan without them.
function meanAndError(values) {
  const known = values.filter(Number.isFinite), n = known.length;
  const mean = known.reduce((sum, value) => sum + value, 0) / n;
  const squares = known.reduce((sum, value) => sum + (value - mean) ** 2, 0);
  return [mean, Math.sqrt(squares / (n - 1) / n)];
}

const MEASURED = ["temperature", "pressure", "ratio", "k", "alpha"];

const finite = (value) => (Number.isFinite(value) ? value : null);

// A row of the table: means and standard errors over the repeats of a config, and its first scene.
function tableRow(config, results, scene = startingScene(config, 0)) {
  const [width] = scene.container.size, number = scene.radii.length;
  const skipped = relaxation(number, results);
  const law = hasWalls(scene.container) ? scene.wallLaw : {}; // one with a temperature has no CoR
  const traits = traitsOf(scene);
  const row = {
    title: config.title ?? null, starts: results.length, early: results.filter(({ early }) => early).length,
    short: !FACTS.warm_walls(traits) && skipped === null ? 2 * relaxing(number, LEAST_RELAXING) : 0,
    N: number, r: scene.radii[scene.radii.length - 1], mass: scene.masses[scene.radii.length - 1],
    R: scene.container.shape === "circle" ? width / 2 : null, width: scene.container.shape === "circle" ? null : width,
    cor: config.cor, wallCor: law.cor ?? null, container: scene.container,
    packing: packingOf(scene), seed: config.seed,
    wallTemperature: law.temperature ?? null, wallSpeed: law.speed ?? null,
    ...Object.fromEntries(Object.keys(SURFACE_NAMES).map((key) => [`surface_${key}`, finite(scene.surface?.[key])])),
    ...Object.fromEntries(SIDES.flatMap((side) => [
      [`${side}Temperature`, law[side]?.temperature ?? null], [`${side}Speed`, law[side]?.speed ?? null],
    ])),
    containerMass: scene.containerMass, drift: driftEnergy(scene), traits,
  };
  const values = results.map((result) => ({ ...result, ...meansOf(scene, skipped, result) }));
  for (const name of MEASURED) {
    [row[name], row[`${name}Error`]] = meanAndError(values.map((result) => result[name] ?? NaN));
  }
  row.startEnergy = kineticEnergyOf(scene) / number;
  return row;
}

// The energy of the centre of mass, J, if there are no walls: then it moves on for ever.
function driftEnergy(scene) {
  return hasWalls(scene.container) || scene.masses.length === 1 ? 0 : centreEnergy(scene);
}

function centreEnergy({ velocities, masses }) {
  let mass = 0, across = 0, along = 0;
  masses.forEach((m, i) => {
    mass += m;
    across += m * velocities[2 * i];
    along += m * velocities[2 * i + 1];
  });
  return (across ** 2 + along ** 2) / (2 * mass);
}

// The energy of the balls' motion, J.
const kineticEnergyOf = ({ velocities: v, masses }) =>
  masses.reduce((sum, m, i) => sum + (m * (v[2 * i] ** 2 + v[2 * i + 1] ** 2)) / 2, 0);
