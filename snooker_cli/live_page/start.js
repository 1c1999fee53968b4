// The start of a repeat: places and velocities of the page's own, the same in every browser. Only
// + − × ÷ √ and whole numbers are used. The first start of the config that a page is made from is that
// of the program, which the page has.

const isSmall = typeof matchMedia === "function" && matchMedia("(max-width: 44rem)").matches;
const MOST_BALLS = isSmall ? 1000 : 2000; // on a phone, or else
const DIRECTIONS = 0, STIRRING = 1, WALL = 2, SPIN = 3; // random numbers of a repeat, by their purpose
const STIRRED = 20; // collisions of a ball, after which places are random

/** Random numbers: xoshiro128++ (Blackman & Vigna, doi:10.1145/3460772), begun by SplitMix's mixing. */
class Random {
  constructor(...seeds) {
    let state = 0;
    const mixed = (more) => {
      state = (state + 0x9e3779b9 + more) | 0;
      let word = state ^ (state >>> 16);
      word = Math.imul(word, 0x21f0aaad);
      word = Math.imul(word ^ (word >>> 15), 0x735a2d97);
      state ^= word;
      return word ^ (word >>> 15);
    };
    for (const seed of seeds) for (const part of [seed, Math.floor(seed / 2 ** 32)]) mixed(part | 0);
    this.words = Int32Array.from([1, 2, 3, 4], mixed);
  }

  /** The next 32 bits, as a whole number from 0. */
  next() {
    const { words: w } = this, turned = (value, by) => (value << by) | (value >>> (32 - by));
    const result = (turned((w[0] + w[3]) | 0, 7) + w[0]) | 0, shifted = w[1] << 9;
    w[2] ^= w[0];
    w[3] ^= w[1];
    w[1] ^= w[2];
    w[0] ^= w[3];
    w[2] ^= shifted;
    w[3] = turned(w[3], 11);
    return result >>> 0;
  }

  /** A whole number from 0 to below 2^53. */
  whole() {
    return (this.next() >>> 5) * 2 ** 26 + (this.next() >>> 6);
  }

  /** A point [x, y] of the unit disk, and its squared distance, above zero. */
  pointInDisk() {
    for (;;) {
      const [x, y] = [0, 1].map(() => this.whole() / 2 ** 52 - 1), square = x * x + y * y;
      if (square > 2 ** -20 && square <= 1) return [x, y, square];
    }
  }

  /** A random unit vector, or two normal deviates of variance 1 (Marsaglia, doi:10.1137/1006063). */
  pair(isNormal) {
    const [x, y, square] = this.pointInDisk();
    const factor = Math.sqrt((isNormal ? -2 * logarithm(square) : 1) / square);
    return [x * factor, y * factor];
  }
}

/** Natural logarithm of a number from 2^-20 to 1. */
function logarithm(value) {
  let halvings = 0;
  for (; value < Math.SQRT1_2; halvings += 1) value *= 2;
  const z = (value - 1) / (value + 1);
  let series = 0;
  for (let odd = 23; odd > 0; odd -= 2) series = series * z * z + 1 / odd;
  return 2 * z * series - halvings * Math.LN2;
}

/** Cosine and sine of an angle up to 2 pi. */
function cosineAndSine(angle) {
  const parts = [0, 0];
  for (let order = 40; order >= 0; order -= 1) {
    // Horner's scheme of both Taylor series: each takes a turn.
    parts[order % 2] = 1 - (parts[order % 2] * angle * angle) / ((order + 1) * (order + 2));
  }
  return [parts[0], angle * parts[1]];
}

/** The scene at the start of a repeat of a config. Throws ``SceneError``.
 *
 * config : all keys, as ``to_json`` of config/points.py writes them
 * own : the program's start of a config, which is used for the first repeat if it fits; see ``ownStart``
 */
function startingScene(config, repeat, own = null) {
  const { placed, gas } = groupsOf(config), same = own !== null && repeat === 0 && hasStartOf(config, own.config);
  const { container, radii } = same ? own : containerAndRadii(config, gas);
  const of = (key) => placed.map((ball) => ball[key]), rules = rulesOf(config);
  const isThermal = lawsOfWall(rules.wallLaw).some(({ name }) => name === "thermal");
  // Whether the config itself gives this start in the program: also with common_random, but not a new key.
  const isGiven = same && (config.common_random || physicsOf(config) === physicsOf(own.config))
    && isThermal === (own.wallKey !== null);
  const scene = {
    container,
    containerMass: config.container.mass ?? Infinity,
    containerPosition: [0, 0],
    containerVelocity: config.container.velocity ?? [0, 0],
    rounding: config.start?.rounding ?? 0,
    ...rules,
    radii: Float64Array.from(same ? radii : [...of("radius"), ...radii]),
    masses: Float64Array.from([...of("mass"), ...gas.flatMap((group) => Array(countOf(group)).fill(group.mass))]),
    wallKey: null,
    isGiven,
  };
  const number = scene.radii.length, random = (purpose) => new Random(config.seed, repeat, purpose);
  if (number > MOST_BALLS) {
    const most = grouped(MOST_BALLS);
    throw new SceneError(phrase`the live page shows at most ${most} balls, not ${grouped(number)}: take fewer`);
  }
  if (isThermal) scene.wallKey = isGiven ? own.wallKey : BigInt(random(WALL).whole());
  if (same) {
    Object.assign(scene, { positions: own.positions.slice(), velocities: own.velocities.slice() });
  } else {
    scene.positions = Float64Array.from(of("position").flat());
    scene.velocities = Float64Array.from(of("velocity").flat());
    if (placed.length) check(subset(scene, placed.length)); // before others come
    if (gas.length) addGas(scene, gas, placed.length, random);
  }
  if (scene.surface) scene.spins = same && own.spins.length ? own.spins.slice() : spinsOf(scene, placed, gas, random(SPIN));
  check(scene);
  return scene;
}

/** The first balls of a scene. */
const subset = (scene, number) => ({ ...scene, radii: scene.radii.slice(0, number), masses: scene.masses.slice(0, number) });

/** Whether a config has the same balls in the same container as another, whatever its laws. */
function hasStartOf(config, other) {
  const [text, known] = [config, other].map(({ container, balls, seed }) =>
    JSON.stringify([{ ...container, mass: null, velocity: null }, balls, seed]));
  return text === known;
}

/** What decides a start of the program, as a text: all keys but those that only end or store a repeat. */
const physicsOf = (config) => JSON.stringify({ ...config, collisions: 0, time: 0, record: 0, title: 0 });

/** Give places and velocities to the balls that are given by a number, after the first ones. */
function addGas(scene, gas, first, random) {
  const radii = scene.radii.slice(first), { container } = scene, [group] = gas;
  checkRadii(container, Math.max(...radii));
  const places = "rings" in group ? placesOnRings(group, container) : placesOnLattices(gas, radii, scene, first);
  const drawn = velocitiesOf(gas, random(DIRECTIONS));
  scene.positions = Float64Array.from([...scene.positions, ...places.flat()]);
  if (gas.some(({ start }) => start === "random")) stir(scene, first, random(STIRRING));
  setAtRest(scene, drawn, first, gas.every(({ common_rotation: keeps }) => keeps !== false));
  scene.velocities = Float64Array.from([...scene.velocities, ...drawn.flat()]);
}

// Places

/** Places [x, y] on rings, m. */
function placesOnRings({ rings, radius, ring_extent: part }, { size: [width] }) {
  const extent = (part * width) / 2, largest = Math.min(extent / Math.max(rings, 1) / 2, width / 2 - extent);
  if (rings > 0 && radius > largest * (1 + 1e-12)) {
    const helps = ["rings", "radius", "container"];
    throw new SceneError(phrase`with “rings” ${rings}, the radius can be at most ${general(largest, 4)} m`, helps);
  }
  const places = [[0, 0]];
  for (let ring = 1; ring <= rings; ring += 1) {
    for (let k = 0; k < 6 * ring; k += 1) {
      places.push(cosineAndSine((k * 2 * Math.PI) / (6 * ring)).map((value) => (ring / rings) * extent * value));
    }
  }
  return places;
}

/** Places [x, y] of all groups on hexagonal lattices, m: each around larger balls, and around the first ones. */
function placesOnLattices(gas, radii, { container, positions, radii: all }, first) {
  const taken = Array.from({ length: first }, (_, k) => [positions[2 * k], positions[2 * k + 1], all[k]]);
  const begins = gas.map((_, k) => sum(gas.slice(0, k).map(countOf))), places = Array(radii.length);
  const bySize = gas.map((_, k) => k).sort((a, b) => radii[begins[b]] - radii[begins[a]] || a - b);
  for (const k of bySize) {
    lattice(container, radii[begins[k]], countOf(gas[k]), taken).forEach((place, row) => {
      places[begins[k] + row] = place;
      taken.push([...place, radii[begins[k]]]);
    });
  }
  return places;
}

/** Places [x, y] of a hexagonal lattice over the whole container, m, around balls [x, y, radius]. */
function lattice(container, radius, number, taken) {
  const isFree = ([x, y]) => taken.every(([otherX, otherY, other]) =>
    squareOf(x - otherX, y - otherY, container) >= (radius + other) ** 2);
  let tried = 0, diameter = Infinity, free = [];
  while (free.length < number && diameter >= 2 * radius) {
    tried += number - free.length;
    const all = container.shape === "circle" ? latticeInCircle(container, tried) : latticeInBox(container, tried);
    ({ diameter } = all);
    free = all.places.filter(isFree);
  }
  if (diameter < 2 * radius) {
    const factor = general(Math.floor((1e4 * diameter) / (2 * radius)) / 1e4, 4);
    const helps = ["count", "radius", "container"];
    throw new SceneError(phrase`${grouped(number)} balls fit only with radii of at most ${factor} of these`, helps);
  }
  return Array.from({ length: number }, (_, k) => free[Math.floor((k * free.length) / number)]);
}

/** The lattice places nearest to the centre, which is a place or lies between two or three. */
function latticeInCircle({ size: [width] }, number) {
  const reach = Math.floor(0.607 * Math.sqrt(number)) + 2;
  let best = { diameter: 0 };
  for (const [restU, restV] of [[0, 0], [3, 0], [2, 2]]) { // in sixths of the spacing
    const all = [];
    for (let row = -reach; row <= reach; row += 1) {
      for (let column = -reach; column <= reach; column += 1) {
        const u = 6 * column + restU, v = 6 * row + restV;
        all.push({ u, v, square: u * u + u * v + v * v });
      }
    }
    const nearest = all.sort((a, b) => a.square - b.square).slice(0, number);
    const diameter = ((1 - 8 * EPSILON) * width) / 2 / (Math.sqrt(nearest[number - 1].square) / 6 + 0.5);
    if (diameter <= best.diameter) continue;
    const places = nearest.map(({ u, v }) => [((u + v / 2) * diameter) / 6, (v * (Math.sqrt(3) / 2) * diameter) / 6]);
    best = { places, diameter };
  }
  return best;
}

/** Rows along x, every other one shifted by half a spacing: those with the largest diameter. */
function latticeInBox(container, number) {
  const [[width, height], repeats] = [container.size, [0, 1].map((axis) => repeatsAlong(axis, container))];
  const most = 2 * Math.ceil(Math.sqrt((1.2 * number * height) / width)) + 2;
  let best = { diameter: 0 };
  for (let rows = repeats[1] ? 2 : 1; rows <= Math.min(most, 2 * number); rows += repeats[1] ? 2 : 1) {
    const columns = Math.ceil(number / rows), shift = rows > 1 ? 0.5 : 0;
    const spacings = (d) => [
      repeats[0] ? width / columns : (width - d) / (columns - 1 + shift || Infinity),
      repeats[1] ? height / rows : (height - d) / (rows - 1 || Infinity),
    ];
    const fits = (d) => {
      const [across, up] = spacings(d);
      return (columns === 1 || across >= d) && (rows < 3 || 2 * up >= d) && (rows === 1 || across * across / 4 + up * up >= d * d);
    };
    let [low, high] = [0, Math.min(width, height)];
    for (let step = 0; step < 60; step += 1) [low, high] = fits((low + high) / 2) ? [(low + high) / 2, high] : [low, (low + high) / 2];
    if (low > best.diameter) best = { diameter: low, rows, columns, shift, spacings: spacings(low) };
  }
  const { rows, columns, shift, diameter, spacings: [across, up] } = best;
  const middle = (columns - 1 + shift) / 2;
  const places = Array.from({ length: rows * columns }, (_, k) => {
    const row = Math.floor(k / columns);
    return [((k % columns) + shift * (row % 2) - middle) * across, (row - (rows - 1) / 2) * up];
  });
  return { places, diameter: (1 - 8 * EPSILON) * diameter };
}

/** Let elastic balls collide among the first ones, which stay: places are then random. */
function stir(scene, first, random) {
  const { radii, masses } = scene, number = radii.length, heavy = 1e30 * Math.max(...masses);
  const elastic = { name: "constant", cor: 1 };
  const velocities = Float64Array.from(Array.from({ length: number }, (_, k) => (k < first ? [0, 0] : random.pair(false))).flat());
  const moving = {
    ...scene, velocities, pairLaw: elastic, wallLaw: elastic, surface: null, containerMass: Infinity, slides: false,
    contactDuration: 0, elasticBelow: 0, masses: masses.map((mass, k) => (k < first ? heavy : mass)),
  };
  const collisions = (STIRRED * number) / 2, simulation = new Simulation(moving, { collisions });
  for (let calls = 0; calls < collisions && simulation.stop === null; calls += 1) simulation.advance(collisions);
  for (let k = first; k < number; k += 1) scene.positions.set(simulation.positionOf(k, simulation.time), 2 * k);
}

// Velocities

/** Random velocities [u, v] of all groups, m/s: each has the energy of balls that have its speed. */
function velocitiesOf(gas, random) {
  return gas.flatMap((group) => {
    const number = countOf(group), isNormal = group.speeds === "maxwell";
    const drawn = Array.from({ length: number }, () => random.pair(isNormal));
    const spread = isNormal ? Math.sqrt(sum(drawn.flat().map((part) => part * part)) / number) : 1;
    return drawn.map((pair) => pair.map((part) => (part / spread) * group.speed));
  });
}

/** Spins of rough balls, rad/s: a number of all, or normal ones with the energy T/2 on average. */
function spinsOf({ surface, radii, masses }, placed, gas, random) {
  const groups = [...placed, ...gas.flatMap((group) => Array(countOf(group)).fill(group))];
  return Float64Array.from(groups, ({ spin = null }, k) => {
    if (spin?.temperature === undefined) return spin ?? 0;
    return random.pair(true)[0] * Math.sqrt(spin.temperature / (surface.inertia * masses[k] * radii[k] ** 2));
  });
}

/** Take the momentum along axes that repeat, or a rotation that is not to stay, from new velocities.
 *
 * One factor restores the energy.
 */
function setAtRest({ container, masses, positions }, drawn, first, keepsRotation) {
  const weights = drawn.map((_, k) => masses[first + k]), weighted = (part) => sum(weights.map((m, k) => m * part(k)));
  const energy = () => weighted((k) => drawn[k][0] ** 2 + drawn[k][1] ** 2), before = energy();
  const axes = [0, 1].filter((axis) => repeatsAlong(axis, container));
  if (!axes.length && keepsRotation) return;
  if (!keepsRotation && drawn.length === 1) {
    throw new SceneError(phrase`one ball has no common rotation, which this scene starts without: take more balls`);
  }
  for (const axis of axes) {
    const mean = weighted((k) => drawn[k][axis]) / sum(weights);
    for (const pair of drawn) pair[axis] -= mean;
  }
  if (!keepsRotation) {
    const x = (k) => positions[2 * (first + k)], y = (k) => positions[2 * (first + k) + 1];
    const rate = weighted((k) => x(k) * drawn[k][1] - y(k) * drawn[k][0]) / weighted((k) => x(k) ** 2 + y(k) ** 2);
    drawn.forEach((pair, k) => {
      pair[0] += rate * y(k);
      pair[1] -= rate * x(k);
    });
  }
  const factor = Math.sqrt(before / energy());
  if (Number.isFinite(factor)) for (const pair of drawn) pair.forEach((part, axis) => { pair[axis] = part * factor; });
}

// The program's start, and starts as configs

/** The start that a page has of its config. */
function ownStart({ number, size, rows, key }, config) {
  const [positions, velocities, radii, carried] = unpacked(number, rows, 2, 2, 1);
  const container = { shape: config.container.shape ?? "circle", size };
  return { config, container, positions, velocities, radii, ...carried, wallKey: wallKeyOf(key) };
}

/** A config of the program with the start of a scene: the given one, if it has this start. */
function configOfStart(config, scene) {
  const isListed = !groupsOf(config).gas.length && scene.wallKey === null && (config.wall_key ?? null) === null;
  if (scene.isGiven || isListed) return config;
  const { container: { shape, size: [width, height] }, positions, velocities, spins, radii, masses, wallKey } = scene;
  const { mass = null, velocity = null } = config.container, size = shape === "circle" ? { radius: width / 2 } : { width, height };
  const list = Array.from(radii, (radius, k) => ({
    position: Array.from(positions.subarray(2 * k, 2 * k + 2)), velocity: Array.from(velocities.subarray(2 * k, 2 * k + 2)), radius,
    ...(masses[k] === 1 ? {} : { mass: masses[k] }),
    ...(spins?.[k] ? { spin: spins[k] } : {}),
  }));
  const key = { wall_key: wallKey === null ? null : Number(wallKey) };
  return { ...config, container: { shape, ...size, mass, velocity }, balls: { list }, common_random: false, ...key };
}
