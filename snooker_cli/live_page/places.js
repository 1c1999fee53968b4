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

const INSERTED = 0.4; // packing up to which balls are inserted at their size
const ATTEMPTS = 100; // for each ball, then insertion has failed
const JAMMED = 0.84, LARGEST = 0.82, SWEEPS = 2000, PUSH = 0.3, MEMORY = 0.9, SKIN = 0.6;
const WIDER = 1 + 1e-9;

/** Random places, x0, y0, x1 …, m, as ``random_places``; or the packing reached in ``jammed``. */
function randomPlaces(container, radii, counts, packing, stream, placed) {
  if (packing > LARGEST * (1 + 1e-9)) return { jammed: LARGEST };
  const all = [...placed.radii, ...counts.flatMap((number, k) => Array(number).fill(radii[k]))];
  const wide = 2 * Math.max(...all) / Math.min(...container.size);
  if (wide > 1) return { jammed: packing / (wide * wide) };
  let inserted = 2 * Math.min(packing, INSERTED), places = null, scale;
  // Each try inserts smaller balls. At their full size, these are then pushed apart.
  while (places === null) {
    inserted /= 2;
    scale = Math.sqrt(inserted / packing);
    places = insertedPlaces(container, radii, counts, stream, scale, placed);
  }
  if (scale < 1) {
    // In strips, as the program sorts them: the order of pushes decides their last bits.
    const strip = 4 * (preciseSum(all) / all.length);
    const rows = places.map(([, y]) => Math.floor(y / strip));
    const order = all.map((_, k) => k)
      .sort((a, b) => rows[a] - rows[b] || places[a][0] - places[b][0] || a - b);
    const result = pushedApart(
      container, order.map((k) => [...places[k]]), order.map((k) => all[k]), packing,
      order.map((k) => k < placed.radii.length),
    );
    if (result.jammed !== undefined) return result;
    order.forEach((k, row) => {
      places[k] = result.places[row];
    });
  }
  return { places: places.flat() };
}

/** Places [x, y] at which balls scaled by ``scale`` do not overlap; null if that fails. */
function insertedPlaces(container, radii, counts, stream, scale, placed) {
  const { shape, size } = container, given = pairsOf(placed.places);
  const inserted = radii.map(() => []);
  const bySize = radii.map((_, k) => k).sort((a, b) => radii[b] - radii[a] || a - b);
  for (const k of bySize) {
    let attempts = 0, accepted = 1;
    for (;;) {
      const missing = counts[k] - inserted[k].length;
      if (missing <= 0) break;
      if (attempts > ATTEMPTS * counts[k]) return null;
      const number = Math.floor(missing / accepted) + 8;
      attempts += number;
      let tried = triedPlaces(container, radii[k], number, stream);
      given.forEach((place, row) => {
        tried = unblocked(tried, [place], scale * (placed.radii[row] + radii[k]), container);
      });
      inserted.forEach((places, other) => {
        tried = unblocked(tried, places, scale * (radii[other] + radii[k]), container);
      });
      tried = unblocked(tried, tried, scale * 2 * radii[k], container);
      accepted = Math.max(tried.length / number, 0.05);
      inserted[k].push(...tried.slice(0, missing));
    }
  }
  return [...given, ...inserted.flat()];
}

/** Random places [x, y] of a ball of a radius in the container, m. */
function triedPlaces({ shape, size }, radius, number, stream) {
  if (shape === "circle") {
    const reach = size[0] / 2 - radius;
    return pairsOf(pointsInDisc(stream, number, 0).map((part) => reach * part));
  }
  const sides = [0, 1].map((axis) => size[axis] - (repeatsAlong(axis, shape) ? 0 : 2) * radius);
  return Array.from({ length: number }, () =>
    sides.map((side) => (stream.uniform() - 0.5) * side));
}

/** The tried places that are not within reach (m) of others, or of earlier ones if these. */
function unblocked(tried, others, reach, container) {
  const images = imagesOf(others, container.shape, container.size);
  return tried.filter((place, a) => !images.some(({ x, y, index: b }) => {
    const dx = place[0] - x, dy = place[1] - y;
    return Math.sqrt(dx * dx + dy * dy) < reach && (tried !== others || b < a);
  }));
}

/** Places and, along axes that repeat, their images on both sides. */
function imagesOf(places, shape, [width, height]) {
  const steps = (axis) => (repeatsAlong(axis, shape) ? [0, 1, -1] : [0]);
  return steps(1).flatMap((up) => steps(0).flatMap((across) =>
    places.map(([x, y], index) => ({ x: x + across * width, y: y + up * height, index }))));
}

/** Places without overlaps, as ``_pushed_apart``; of ``fixed`` balls, the same. */
function pushedApart(container, places, radii, packing, fixed) {
  const number = radii.length, { shape } = container;
  const larger = 1 + Math.max(0.25 * (Math.sqrt(JAMMED / packing) - 1), 1e-4);
  const wanted = radii.map((radius) => radius * larger);
  const skin = SKIN * (preciseSum(radii) / number);
  const steps = places.map(() => [0, 0]);
  let moved = Infinity, pairs, seen, ratio;
  for (let sweep = 0; sweep < SWEEPS; sweep += 1) {
    // List neighbours anew before a pair outside of the list can touch.
    if (2 * moved > skin) {
      putInside(container, places, radii);
      pairs = nearPairs(places, wanted, skin, container);
      seen = places.map((place) => [...place]);
    }
    // Push each pair that overlaps at the enlarged size, until none overlaps at its own size.
    const pushes = [places.map(() => [0, 0]), places.map(() => [0, 0])];
    let apart = true;
    ratio = Infinity;
    for (const [i, j] of pairs) {
      const offset = [0, 1].map((axis) =>
        nearestOffset(places[i][axis] - places[j][axis], axis, container));
      const distance = Math.sqrt(offset[0] * offset[0] + offset[1] * offset[1]);
      if (!(distance < wanted[i] + wanted[j])) continue;
      apart &&= distance >= radii[i] + radii[j];
      ratio = Math.min(ratio, distance / (radii[i] + radii[j]));
      const part = PUSH / 2 * (wanted[i] + wanted[j] - distance) / distance;
      for (const axis of [0, 1]) {
        pushes[0][i][axis] += part * offset[axis];
        pushes[1][j][axis] += part * offset[axis];
      }
    }
    if (apart) {
      putInside(container, places, radii);
      return { places };
    }
    for (let k = 0; k < number; k += 1) {
      for (const axis of [0, 1]) {
        steps[k][axis] *= MEMORY;
        steps[k][axis] += pushes[0][k][axis] - pushes[1][k][axis];
        if (fixed[k]) steps[k][axis] = 0;
        places[k][axis] += steps[k][axis];
      }
    }
    if (shape !== "periodic") putInside(container, places, radii);
    moved = Math.max(...places.map(([x, y], k) => {
      const dx = x - seen[k][0], dy = y - seen[k][1];
      return Math.sqrt(dx * dx + dy * dy);
    }));
  }
  return { jammed: packing * ratio * ratio };
}

/** Move balls that stick out to the wall, or along an axis that repeats to their image inside. */
function putInside(container, places, radii) {
  const { shape, size } = container;
  places.forEach((place, k) => {
    if (shape === "circle") {
      const farthest = size[0] / 2 - radii[k];
      const distance = Math.sqrt(place[0] * place[0] + place[1] * place[1]);
      const factor = distance > farthest ? farthest / distance : 1;
      place[0] *= factor;
      place[1] *= factor;
      return;
    }
    for (const axis of [0, 1]) {
      const corner = size[axis] / 2 - radii[k];
      place[axis] = repeatsAlong(axis, shape)
        ? nearestOffset(place[axis], axis, container)
        : Math.min(Math.max(place[axis], -corner), corner);
    }
  });
}

/** Pairs of disks with surfaces at most ``gap`` (m) apart, in the order of neighbours.py. */
function nearPairs(places, radii, gap, container) {
  const pairs = [];
  let left = radii.map((_, k) => k);
  while (left.length) {
    const largest = Math.max(...left.map((k) => radii[k]));
    const isLarge = left.map((k) => radii[k] > largest / 2);
    const large = left.filter((_, row) => isLarge[row]);
    const among = (balls) => balls.map((k) => places[k]);
    for (const [a, b, distance] of near(among(large), among(left), 2 * largest + gap, container)) {
      const i = large[a], j = left[b];
      if (distance <= radii[i] + radii[j] + gap && (!isLarge[b] || i < j)) pairs.push([i, j]);
    }
    left = left.filter((_, row) => !isLarge[row]);
  }
  return pairs;
}

/** Pairs [point, other, distance] within ``reach`` (m): by rows of cells, then by cell. */
function near(points, others, reach, { shape, size }) {
  const isNear = ({ x, y, index }) => [x, y].every((value, axis) => {
    const own = others[index][axis], towards = Math.sign(own - value); // 0 for itself
    return towards === 0 || towards * own >= size[axis] / 2 - reach * WIDER;
  });
  const images = imagesOf(others, shape, size).filter(isNear);
  const all = [...points, ...images.map(({ x, y }) => [x, y])];
  const low = [0, 1].map((axis) => Math.min(...all.map((place) => place[axis])));
  const extent = low.map((least, axis) => Math.max(...all.map((place) => place[axis])) - least);
  const most = 4 * images.length;
  const fitting = extent.map((length) => Math.min(Math.max(length / (reach * WIDER), 1), most));
  const fewer = Math.sqrt(Math.max(fitting[0] * fitting[1] / most, 1));
  const cells = fitting.map((number) => Math.floor(Math.max(number / fewer, 1)));
  const stride = cells[0] + 2;
  const cellOf = (place) => {
    const [column, row] = place.map((value, axis) => Math.trunc(
      Math.min((value - low[axis]) / (extent[axis] || 1) * cells[axis], cells[axis] - 1)));
    return (row + 1) * stride + column + 1;
  };
  const sorted = (list) => list.map((place, k) => ({ place, k, cell: cellOf(place) }))
    .sort((a, b) => a.cell - b.cell || a.k - b.k);
  const bySide = sorted(images.map(({ x, y }) => [x, y])), pairs = [];
  for (const row of [-stride, 0, stride]) {
    for (const { place, k, cell } of sorted(points)) {
      for (const other of bySide) { // the three cells of a row are consecutive
        if (other.cell < cell + row - 1 || other.cell > cell + row + 1) continue;
        const x = place[0] - other.place[0], y = place[1] - other.place[1];
        const distance = Math.sqrt(x * x + y * y);
        if (distance <= reach) pairs.push([k, images[other.k].index, distance]);
      }
    }
  }
  return pairs;
}
