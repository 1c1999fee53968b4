"use strict";

// A point's config and the number of a repeat -> the scene at its start, as in
// placement/starting_scene.py, scene.py and digest and stream_seed of config/points.py.

const EPSILON = 2 ** -52, TINY = 2 ** -1022;
const LEAST_AMOUNT = 1e-50, MOST_AMOUNT = 1e50;
const MOST_BALLS = 200;
const TITLES = { circle: "circle", box: "box", periodic: "periodic box", channel: "channel" };
const SIDES = ["left", "right", "bottom", "top"];

/** A scene that cannot exist: one sentence, and the config key to change. */
class SceneError extends Error {
  constructor(key, problem, ball = null) {
    super(problem);
    Object.assign(this, { key, ball });
  }
}

/** The scene at the start of a repeat of a point. Throws ``SceneError``.
 *
 * config : all keys of the point, as ``to_json`` of config/points.py writes them
 */
function startingScene(config, repeat) {
  const groups = config.balls.rings === undefined && config.balls.list === undefined
    ? [config.balls].flat() : [];
  const species = groups.filter((group) => "count" in group);
  const placedBalls = config.balls.list ?? groups.filter((group) => "position" in group);
  const sizes = containerAndRadii(config, species);
  const scene = {
    container: sizes.container,
    containerMass: config.container.mass ?? Infinity,
    containerPosition: [0, 0],
    containerVelocity: config.container.velocity ?? [0, 0],
    rounding: config.start?.rounding ?? 0,
    ...collisionRules(config),
    wallKey: null,
  };
  const put = (places, velocities, radii, masses) => Object.assign(scene, {
    positions: Float64Array.from(places),
    velocities: Float64Array.from(velocities),
    radii: Float64Array.from(radii),
    masses: Float64Array.from(masses),
  });
  const radii = placedBalls.map((ball) => ball.radius);
  const masses = placedBalls.map((ball) => ball.mass);
  const places = placedBalls.flatMap((ball) => ball.position);
  const moving = placedBalls.flatMap((ball) => ball.velocity);
  const seed = () => streamSeed(config, groups);
  try {
    if (placedBalls.length) check(put(places, moving, radii, masses)); // before others come
    if (config.balls.rings !== undefined) {
      const { balls } = config, onRings = placesOnRings(balls, sizes.container.size[0] / 2);
      const number = onRings.length / 2;
      checkNumber(number);
      const directions = randomDirections(number, seed(), repeat);
      put(onRings, directions.map((part) => balls.speed * part),
        Array(number).fill(balls.radius), Array(number).fill(balls.mass));
    } else if (species.length) {
      const counts = species.map((kind) => kind.count);
      checkNumber(placedBalls.length + counts.reduce((sum, number) => sum + number, 0));
      const ofGas = species.flatMap((kind) => Array(kind.count).fill(kind.mass));
      const gasRadii = species.flatMap((kind, k) => Array(kind.count).fill(sizes.radii[k]));
      const positions = startingPlaces(config, species, sizes, places, radii, seed(), repeat);
      const velocities = [...moving, ...startingVelocities(species, seed(), repeat)];
      put(positions, velocities, [...radii, ...gasRadii], [...masses, ...ofGas]);
    }
    const axes = species.length ? { periodic: [0, 1], channel: [1] }[sizes.container.shape] ?? [] : [];
    const rotates = hasCommonRotation(config);
    if (axes.length || !rotates) {
      checkSpeeds(scene);
      const first = placedBalls.length, gasMasses = Array.from(scene.masses.subarray(first));
      if (!rotates && gasMasses.length === 1) { // after a slider
        const problem = "one ball has no common rotation; remove this key, or add balls";
        throw new SceneError("balls.common_rotation", problem);
      }
      const [velocities, positions] = [scene.velocities, scene.positions].map((pairs) => pairs.subarray(2 * first));
      setAtRest(velocities, gasMasses, positions, axes, !rotates);
    }
    const isRandom = lawsOfWall(scene.wallLaw).some(({ word }) => word === "thermal");
    if (isRandom) scene.wallKey = wallKey(seed(), repeat);
    check(scene);
    checkPage(config);
  } catch (error) {
    if (error instanceof SceneError && error.ball !== null && error.ball < placedBalls.length) {
      error.key = `${config.balls.list ? "balls.list" : "balls"}[${error.ball}]`;
    }
    throw error;
  }
  return scene;
}

/** Throw ``SceneError`` for what only the program can do. */
function checkPage(config) {
  if (!Number.isSafeInteger(config.seed)) {
    throw new SceneError("seed", `the live page has seeds up to ${Number.MAX_SAFE_INTEGER}; give a smaller one`);
  }
}

function checkNumber(number) {
  if (number > MOST_BALLS) {
    const shown = `the live page shows at most ${MOST_BALLS} balls`;
    throw new SceneError("balls", `${shown}, not ${grouped(number)}; give fewer`);
  }
}

/** The fields of a scene that decide what collisions do: its laws and ``collapse``. */
function collisionRules(config) {
  const collapse = config.collapse ?? "stop";
  const wallCor = config.wall_cor ?? config.cor;
  const at = (key, side) => (key !== null && typeof key === "object" ? key[side] : key) ?? null;
  const lawAt = (side) => {
    const speed = at(config.wall_speed, side), temperature = at(config.wall_temperature, side);
    if (temperature !== null) return { word: "thermal", temperature };
    if (speed) return { word: "driven", cor: wallCor, speed };
    return lawOfBalls(wallCor, config.wall_cor_speed);
  };
  const keys = [config.wall_speed, config.wall_temperature];
  const bySide = keys.some((key) => key !== null && typeof key === "object");
  const laws = SIDES.map((side) => [side, lawAt(side)]);
  return {
    pairLaw: lawOfBalls(config.cor, config.cor_speed),
    wallLaw: bySide ? { word: "sides", ...Object.fromEntries(laws) } : lawAt("left"),
    contactDuration: collapse.tc ?? 0,
    elasticBelow: collapse.elastic_below ?? 0,
    slides: collapse === "slide",
  };
}

function lawOfBalls(cor, corSpeed) {
  return corSpeed ? { word: "viscoelastic", cor, corSpeed } : { word: "constant", cor };
}

/** The laws of a wall: of its sides, if they differ. */
function lawsOfWall(law) {
  return law.word === "sides" ? SIDES.map((side) => law[side]) : [law];
}

// The seed of the random streams: a hash of the point's physics

const WHOLE = new Set(["rings", "count"]); // keys whose numbers Python writes without a point
const NOT_IN_STREAMS =
  ["title", "repeats", "sweep", "start", "collisions", "time", "seed", "common_random", "record"];
const LATER_KEYS = {
  collapse: "stop", cor_speed: null, wall_cor_speed: null, wall_speed: null, wall_temperature: null,
};

/** The seed of a point's random numbers, see ``stream_seed``; species are in ``groups``. */
function streamSeed(config, groups) {
  if (config.common_random) return BigInt(config.seed);
  const physics = { ...config, wall_cor: config.wall_cor ?? config.cor };
  for (const key of NOT_IN_STREAMS) delete physics[key];
  for (const [key, value] of Object.entries(LATER_KEYS)) {
    if (physics[key] === value) delete physics[key];
  }
  if (groups.length) {
    physics.balls = groups.map(({ start, common_rotation: _, ...others }) => others);
    physics.start = startOf(groups);
    if (!hasCommonRotation(config)) physics.common_rotation = false;
  }
  return BigInt(config.seed) | (BigInt(`0x${hashOfText(pythonJson(physics))}`) << 64n);
}

/** JSON with sorted keys and without spaces, its numbers as Python writes them. */
function pythonJson(value, key = "") {
  if (typeof value === "number") return WHOLE.has(key) ? String(value) : pythonFloat(value);
  if (value === null || typeof value !== "object") return JSON.stringify(value);
  if (Array.isArray(value)) return `[${value.map((item) => pythonJson(item)).join(",")}]`;
  const pairs = Object.keys(value).sort()
    .map((name) => `${JSON.stringify(name)}:${pythonJson(value[name], name)}`);
  return `{${pairs.join(",")}}`;
}

/** The shortest decimals of a double, as Python's ``repr``. */
function pythonFloat(value) {
  const [figures, power] = value.toExponential().split("e"), exponent = Number(power);
  if (value !== 0 && (exponent < -4 || exponent > 15)) {
    const size = String(Math.abs(exponent)).padStart(2, "0");
    return `${figures}e${exponent < 0 ? "-" : "+"}${size}`;
  }
  if (exponent < 0) {
    const digits = figures.replace(/[-.]/g, ""), sign = value < 0 ? "-" : "";
    return `${sign}0.${"0".repeat(-exponent - 1)}${digits}`;
  }
  return Number.isInteger(value) ? `${value}.0` : String(value);
}

// Sizes

function lengthsOf(container) {
  if ((container.shape ?? "circle") === "circle") {
    return container.radius == null ? null : [2 * container.radius, 2 * container.radius];
  }
  return container.width == null ? null : [container.width, container.height ?? container.width];
}

/** The packing fraction times width times height over the sum of squared radii. */
function packingFactor(shape) {
  return shape === "circle" ? 4 : Math.PI;
}

function packingFraction(container, squares) {
  const [width, height] = container.size;
  return packingFactor(container.shape) * squares / (width * height);
}

/** The packing of a scene. */
function packingOf({ container, radii }) {
  return packingFraction(container, pairwiseSum(radii.map((radius) => radius * radius)));
}

/** The container, and the radius of each species (m); one of them may follow from packing. */
function containerAndRadii(config, species) {
  const shape = config.container.shape ?? "circle", factor = packingFactor(shape);
  const packing = config.container.packing ?? config.balls.packing ?? null;
  let size = lengthsOf(config.container);
  let radii = species.map((kind) => kind.radius).filter((radius) => radius != null);
  if (size === null) {
    const squares = preciseSum(species.map((kind, k) => kind.count * radii[k] * radii[k]));
    // Of a circle of radius 1, or a square of side 1.
    const side = shape === "circle" ? 2 : 1;
    const length = Math.sqrt(factor * squares / (side * side) / packing);
    size = shape === "circle" ? [2 * length, 2 * length] : [length, length];
  }
  if (species.length && !radii.length) {
    const number = species.reduce((sum, kind) => sum + kind.count, 0);
    const radius = Math.sqrt(packing * size[0] * size[1] / (factor * number));
    radii = species.map(() => radius);
  }
  return { container: { shape, size }, radii };
}

function areaOf({ shape, size: [width, height] }) {
  const radius = width / 2;
  return shape === "circle" ? Math.PI * (radius * radius) : width * height;
}

function wallLengthOf({ shape, size: [width, height] }) {
  if (shape === "circle") return 2 * Math.PI * (width / 2);
  return { box: 2 * (width + height), periodic: 0, channel: 2 * height }[shape];
}

/** Mean path of a ball between collisions in a dilute gas, m; see ``Scene.mean_free_path``. */
function meanFreePath(scene) {
  const number = scene.radii.length, mean = pairwiseSum(scene.radii) / number;
  const between = number === 1 ? 0 : 2 * Math.sqrt(2) * number * 2 * mean;
  const obstacles = between + wallLengthOf(scene.container) / Math.PI;
  return obstacles ? areaOf(scene.container) / obstacles : Infinity;
}

// Sums

/** The correctly rounded sum, as ``math.fsum`` (Shewchuk, doi:10.1007/PL00009321). */
function preciseSum(values) {
  const partials = [];
  for (let x of values) {
    let kept = 0;
    for (let y of partials) {
      if (Math.abs(x) < Math.abs(y)) [x, y] = [y, x];
      const high = x + y, low = y - (high - x);
      if (low !== 0) partials[kept++] = low;
      x = high;
    }
    partials.length = kept;
    partials.push(x);
  }
  let n = partials.length, high = 0, low = 0;
  if (n === 0) return 0;
  high = partials[--n];
  while (n > 0) {
    const x = high, y = partials[--n];
    high = x + y;
    low = y - (high - x);
    if (low !== 0) break;
  }
  // Of two equally near doubles the even one, as seen from the next partial.
  if (n > 0 && ((low < 0 && partials[n - 1] < 0) || (low > 0 && partials[n - 1] > 0))) {
    const twice = 2 * low, x = high + twice;
    if (twice === x - high) high = x;
  }
  return high;
}

/** The sum in NumPy's order of additions. */
function pairwiseSum(values) {
  const number = values.length;
  if (number > 128) {
    const half = number / 2 - (number / 2) % 8 | 0;
    return pairwiseSum(values.slice(0, half)) + pairwiseSum(values.slice(half));
  }
  let sum = 0, k = 0;
  if (number >= 8) {
    const r = Array.from(values.slice(0, 8));
    for (k = 8; k + 8 <= number; k += 8) {
      for (let lane = 0; lane < 8; lane += 1) r[lane] += values[k + lane];
    }
    sum = ((r[0] + r[1]) + (r[2] + r[3])) + ((r[4] + r[5]) + (r[6] + r[7]));
  }
  for (; k < number; k += 1) sum += values[k];
  return sum;
}

const sumOfSquares = (values) => preciseSum(Array.from(values, (value) => value * value));

// Places and velocities of balls given by count

function startOf(groups) {
  return groups.find((group) => group.start)?.start ?? "lattice";
}

/** Places on a lattice or at random, x0, y0, x1 …, m; those of placed balls come first. */
function startingPlaces(config, species, sizes, places, placedRadii, seed, repeat) {
  const { container, radii } = sizes, counts = species.map((kind) => kind.count);
  const all = [...placedRadii, ...species.flatMap((kind, k) => Array(kind.count).fill(radii[k]))];
  const packing = packingFraction(container, sumOfSquares(all));
  checkRadii(container, all, ["periodic", "channel"]);
  const stream = new Stream(seed, repeat, PLACES), start = startOf(species);
  const placed = { places, radii: placedRadii };
  if (start === "random") {
    const result = randomPlaces(container, radii, counts, packing, stream, placed);
    if (result.jammed === undefined) return result.places;
    throw tooDense(config, container, species, radii, placedRadii.length, packing, result.jammed);
  }
  const largest = Math.max(...radii), total = counts.reduce((sum, number) => sum + number, 0);
  const { positions, diameter } = latticeAround(container, total, largest, placed);
  const scale = diameter / (2 * largest);
  if (scale < 1) {
    const reached = scale * scale * packing;
    throw tooDense(config, container, species, radii, placedRadii.length, packing, reached);
  }
  if (counts.length === 1) return [...places, ...positions];
  const order = shuffled(stream, total);
  return [...places, ...order.flatMap((k) => [positions[2 * k], positions[2 * k + 1]])];
}

/** Random velocities of all species, m/s: each has the energy of balls that have its speed. */
function startingVelocities(species, seed, repeat) {
  const number = species.reduce((sum, kind) => sum + kind.count, 0);
  const velocities = randomDirections(number, seed, repeat);
  const maxwell = species.some((kind) => kind.speeds === "maxwell");
  const normals = maxwell ? randomNormals(number, seed, repeat) : [];
  let first = 0;
  for (const kind of species) {
    const end = first + 2 * kind.count;
    const normal = normals.slice(first, end);
    const spread = Math.sqrt(sumOfSquares(normal) / kind.count);
    for (let k = first; k < end; k += 1) {
      if (kind.speeds === "maxwell") velocities[k] = normals[k] / spread;
      velocities[k] *= kind.speed;
    }
    first = end;
  }
  return velocities;
}

/** Whether random velocities keep their common rotation. */
function hasCommonRotation(config) {
  return [config.balls].flat().every((group) => group.common_rotation !== false);
}

/** Take the momentum along some axes, or the angular momentum, from velocities, in place.
 *
 * One factor restores the energy.
 */
function setAtRest(velocities, masses, positions, axes, turning) {
  const roots = masses.map(Math.sqrt), mass = preciseSum(masses);
  const energy = () => sumOfSquares(Array.from(velocities, (part, k) => roots[k >> 1] * part));
  const before = energy();
  for (const axis of axes) {
    const mean = preciseSum(masses.map((m, k) => m * velocities[2 * k + axis])) / mass;
    for (let k = axis; k < velocities.length; k += 2) velocities[k] -= mean;
  }
  if (turning) {
    const sum = (part) => preciseSum(masses.map((m, k) => m * part(2 * k, 2 * k + 1)));
    const momentum = sum((x, y) => positions[x] * velocities[y] - positions[y] * velocities[x]);
    const rate = momentum / sum((x, y) => positions[x] * positions[x] + positions[y] * positions[y]);
    for (let x = 0, y = 1; x < velocities.length; x += 2, y += 2) {
      velocities[x] += rate * positions[y];
      velocities[y] -= rate * positions[x];
    }
  }
  const left = energy();
  if (left > 0) {
    const factor = Math.sqrt(before / left);
    for (let k = 0; k < velocities.length; k += 1) velocities[k] *= factor;
  }
}

/** The error about balls that do not fit; a packing of ``reached`` would. */
function tooDense(config, container, species, radii, placed, packing, reached) {
  const number = species.reduce((sum, kind) => sum + kind.count, placed);
  const rounded = (Math.floor(reached * 1e4) / 1e4).toFixed(4);
  const problem =
    `${grouped(number)} balls with start: ${startOf(species)} in a ${TITLES[container.shape]} ` +
    `reach a packing of ${rounded}, not ${general(packing, 4)}`;
  for (const key of ["container", "balls"]) {
    if (config[key].packing != null) {
      return new SceneError(`${key}.packing`, `${problem}; lower it, or try another start`);
    }
  }
  const index = placed + radii.indexOf(Math.max(...radii));
  const key = Array.isArray(config.balls) ? `balls[${index}]` : "balls";
  const factor = (Math.floor(Math.sqrt(reached / packing) * 1e4) / 1e4).toFixed(4);
  const advice = `multiply radii by ${factor} or less, or try another start`;
  return new SceneError(`${key}.radius`, `${problem}; ${advice}`);
}

// Whether a scene can exist, see scene.py

/** Throw ``SceneError`` for balls that overlap, stick out, or are too large, slow or fast. */
function check(scene) {
  const { container, radii, masses } = scene, { size } = container;
  const sizes = [...radii, ...masses, ...size];
  if (!sizes.every((amount) => amount >= LEAST_AMOUNT && amount <= MOST_AMOUNT)) {
    const problem = "lengths that follow from packing are not from 1e-50 to 1e+50 m";
    throw new SceneError("balls", `${problem}; choose units in which they are nearer to 1`);
  }
  checkRadii(container, radii);
  checkPlaces(scene);
  checkSpeeds(scene);
  checkPairs(scene);
}

/** Throw ``SceneError`` for a ball that is too large wherever it is. */
function checkRadii(container, radii, shapes = Object.keys(TITLES)) {
  const { shape, size } = container, largest = radii.indexOf(Math.max(...radii));
  if (!shapes.includes(shape)) return;
  if (shape === "circle" && radii[largest] >= size[0] / 2) {
    const problem = `ball ${largest} of radius ${pythonFloat(radii[largest])} m cannot move`;
    const where = `in a circle of radius ${pythonFloat(size[0] / 2)} m`;
    throw new SceneError("balls", `${problem} ${where}; make it smaller`, largest);
  }
  const diameter = 2 * radii[largest];
  for (const [axis, key] of ["width", "height"].entries()) {
    if (repeatsAlong(axis, shape) && size[axis] < 5 * diameter * (1 + 1e-8)) {
      const problem = `the ${TITLES[shape]} is under 5 diameters of its balls`;
      const lengths = `${general(size[axis], 6)} m, with a diameter of ${general(diameter, 6)} m`;
      const reason = "this engine needs 5 cells each way, each a ball wide";
      const advice = "use smaller balls, more of them, or a larger box";
      throw new SceneError(`container.${key}`, `${problem} (${lengths}): ${reason}; ${advice}`);
    }
  }
}

/** The gap of a ball to the wall, m, and to the edge along the axes that repeat. */
function gapsOf(x, y, radius, { shape, size: [width, height] }) {
  const across = width / 2 - Math.abs(x), up = height / 2 - Math.abs(y);
  if (shape === "circle") return [width / 2 - radius - Math.sqrt(x * x + y * y), Infinity];
  if (shape === "box") return [Math.min(across, up) - radius, Infinity];
  if (shape === "channel") return [across - radius, up];
  return [Math.min(across, up), Math.min(across, up)];
}

/** How far balls may overlap or stick out, m: as a state of a simulation may, see scene.py. */
function placeRounding({ radii, container, rounding }) {
  const diameter = 2 * Math.max(...radii);
  const slack = 8 * EPSILON * (Math.max(...container.size) + diameter);
  return Math.max(slack + 1e-9 * 2 * Math.min(...radii), rounding);
}

function checkPlaces({ positions, radii, container, rounding }) {
  const { shape, size } = container, slack = placeRounding({ radii, container, rounding });
  const gaps = Array.from(radii, (radius, k) =>
    gapsOf(positions[2 * k], positions[2 * k + 1], radius, container));
  const least = gaps.map(([wall, edge]) => Math.min(wall, edge));
  const ball = least.indexOf(Math.min(...least)), gap = least[ball];
  if (gap >= -slack) return;
  const [x, y] = [positions[2 * ball], positions[2 * ball + 1]];
  const lengths = shape === "circle"
    ? `radius ${general(size[0] / 2, 6)} m`
    : `width ${general(size[0], 6)} m and height ${general(size[1], 6)} m`;
  const where =
    `[${general(x, 6)}, ${general(y, 6)}] m from the centre of a ${TITLES[shape]} of ${lengths}`;
  let problem = `ball ${ball} sticks out of the container by ${general(-gap, 6)} m`;
  if (gap === gaps[ball][1]) {
    problem = `the centre of ball ${ball} is ${general(-gap, 6)} m outside`;
  }
  const advice = `move it inwards${shape === "periodic" ? "" : " or make it smaller"}`;
  throw new SceneError("balls", `${problem}: it is ${where}; ${advice}`, ball);
}

/** Throw ``SceneError`` for balls too slow, fast, light or heavy to be computed with. */
function checkSpeeds({ velocities, radii, masses, container }) {
  const { shape, size } = container;
  let shortest = 2 * Math.min(...radii);
  if (shape === "circle") shortest = Math.min(shortest, size[0] / 2 - Math.max(...radii));
  shortest = Math.min(shortest, 1);
  const longest = Math.max(4 * Math.max(...size), 1);
  const speeds = Array.from(radii, (_, k) => Math.hypot(velocities[2 * k], velocities[2 * k + 1]));
  const wrong = speeds.findIndex((speed) =>
    (speed > 0 && (speed * shortest) ** 2 < TINY) || !Number.isFinite((speed * longest) ** 2));
  const energy = speeds.reduce((sum, speed, k) => sum + masses[k] * speed * speed, 0) / 2;
  const usable = energy >= TINY && energy < Infinity && wrong < 0;
  if (usable || speeds.every((speed) => speed === 0)) return;
  const ball = wrong >= 0 ? wrong : masses.indexOf(Math.max(...masses));
  const which =
    `ball ${ball} of ${general(masses[ball], 6)} kg at ${general(speeds[ball], 6)} m/s`;
  const problem = `${which} has squares of speed times distance, or an energy, that are no doubles`;
  const advice = "choose units in which speeds, distances and masses are nearer to 1";
  throw new SceneError("balls", `${problem}; ${advice}`, ball);
}

/** Throw ``SceneError`` for the two balls that overlap most. */
function checkPairs({ positions, radii, container, rounding }) {
  let deepest = -placeRounding({ radii, container, rounding }), first = -1, second = -1;
  for (let i = 0; i < radii.length; i += 1) {
    for (let j = i + 1; j < radii.length; j += 1) {
      const gap = distanceOf(positions, i, j, container) - radii[i] - radii[j];
      if (gap < deepest) [deepest, first, second] = [gap, i, j];
    }
  }
  if (first < 0) return;
  const apart = general(deepest + radii[first] + radii[second], 6);
  const problem = `balls ${first} and ${second} overlap by ${general(-deepest, 6)} m`;
  const advice = "move them apart, or use smaller balls or a larger container";
  const sentence = `${problem}: their centres are ${apart} m apart; ${advice}`;
  throw new SceneError("balls", sentence, second);
}

/** Distance of two balls' centres, m, to the nearest image. */
function distanceOf(positions, i, j, container) {
  const x = nearestOffset(positions[2 * i] - positions[2 * j], 0, container);
  const y = nearestOffset(positions[2 * i + 1] - positions[2 * j + 1], 1, container);
  return Math.sqrt(x * x + y * y);
}

/** An offset along an axis, m, to the nearest image if the container repeats along it. */
function nearestOffset(offset, axis, { shape, size }) {
  return repeatsAlong(axis, shape) ? offset - size[axis] * rint(offset / size[axis]) : offset;
}

/** Whether a container of a shape repeats along the axis: 0 is x, 1 is y. */
function repeatsAlong(axis, shape) {
  return shape === "periodic" || (shape === "channel" && axis === 1);
}

/** A number rounded to a whole one, of two equally near ones to the even one. */
function rint(value) {
  const size = Math.abs(value);
  const whole = size < 4503599627370496 ? (size + 4503599627370496) - 4503599627370496 : size;
  return value < 0 ? -whole : whole;
}
