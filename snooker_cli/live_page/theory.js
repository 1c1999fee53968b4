// What the program's theories see of a gas. THEORIES are those of the program, with their needs and their
// values, see page_theories.py. A container is { shape, size: [width, height] }, m; its area and the length of
// its wall are in scene.js.

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
  // One of a package may take energy at any speed, also with a CoR of 1; see `traits_of_rules`.
  const cor = (law) => (LAWS[law.name].ofPackage ? Math.min(law.cor, 1 - EPSILON / 2) : law.cor ?? 0);
  const balls = Array.from(radii, (radius, k) => `${radius} ${masses[k]}`);
  const hot = laws.filter(givesEnergy), changing = laws.filter((law) => givesEnergy(law) || cor(law) < 1);
  const wallKeepsSlip = !walls || !surface || keepsSlip(surface.wall_tangential_cor, surface.wall_friction);
  const temperatures = new Set(wallKeepsSlip ? changing.map(({ temperature = 0 }) => temperature) : []);
  const energy = kineticEnergyOf({ masses, velocities });
  return {
    number, species: new Set(balls).size, masses: new Set(masses).size, walls, keepsDrift: keepsDrift(container),
    ...fullness(packingOf({ container, radii }), sum(Array.from(radii)) / number, container),
    cor: cor(pairLaw), pairLaw: pairLaw.name, wallCor: walls ? Math.min(...laws.map(cor)) : 1,
    wallLaw: walls ? wallLaw.name : "", hotLaws: new Set(hot.map((law) => JSON.stringify(law))).size,
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

const applies = ({ needs }, traits) => needs.every((fact) => fact(traits));

// A container as the program's theories see it.
function placeOf(container) {
  const [width, height] = container.size, repeats = [0, 1].map((axis) => repeatsAlong(axis, container));
  return {
    area: areaOf(container), wallLength: wallLengthOf(container), hasWall: hasWalls(container), periodic: repeats,
    accessible: (radius) => accessible(container, radius),
    packingFraction: (squares) => (packingFactor(container) * squares) / (width * height),
  };
}

// A scene of equal balls as theories see it. energy, drift: of all balls at the start, and of their centre, J.
const equalBalls = ({ number, radius, mass, container, containerMass, cor, wallCor, energy, drift }) => ({
  number, radii: [radius], masses: [mass], container: placeOf(container), containerMass,
  restitution: cor, wallRestitution: wallCor, kineticEnergy: energy, driftEnergy: drift,
});

// The same of the scene of a gas; its balls are equal wherever a theory of them holds.
const equalBallsOf = (scene) => equalBalls({
  number: scene.radii.length, radius: scene.radii[0], mass: scene.masses[0], container: scene.container,
  containerMass: scene.containerMass, cor: scene.pairLaw.cor, wallCor: scene.wallLaw.cor ?? 1,
  energy: kineticEnergyOf(scene), drift: driftEnergy(scene),
});

// `Gas` of analysis/gas.py: a scene, with the means that theories need. temperature: of all motion, J.
function gasOf(scene, temperature) {
  const energy = scene.number * temperature;
  return {
    scene, temperature, idealPressure: energy / scene.container.area, startingSpeedRatio: 1,
    meetingRatio: FORMULAS.meetingTemperature(energy, scene, scene.driftEnergy) / temperature,
  };
}

// A function that keeps its last value, as ``lru_cache`` does with more.
function remembered(of) {
  let last = null, value;
  return (...given) => {
    if (!last || given.some((one, k) => one !== last[k])) [last, value] = [given, of(...given)];
    return value;
  };
}

// A polynomial by its coefficients, the constant first.
const polyval = (x, coefficients) => coefficients.reduceRight((sum, factor) => sum * x + factor, 0);

// ln Γ(x): Stirling's series, from 12 on to the last digits.
function lgamma(x) {
  let before = 0;
  for (; x < 12; x++) before += Math.log(x);
  const terms = polyval(1 / x ** 2, [1 / 12, -1 / 360, 1 / 1260, -1 / 1680, 1 / 1188]) / x;
  return (x - 0.5) * Math.log(x) - x + Math.log(2 * Math.PI) / 2 + terms - before;
}
