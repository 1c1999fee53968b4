// The formulas of theory.py and analysis/gas.py that the page needs, with the same symbols; their sources
// are there. A container is { shape, size: [width, height] }, m; its area and the length of its wall are
// in scene.js. Whether a theory holds is asked by `applies`: FACTS and NEEDS are those of the program.

// The names that theories have in `snooker compare`, too.
const THEORY = {
  ideal: phrase`ideal gas law`, finite: phrase`hard disks, finite N`, maxwell: phrase`Maxwell-Boltzmann`, fixed: phrase`fixed energy`,
};

const hasWalls = (container) => !(repeatsAlong(0, container) && repeatsAlong(1, container));

// Area (m²), edge (m) and growth of the edge with the walls of what centres of balls can reach.
function accessible(container, radius) {
  const { shape, size } = container, reach = size[0] / 2 - radius;
  if (shape === "circle") return { area: Math.PI * reach ** 2, edge: 2 * Math.PI * reach, spreading: 2 * Math.PI };
  const repeats = [0, 1].map((axis) => repeatsAlong(axis, container));
  const [width, height] = size.map((side, axis) => (repeats[axis] ? side : side - 2 * radius));
  const edge = 2 * ((repeats[0] ? 0 : height) + (repeats[1] ? 0 : width));
  return { area: width * height, edge, spreading: repeats.includes(true) ? 0 : 8 };
}

// The traits of a scene that FACTS ask for, see `Traits` of facts.py.
function traitsOf({ container, radii, masses, velocities, pairLaw, wallLaw, surface }) {
  const walls = hasWalls(container), laws = walls ? lawsOfWall(wallLaw) : [], number = radii.length;
  const balls = Array.from(radii, (radius, k) => `${radius} ${masses[k]}`), cor = (law) => law.cor ?? 0;
  const hot = laws.filter(givesEnergy), changing = laws.filter((law) => givesEnergy(law) || cor(law) < 1);
  const wallKeepsSlip = !walls || !surface || keepsSlip(surface.wall_tangential_cor, surface.wall_friction);
  const temperatures = new Set(wallKeepsSlip ? changing.map(({ temperature = 0 }) => temperature) : []);
  const energy = sum(Array.from(masses, (mass, k) => (mass * (velocities[2 * k] ** 2 + velocities[2 * k + 1] ** 2)) / 2));
  return {
    number, species: new Set(balls).size, masses: new Set(masses).size, walls, keepsDrift: keepsDrift(container),
    ...fullness(packingOf({ container, radii }), sum(Array.from(radii)) / number, container),
    cor: pairLaw.cor, pairLaw: pairLaw.word, wallCor: walls ? Math.min(...laws.map(cor)) : 1,
    wallLaw: walls ? wallLaw.word : "", hotLaws: new Set(hot.map((law) => JSON.stringify(law))).size,
    wallTemperature: temperatures.size === 1 ? [...temperatures][0] : 0,
    rough: Boolean(surface), pairsKeepSlip: !surface || keepsSlip(surface.tangential_cor, surface.friction), wallKeepsSlip,
    moves: energy > 0, atRest: centreEnergy({ velocities, masses }) <= 1e-12 * energy,
  };
}

// How full a container is: the packing, and the area of balls over the most that a fluid can have.
function fullness(packing, radius, container) {
  const { area, edge } = accessible(container, radius);
  return { packing, crowding: (packing * areaOf(container)) / (area + edge * radius) };
}

// Whether contacts take no energy along the tangent.
const keepsSlip = (cor, friction) => cor === -1 || friction === 0 || (cor === 1 && friction === null);

const applies = (theory, traits) => NEEDS[theory].every((need) => FACTS[need](traits));

// Polynomials by their coefficients, the constant first.
const valueAt = (polynomial, x) => polynomial.reduceRight((sum, factor) => sum * x + factor, 0);
const derivative = (polynomial) => polynomial.map((factor, power) => power * factor).slice(1);

function productOf(first, second) {
  const result = new Array(first.length + second.length - 1).fill(0);
  first.forEach((a, i) => second.forEach((b, j) => { result[i + j] += a * b; }));
  return result;
}

// The hard-disk fluid with the numbers of theory.py.
class Fluid {
  // contact, denominator: coefficients of the Padé approximant
  constructor({ contact, denominator }) {
    Object.assign(this, { contact, below: denominator });
    const above = [0, ...denominator];
    contact.forEach((factor, power) => { above[power + 2] = (above[power + 2] ?? 0) + factor; });
    const rising = productOf(derivative(above), denominator), falling = productOf(above, derivative(denominator));
    this.slope = rising.map((factor, power) => factor - falling[power]);
  }

  contactValue(packing) {
    return valueAt(this.contact, 2 * packing) / valueAt(this.below, 2 * packing);
  }

  compressibility(packing) {
    return 1 + 2 * packing * this.contactValue(packing);
  }

  // P''/P' of P = ηZ.
  bending(packing) {
    const relative = (polynomial) => valueAt(derivative(polynomial), 2 * packing) / valueAt(polynomial, 2 * packing);
    return 2 * (relative(this.slope) - 2 * relative(this.below));
  }

  // PV/NT of N equal balls at the wall, or without walls in the box, and by the virial.
  state(number, radius, container) {
    const covered = number * Math.PI * radius ** 2, whole = areaOf(container);
    const { area, edge, spreading } = accessible(container, radius);
    const linear = area - covered, quadratic = area + 2 * radius * edge;
    const packing = (2 * covered) / (linear + Math.sqrt(linear ** 2 + 4 * quadratic * covered));
    const density = packing / (Math.PI * radius ** 2);
    const tension = (-density * radius * packing) / (1 - packing) ** 2;
    const bulk = density * this.compressibility(packing);
    const adsorbed = (2 * radius * packing ** 2) / (1 + packing);
    const slope = (2 * radius * packing * (2 + packing)) / (1 + packing) ** 2, room = area + slope * edge;
    const bend = (((4 * radius) / (1 + packing) ** 3) * edge) / room - this.bending(packing) + 1 / packing;
    const ofVariance = (growth, lengthening) =>
      ((growth + slope * lengthening) / room - (bend * (packing * growth + adsorbed * lengthening)) / room) / 2;
    const force = bulk * edge - tension * spreading - ofVariance(edge, spreading);
    const work = 2 * bulk * area - tension * edge - ofVariance(2 * area, edge);
    const virialRatio = work / (2 * number);
    const ratio = hasWalls(container) ? ((force / wallLengthOf(container)) * whole) / number : virialRatio;
    return { ratio, virialRatio };
  }

  // PV/NT at a CoR between balls: what their collisions add is (1 + e)/2 of that of elastic ones. T is
  // the temperature at which they meet each other.
  ratio(number, radius, container, cor) {
    const state = this.state(number, radius, container);
    const { area, edge } = accessible(container, radius);
    const alone = hasWalls(container) ? ((edge / area) * areaOf(container)) / wallLengthOf(container) : 1;
    return alone + ((1 + cor) / 2) * (state.ratio - alone);
  }

  // Haff's α of N equal balls at fixed energy that begin at a temperature, 1/s.
  haffRate({ number, radius, mass, container, containerMass, temperature, cor, wallCor }) {
    const state = this.state(number, radius, container), walls = hasWalls(container);
    const components = walls ? 2 * number : 2 * number - 2, factor = fixedEnergyFactor(components / 2);
    const pairs = (factor * 2 * (state.virialRatio - 1) * Math.sqrt(temperature / (Math.PI * mass))) / radius;
    let wall = 0;
    if (walls) {
      const force = (wallLengthOf(container) * state.ratio * number * temperature) / areaOf(container);
      const impulse = Math.sqrt(2 * Math.PI * mass * temperature) / fixedEnergyFactor(number);
      wall = (force / (number * impulse)) * Math.sqrt(1 + mass / containerMass);
    }
    const sonine = (16 * (1 - cor) * (1 - 2 * cor ** 2)) / (73 - 41 * cor - 2 * (1 - cor) * cor ** 2);
    const cooling = ((1 - cor ** 2) * pairs * (1 + (3 * sonine) / 16)) / 2 + (1 - wallCor ** 2) * wall;
    return (((number * 2) / (components + 1)) * cooling) / 2;
  }
}

// √N Γ(N)/Γ(N + ½): the mean speed of N balls at fixed energy over Maxwell's.
function fixedEnergyFactor(number) {
  let ratio = 2 / Math.sqrt(Math.PI);
  for (let n = 1; n < number; n++) ratio *= n / (n + 0.5);
  return Math.sqrt(number) * ratio;
}

// The density of the speed over √(2T/m) of one of N balls at fixed energy.
const fixedEnergyDensity = (number) => (v) =>
  v * v < number ? ((2 * (number - 1) * v) / number) * (1 - (v * v) / number) ** (number - 2) : 0;

// PV/NT with the temperature of all motion instead of that at which balls meet each other.
function asMet(ratio, { N, temperature, container, drift }) {
  return 1 + ((ratio - 1) * meetingTemperature(N * temperature, N, container, drift)) / temperature;
}
