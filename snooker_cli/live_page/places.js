"use strict";

// Places of balls at the start: on rings, on a hexagonal lattice, or at random; see
// placement/places.py.

// Rings: regular polygons whose corners are correctly rounded

const DIGITS = 160n, KEPT = 120n; // binary digits of numbers here, and of a corner
const PI_SCALED = 0x3243f6a8885a308d313198a2e03707344a409382n << (DIGITS - 156n);

/** Places on rings, x0, y0, x1 …, m. Throws ``SceneError`` that says which changes would fit. */
function placesOnRings(balls, containerRadius) {
  const { rings, radius } = balls, extent = balls.ring_extent * containerRadius;
  const largest = Math.min(extent / Math.max(rings, 1) / 2, containerRadius - extent);
  if (rings > 0 && !(radius <= largest * (1 + 1e-12))) {
    throw ringsDoNotFit(balls, containerRadius, largest);
  }
  const positions = [0, 0];
  for (let ring = 1; ring <= rings; ring += 1) {
    const distance = ring / rings * extent;
    positions.push(...unitPolygon(6 * ring).map((part) => distance * part));
  }
  return positions;
}

function ringsDoNotFit(balls, containerRadius, largest) {
  const { rings, radius } = balls, margin = 1 - balls.ring_extent, choices = [];
  const fewer = Math.floor(balls.ring_extent * containerRadius / radius / 2 * (1 + 1e-12));
  if (radius > margin * containerRadius) {
    choices.push("lower ring_extent");
  } else if (fewer > 0) {
    choices.push(`set rings to ${fewer} or less`);
  }
  if (margin > 0) {
    const needed = radius * Math.max(2 * rings / balls.ring_extent, 1 / margin);
    const most = fourDigits(largest * (1 + 1e-13), false);
    const least = fourDigits(needed * (1 - 1e-13), true);
    choices.push(`set balls.radius to ${most} or less`);
    choices.push(`set container.radius to ${least} or more`);
  }
  const problem =
    `rings: ${rings} with balls of radius ${general(radius, 6)} m are too large for a ` +
    `container of radius ${general(containerRadius, 6)} m`;
  return new SceneError("balls", `${problem}; ${choices.join(", or ")}`);
}

/** A positive number with four digits, rounded up or down. */
function fourDigits(value, up) {
  const [figures, power] = value.toExponential().split("e"), digits = figures.replace(".", "");
  const whole = Number(digits.slice(0, 4).padEnd(4, "0")) + (up && Number(digits.slice(4)) ? 1 : 0);
  return general(Number(`${whole}e${Number(power) - 3}`), 6);
}

/** Corners of a regular polygon on the unit circle, x0, y0, x1 …, correctly rounded. */
function unitPolygon(corners) {
  const { cosine, sine } = cosineAndSineOf(2n * PI_SCALED / BigInt(corners));
  const points = [];
  let [x, y] = [1n << DIGITS, 0n];
  for (let k = 0; k < corners; k += 1) {
    points.push(nearestDouble(x), nearestDouble(y));
    [x, y] = [(x * cosine - y * sine) >> DIGITS, (x * sine + y * cosine) >> DIGITS];
  }
  return points;
}

/** Taylor series of both, for an angle up to 2 pi. */
function cosineAndSineOf(angle) {
  const parts = [0n, 0n];
  let term = 1n << DIGITS;
  for (let order = 0; order < 72; order += 1) {
    parts[order % 2] += order % 4 < 2 ? term : -term;
    term = ((term * angle) >> DIGITS) / BigInt(order + 1);
  }
  return { cosine: parts[0], sine: parts[1] };
}

/** The double of a scaled number, whose last digits have roundings. */
function nearestDouble(scaled) {
  const lost = DIGITS - KEPT;
  return Number((scaled + (1n << (lost - 1n))) >> lost) / 2 ** Number(KEPT);
}

// Hexagonal lattices fitted into a container

/** Places as far from each other and from the wall as possible, x0, y0, x1 …, and their distance. */
function lattice(container, number) {
  const { shape, size: [width, height] } = container;
  let best;
  if (shape === "circle") {
    best = latticeInCircle(width / 2, number);
  } else if (shape === "channel") {
    best = latticeInBox(width, height, number, true);
  } else {
    const layout = shape === "box" ? latticeInBox : latticeInPeriodic;
    best = layout(width, height, number);
    const lying = layout(height, width, number);
    if (lying.diameter > best.diameter) {
      const places = lying.positions;
      best = { diameter: lying.diameter, positions: places.map((_, k) => places[k ^ 1]) };
    }
  }
  const diameter = best.diameter - 4 * EPSILON * Math.max(width, height);
  return { positions: best.positions, diameter };
}

/** As ``lattice``, without places where a ball of a radius (m) overlaps one that is placed. */
function latticeAround(container, number, radius, placed) {
  let tried = 0, diameter = Infinity, free = [];
  while (free.length < number && diameter >= 2 * radius) {
    tried += number - free.length;
    const all = lattice(container, tried);
    diameter = all.diameter;
    free = pairsOf(all.positions).filter((place) => !placed.radii.some((other, k) =>
      isWithin(place, pairsOf(placed.places)[k], radius + other, container)));
  }
  if (free.length > number) {
    const all = free;
    free = Array.from({ length: number }, (_, k) => all[Math.floor(k * all.length / number)]);
  }
  return { positions: free.flat(), diameter };
}

function pairsOf(places) {
  return Array.from({ length: places.length / 2 }, (_, k) => [places[2 * k], places[2 * k + 1]]);
}

/** The lattice places nearest to the centre, which is a place or lies between two or three. */
function latticeInCircle(radius, number) {
  const reach = Math.floor(0.607 * Math.sqrt(number)) + 2;
  let best = null;
  for (const [restU, restV] of [[0, 0], [3, 0], [2, 2]]) {
    const places = [];
    for (let row = -reach; row <= reach; row += 1) {
      for (let column = -reach; column <= reach; column += 1) {
        const u = 6 * column + restU, v = 6 * row + restV;
        places.push({ u, v, square: u * u + u * v + v * v });
      }
    }
    const nearest = places.sort((a, b) => a.square - b.square).slice(0, number);
    const farthest = Math.sqrt(nearest[number - 1].square) / 6;
    const spacing = radius / (farthest + 0.5);
    if (best !== null && best.diameter >= spacing) continue;
    const positions = nearest.flatMap(({ u, v }) =>
      [(u + v / 2) * (spacing / 6), v * (Math.sqrt(3) / 2) * (spacing / 6)]);
    best = { positions, diameter: spacing };
  }
  return best;
}

/** An even number of rows along x, each shifted by half a spacing. */
function latticeInPeriodic(width, height, number) {
  let best = { diameter: -Infinity };
  for (let half = 1; half <= mostRows(width, height, number); half += 1) {
    const rows = 2 * half, columns = Math.ceil(number / rows);
    const across = width / columns, up = height / rows;
    const diagonal = Math.sqrt((across / 2) * (across / 2) + up * up);
    const diameter = Math.min(Math.min(across, 2 * up), diagonal);
    if (diameter > best.diameter) best = { diameter, columns, rows };
  }
  const { diameter, columns, rows } = best;
  const positions = keptPlaces(number, columns, rows, 0).flatMap(([column, row]) => [
    ((column + (row % 2) / 2 + 0.25) / columns - 0.5) * width,
    ((row + 0.5) / rows - 0.5) * height,
  ]);
  return { positions, diameter };
}

/** Rows along x; every other one is shifted by half a spacing and may have one place less. */
function latticeInBox(width, height, number, repeats = false) {
  let best = null;
  for (const fewer of [0, 1]) {
    let ofThese = null;
    for (let k = 1; k <= mostRows(width, height, number); k += 1) {
      const rows = repeats ? 2 * k : k;
      const columns = Math.ceil((number + fewer * Math.floor(rows / 2)) / rows);
      // Length of the rows in spacings, with half a spacing for the shift.
      const length = rows > 1 ? columns - (1 + fewer) / 2 : columns - 1;
      const diameter = diameterInBox(width, height, columns, rows, length, repeats);
      const layout = { diameter, columns, rows, length, fewer };
      if (ofThese === null || diameter > ofThese.diameter) ofThese = layout;
    }
    // As Python's max of tuples: by diameter, columns, rows, length, fewer.
    if (best === null || isLater(Object.values(ofThese), Object.values(best))) best = ofThese;
  }
  const { diameter, columns, rows, length, fewer } = best;
  const up = repeats ? height / rows : (height - diameter) / (rows - 1 || 1);
  const positions = keptPlaces(number, columns, rows, fewer).flatMap(([column, row]) => [
    (column + (row % 2) / 2 - length / 2) * ((width - diameter) / (length || 1)),
    (row - (rows - 1) / 2) * up,
  ]);
  return { positions, diameter };
}

function isLater(row, other) {
  const k = row.findIndex((value, place) => value !== other[place]);
  return k >= 0 && row[k] > other[k];
}

/** The largest diameter, by bisection, m. */
function diameterInBox(width, height, columns, rows, length, repeats) {
  let low = 0, high = Math.min(width, height);
  for (let step = 0; step < 60; step += 1) {
    const middle = (low + high) / 2;
    const across = (width - middle) / (length > 0 ? length : Infinity);
    const up = repeats ? height / rows : (height - middle) / Math.max(rows - 1, 1);
    const diagonal = Math.sqrt((across / 2) * (across / 2) + up * up);
    const fits =
      (columns === 1 || across >= middle) && (rows === 1 || diagonal >= middle) &&
      (rows <= 2 || 2 * up >= middle);
    [low, high] = fits ? [middle, high] : [low, middle];
  }
  return low;
}

/** The most rows to compare: up to twice those of equilateral triangles. */
function mostRows(width, height, number) {
  const ideal = Math.sqrt(2 / Math.sqrt(3) * number * Math.min(height / width, number));
  return Math.min(number, Math.floor(2 * ideal) + 3);
}

/** Column and row of ``number`` places, chosen evenly among all; odd rows may have one fewer. */
function keptPlaces(number, columns, rows, fewer) {
  const ofTwoRows = 2 * columns - fewer;
  const places = Math.floor(rows / 2) * ofTwoRows + (rows % 2) * columns;
  return Array.from({ length: number }, (_, k) => {
    const place = Math.floor(k * places / number), pair = Math.floor(place / ofTwoRows);
    const rest = place % ofTwoRows, odd = rest >= columns ? 1 : 0;
    return [rest - columns * odd, 2 * pair + odd];
  });
}

/** Whether two places are within a reach, m, of each other's nearest images. */
function isWithin([x, y], [otherX, otherY], reach, container) {
  const dx = nearestOffset(x - otherX, 0, container);
  const dy = nearestOffset(y - otherY, 1, container);
  return Math.sqrt(dx * dx + dy * dy) < reach;
}

// Random places: balls are inserted one after the other, and pushed apart if that jams

function randomPlaces() {
  throw new SceneError("balls.start", "this page places balls on a lattice only");
}
