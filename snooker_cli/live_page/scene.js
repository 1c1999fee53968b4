// What a config says without chance: laws, sizes, and whether a scene can exist. Its limits are those of
// the program, see scene.py, so that a config of the page is one of the program.

const EPSILON = 2 ** -52, TINY = 2 ** -1022;
const LEAST_AMOUNT = 1e-50, MOST_AMOUNT = 1e50;
const DIAMETERS = 5 * (1 + 1e-8); // of its balls, that a container which repeats needs each way
const SIDES = ["left", "right", "bottom", "top"];
const SIDE_NAMES = { left: phrase`left`, right: phrase`right`, bottom: phrase`bottom`, top: phrase`top` };

/** A scene that cannot exist, and why.
 *
 * helps : keys of balls that can be lower; "container" for a larger one
 */
class SceneError extends Error {
  constructor(message, helps = []) {
    super(message);
    this.helps = helps;
  }
}

/** The groups of balls of a config: single balls, and those given by a number or on rings. */
function groupsOf({ balls }) {
  const groups = balls.list ?? [balls].flat();
  const isPlaced = (group) => "position" in group;
  return { placed: groups.filter(isPlaced), gas: groups.filter((group) => !isPlaced(group)) };
}

// Laws of collision

/** What collisions do in a scene of a config, as ``collision_rules`` of config/models.py. */
function rulesOf(config) {
  const { cor, wall_cor_speed: corSpeed, wall_speed: speed, wall_temperature: temperature } = config;
  const collapse = config.collapse ?? "stop", isBySide = (value) => value !== null && typeof value === "object";
  const at = (value, side) => (isBySide(value) ? value[side] : value) ?? null;
  const pairLaw = config.law ? { ...config.law, cor } : lawOfPairs(cor, config.cor_speed), wallCor = config.wall_cor ?? cor;
  const passive = config.wall_law ? { ...config.wall_law, cor: wallCor } : null;
  const lawAt = (side) => (passive && !at(speed, side) && at(temperature, side) === null
    ? passive : lawOfWall(wallCor, corSpeed, at(speed, side), at(temperature, side)));
  const bySide = { name: "sides", ...Object.fromEntries(SIDES.map((side) => [side, lawAt(side)])) };
  const { sides } = SHAPES[config.container.shape ?? "circle"];
  const isThermal = (sides.length ? sides : ["left"]).every((side) => lawAt(side).name === "thermal");
  return {
    pairLaw,
    wallLaw: isBySide(speed) || isBySide(temperature) ? bySide : lawAt("left"),
    contactDuration: collapse.tc ?? 0,
    elasticBelow: collapse.elastic_below ?? 0,
    slides: collapse === "slide",
    surface: surfaceOf(
      config.inertia, config.tangential_cor, config.friction, config.wall_tangential_cor, config.wall_friction, isThermal,
    ),
  };
}

const SURFACE_NAMES = {
  tangential_cor: phrase`tangential CoR of balls`, friction: phrase`friction of balls`,
  wall_tangential_cor: phrase`tangential CoR of the wall`, wall_friction: phrase`friction of the wall`,
};

const isRough = (config) => config.tangential_cor !== null || config.wall_tangential_cor !== null;

/** Whether hits of the wall change anything along the tangent. */
function rubsWall(surface) {
  return surface !== null && surface.wall_tangential_cor > -1 && surface.wall_friction > 0;
}

/** The laws of a wall: of its sides, if they differ. */
function lawsOfWall(law) {
  return law.name === "sides" ? SIDES.map((side) => law[side]) : [law];
}

// Sizes

const sum = (values) => values.reduce((total, value) => total + value, 0);

/** The packing fraction times width times height over the sum of squared radii. */
const packingFactor = ({ shape }) => (shape === "circle" ? 4 : Math.PI);

function packingOf({ container, radii }) {
  const [width, height] = container.size;
  return (packingFactor(container) * sum(Array.from(radii, (radius) => radius * radius))) / (width * height);
}

/** The container, and the radii of balls given by a number, m; one of them may follow from packing. */
function containerAndRadii({ container: given, balls }, gas) {
  const shape = given.shape ?? "circle", factor = packingFactor({ shape }), packing = given.packing ?? balls.packing;
  const counts = gas.map(countOf);
  const first = shape === "circle" ? given.radius : given.width;
  let radii = gas.map(({ radius }) => radius), size;
  if (first == null) {
    const squares = sum(radii.map((radius, k) => counts[k] * radius * radius));
    const length = Math.sqrt((factor * squares) / packing);
    size = [length, length];
  } else size = shape === "circle" ? [2 * first, 2 * first] : [first, given.height ?? first];
  if (radii.some((radius) => radius == null)) {
    const radius = Math.sqrt((packing * size[0] * size[1]) / (factor * sum(counts)));
    radii = radii.map(() => radius);
  }
  return { container: { shape, size }, radii: gas.flatMap((_, k) => Array(counts[k]).fill(radii[k])) };
}

/** How many balls a group has. */
const countOf = ({ count, rings }) => count ?? 1 + 3 * rings * (rings + 1);

function areaOf({ shape, size: [width, height] }) {
  const radius = width / 2;
  return shape === "circle" ? Math.PI * (radius * radius) : width * height;
}

function wallLengthOf(container) {
  const [width, height] = container.size;
  if (container.shape === "circle") return 2 * Math.PI * (width / 2);
  return 2 * ((repeatsAlong(0, container) ? 0 : height) + (repeatsAlong(1, container) ? 0 : width));
}

/** Mean path of a ball between collisions in a dilute gas, m: the same bits as ``Scene.mean_free_path``. */
function meanFreePath(scene) {
  const number = scene.radii.length, mean = pairwiseSum(scene.radii) / number;
  const between = number === 1 ? 0 : 2 * Math.sqrt(2) * number * 2 * mean;
  const obstacles = between + wallLengthOf(scene.container) / Math.PI;
  return obstacles ? areaOf(scene.container) / obstacles : Infinity;
}

/** The sum in NumPy's order of additions. */
function pairwiseSum(values) {
  const number = values.length;
  if (number > 128) {
    const half = number / 2 - (number / 2) % 8 | 0;
    return pairwiseSum(values.slice(0, half)) + pairwiseSum(values.slice(half));
  }
  let total = 0, k = 0;
  if (number >= 8) {
    const r = Array.from(values.slice(0, 8));
    for (k = 8; k + 8 <= number; k += 8) {
      for (let lane = 0; lane < 8; lane += 1) r[lane] += values[k + lane];
    }
    total = ((r[0] + r[1]) + (r[2] + r[3])) + ((r[4] + r[5]) + (r[6] + r[7]));
  }
  for (; k < number; k += 1) total += values[k];
  return total;
}

/** Whether a container of a shape repeats along the axis: 0 is x, 1 is y. */
function repeatsAlong(axis, { shape }) {
  return SHAPES[shape ?? "circle"].periodic[axis];
}

/** Whether balls between walls keep their momentum along them, as in a channel. */
const keepsDrift = (container) => repeatsAlong(0, container) !== repeatsAlong(1, container);

/** The square of an offset, m^2; to the nearest image, where the container repeats. */
function squareOf(x, y, container) {
  const [width, height] = container.size;
  if (repeatsAlong(0, container)) x -= width * Math.round(x / width);
  if (repeatsAlong(1, container)) y -= height * Math.round(y / height);
  return x * x + y * y;
}

// Stored starts

/** The columns of ``_packed`` in page.py: those that have some numbers for each ball, and an object of the CARRIED. */
function unpacked(number, rows, ...parts) {
  const bytes = Uint8Array.from(atob(rows), (letter) => letter.charCodeAt(0)), numbers = new Float64Array(bytes.buffer);
  let end = 0;
  const next = (part) => numbers.slice(end, end += part * number); // empty of what is absent
  return [...parts.map(next), Object.fromEntries(CARRIED.map(({ name, parts: part }) => [name, next(part)]))];
}

const wallKeyOf = (text) => (text === null ? null : BigInt(text));

/** The scene of ``stored_start`` in page.py. */
function storedScene({ number, rows, key, containerMass, surface, ...rules }) {
  const limited = ([name, value]) => [name, value ?? Infinity];
  const rough = surface && Object.fromEntries(Object.entries(surface).map(limited));
  const [positions, velocities, radii, masses, carried] = unpacked(number, rows, 2, 2, 1, 1);
  return {
    ...rules, positions, velocities, radii, masses, ...carried, wallKey: wallKeyOf(key), containerMass: containerMass ?? Infinity,
    surface: rough,
  };
}

// Whether a scene can exist

/** Throw ``SceneError`` for balls that overlap, stick out, or are too large, slow or fast. */
function check(scene) {
  const { container, radii, masses } = scene;
  const amounts = [...radii, ...masses, ...container.size];
  if (!amounts.every((amount) => amount >= LEAST_AMOUNT && amount <= MOST_AMOUNT)) {
    throw new SceneError(phrase`a length or a mass is not from 1e-50 to 1e+50: give one nearer to 1`);
  }
  checkRadii(container, Math.max(...radii));
  checkPlaces(scene);
  checkSpeeds(scene);
}

/** Throw ``SceneError`` for balls that are too large wherever they are. */
function checkRadii(container, largest) {
  const { shape, size } = container;
  const narrow = size.findIndex((length, axis) => repeatsAlong(axis, container) && length < 2 * largest * DIAMETERS);
  if (narrow >= 0) {
    const helps = narrow === 0 ? ["radius", "container"] : ["radius"];
    throw new SceneError(phrase`the container is under 5 diameters of its balls where it repeats`, helps);
  }
  if (shape === "circle" && largest >= size[0] / 2) {
    throw new SceneError(phrase`a ball of radius ${general(largest, 4)} m cannot move in this container`, ["radius", "container"]);
  }
}

/** How far a ball is from the wall, or its centre from an edge that repeats, m. */
function gapOf(x, y, radius, container) {
  const [width, height] = container.size;
  if (container.shape === "circle") return width / 2 - radius - Math.hypot(x, y);
  const across = width / 2 - Math.abs(x) - (repeatsAlong(0, container) ? 0 : radius);
  return Math.min(across, height / 2 - Math.abs(y) - (repeatsAlong(1, container) ? 0 : radius));
}

/** Throw ``SceneError`` for balls that stick out, or overlap. */
function checkPlaces({ positions, radii, container, rounding }) {
  const extent = Math.max(...container.size) + 2 * Math.max(...radii);
  const slack = Math.max(8 * EPSILON * extent + 2e-9 * Math.min(...radii), rounding);
  for (let i = 0; i < radii.length; i += 1) {
    const x = positions[2 * i], y = positions[2 * i + 1], out = -gapOf(x, y, radii[i], container);
    if (out > slack) throw new SceneError(phrase`ball ${i} sticks out of the container by ${general(out, 4)} m`, ["container"]);
    for (let k = 0; k < i; k += 1) {
      const square = squareOf(x - positions[2 * k], y - positions[2 * k + 1], container);
      const overlap = radii[i] + radii[k] - Math.sqrt(square);
      if (overlap > slack) throw new SceneError(phrase`balls ${k} and ${i} overlap by ${general(overlap, 4)} m`, ["container"]);
    }
  }
}

/** Throw ``SceneError`` for balls too slow, fast, light or heavy to be computed with. */
function checkSpeeds({ velocities, radii, masses, container }) {
  const { shape, size } = container;
  let shortest = 2 * Math.min(...radii);
  if (shape === "circle") shortest = Math.min(shortest, size[0] / 2 - Math.max(...radii));
  shortest = Math.min(shortest, 1);
  const longest = Math.max(4 * Math.max(...size), 1);
  const speeds = Array.from(radii, (_, k) => Math.hypot(velocities[2 * k], velocities[2 * k + 1]));
  const isUsable = (speed) => speed === 0 || ((speed * shortest) ** 2 >= TINY && (speed * longest) ** 2 < Infinity);
  const energy = sum(speeds.map((speed, k) => masses[k] * speed * speed)) / 2;
  if (speeds.every((speed) => speed === 0) || (speeds.every(isUsable) && energy >= TINY && energy < Infinity)) return;
  throw new SceneError(phrase`speeds, or energies, are too small or too large to compute with: give speeds nearer to 1`);
}
