"use strict";

// The engine for boxes, and for circles with more balls than ``few_at`` of simulation.py, as
// snooker_cli/engine/cells.py and cell_grid.py. A ball looks for partners in its own and the eight
// cells around, and at a crossing in the three on the far side. The place and order of cells and
// members are the program's, because they decide when a contact is computed, and so its last bits.

const LEAST_MEMBERS = 4, CELL_OVER_BALL = 1 + 1e-9, MOST_IN_ROW = 64, LEAST_IN_PERIOD = 5;
const CROSSINGS_AT_ONCE = 1e6; // after which ``advance`` returns, so that a page stays alive
const MOST_CROSSINGS = 1e8; // without a collision, after which a repeat without a time ends
const GROUP = 16; // balls whose earliest time is kept, so that the next event needs no long search
const NO_ENTRY = -4; // a contact that the entry has already
const MARGIN = 0.1; // way of a free container, in cells, until all is predicted again
const RENEWAL = 400; // crossings that take as long as predicting all again

/** Whether the program uses the engine for few balls, see ``engine_for`` of simulation.py. */
function usesAllPairs(scene) {
  const { container, containerMass, radii, slides } = scene;
  if (container.shape !== "circle") return false;
  if (slides) return true;
  const root = Math.sqrt(Math.sqrt(packingOf(scene))), few = containerMass < Infinity ? 150 : 48;
  return radii.length <= Math.floor(Math.min(few / (root * Math.sqrt(root)), 1000));
}

function packingOf({ container, radii }) {
  return packingFraction(container, pairwiseSum(radii.map((radius) => radius * radius)));
}

/** Where the cells are: their sides (m), the lower left corner of the first (m), how many. */
function newMesh(scene) {
  const { container, radii } = scene, { shape, size } = container, number = radii.length;
  const balls = Math.max(1, 0.4 * power(packingOf(scene), -1 / 3));
  const side = Math.max(
    Math.sqrt(balls * areaOf(container) / number),
    Math.max(...size) / (MOST_IN_ROW * number),
    2 * Math.max(...radii) * CELL_OVER_BALL,
  );
  const along = (length, repeats) => {
    if (repeats) {
      const cells = Math.max(Math.floor(length / side), LEAST_IN_PERIOD);
      return { side: length / cells, begin: -0.5 * length, cells };
    }
    // One more for a free container, which may be off their middle by less than half a cell.
    const cells = Math.ceil(length / side) + (scene.containerMass < Infinity ? 3 : 2);
    return { side, begin: -0.5 * cells * side, cells };
  };
  const across = along(size[0], shape === "periodic");
  const up = along(size[1], shape === "periodic" || shape === "channel");
  return {
    width: across.side, left: across.begin, columns: across.cells,
    height: up.side, bottom: up.begin, rows: up.cells,
  };
}

/** Whether a ball with its centre in a cell can touch the wall, if that moves by a margin, m. */
function cellsAtWall({ container, radii }, mesh, margin) {
  const { width, height, columns, rows } = mesh, largest = Math.max(...radii);
  const atWall = new Uint8Array(columns * rows);
  for (let cell = 0; container.shape !== "periodic" && cell < atWall.length; cell += 1) {
    const left = width * (cell % columns - 0.5 * columns);
    const bottom = height * (Math.floor(cell / columns) - 0.5 * rows);
    for (const x of [left, left + width]) {
      for (const y of [bottom, bottom + height]) {
        const [gap] = gapsOf(CELL_OVER_BALL * x, CELL_OVER_BALL * y, largest, container);
        if (gap <= margin) atWall[cell] = 1;
      }
    }
  }
  return atWall;
}

/** A positive number to a power, rounded once, as in simulation.py. */
function power(base, exponent) {
  const digits = 200n, one = 1n << digits;
  const times = (a, b) => a * b / one; // towards zero
  // A double above 2^-47 as a whole number over 2^200.
  const exact = (value) => BigInt(value * 2 ** 100) << 100n;
  const logarithmOf = (value) => {
    // 2 artanh((x - 1)/(x + 1)) of a number from 1/2 to 2.
    const z = ((value - one) << digits) / (value + one), square = times(z, z);
    let term = z, sum = 0n;
    for (let odd = 1n; term !== 0n; odd += 2n) {
      sum += term / odd;
      term = times(term, square);
    }
    return 2n * sum;
  };
  let mantissa = base, halvings = 0n;
  for (; mantissa < 0.5; halvings -= 1n) mantissa *= 2;
  for (; mantissa > 2; halvings += 1n) mantissa /= 2;
  const natural = logarithmOf(exact(mantissa)) + halvings * logarithmOf(2n * one);
  const argument = times(natural, exact(exponent)) / 1024n;
  let term = one, sum = 0n;
  for (let order = 1n; term !== 0n; order += 1n) {
    sum += term;
    term = times(term, argument) / order;
  }
  for (let k = 0; k < 10; k += 1) sum = times(sum, sum);
  return Number(sum) / 2 ** 200;
}

/** Whether two balls never come within a distance (m), in any image: exact, see contact.py.
 *
 * ball, other : place (m), velocity (m/s) and clock (s)
 */
function neverMeet(ball, other, distance, period) {
  // All numbers are whole multiples of 2^-1074, places of 2^-2148.
  const [xi, yi, ui, vi, ti] = ball.map(wholeOf), [xk, yk, uk, vk, tk] = other.map(wholeOf);
  const x = ((xk - xi) << 1074n) - uk * tk + ui * ti, u = uk - ui;
  const y = ((yk - yi) << 1074n) - vk * tk + vi * ti, v = vk - vi;
  const [width, height] = period.map(wholeOf);
  if (u === 0n && v === 0n) return true;
  // The relative path winds round the box a and b times.
  let [a, b] = [1n, 0n];
  if (v !== 0n) {
    [a, b] = [u * height, v * width];
    let [divisor, rest] = [a, b];
    while (rest !== 0n) [divisor, rest] = [rest, divisor % rest];
    [a, b] = [a / divisor, b / divisor];
  }
  const apart = (width * height) << 1074n, offset = x * b * height - y * a * width;
  const beside = ((offset % apart) + apart) % apart;
  const nearest = beside < apart - beside ? beside : apart - beside;
  const reach = wholeOf(distance) ** 2n * ((a * width) ** 2n + (b * height) ** 2n);
  return nearest ** 2n >= reach << 2148n;
}

/** A wall that does not move, or none: each hit is predicted exactly. */
class NoMargin {
  constructor() {
    this.until = NEVER;
    this.width = 0;
    this.brink = new Set(); // balls whose hit has been predicted exactly since the last push
  }

  /** Time until ball i hits the wall, s; its partner is then in ``partner``. */
  wallContact(i, now, exact, { state, bounces }) {
    this.partner = NO_PARTNER;
    return state.boundary.delayToWall(i, now, bounces[i] > 0, state);
  }

  push(now, cells) {}

  renew(now, cells) {}
}

/** Where a free container may be until everything is predicted again, see ``Margin`` of cells.py.
 *
 * Predictions use its place at the last renewal, and a wall that is nearer by the margin. Such a
 * hit comes too early, and is predicted exactly when it comes up. Only balls within the margin,
 * which are at the brink, are predicted exactly at once, and again after each push.
 */
class Margin extends NoMargin {
  constructor(width) {
    super();
    this.width = width; // how far it may be from its place then, m
    this.x = this.y = this.until = 0; // its place then, m, and until when, s
  }

  wallContact(i, now, exact, { state, bounces }) {
    const { boundary } = state, age = now - state.clock[i], u = state.u[i], v = state.v[i];
    const x = (state.x[i] + u * age) - this.x, y = (state.y[i] + v * age) - this.y;
    const near = Math.max(boundary.radius - state.radii[i] - this.width, 0);
    if (!exact && x * x + y * y < near * near) {
      this.partner = SEARCH_AGAIN;
      return wallDelay(x, y, u, v, near * near);
    }
    this.brink.add(i);
    this.partner = NO_PARTNER;
    return boundary.delayToWall(i, now, bounces[i] > 0, state);
  }

  /** Predict again what the new velocity of the container changes; its clock is at now. */
  push(now, cells) {
    const { motion } = cells.state.boundary, x = motion[X] - this.x, y = motion[Y] - this.y;
    this.until = now + wallDelay(x, y, motion[U], motion[V], this.width * this.width);
    for (const i of this.brink) {
      cells.enterContact(i, now, SEARCH_AGAIN);
      cells.enqueue(i, now);
    }
    this.brink.clear();
  }

  /** Put the cells round the container's place at a time, s. */
  renew(now, { mesh, state }) {
    const { motion } = state.boundary, age = now - motion[CLOCK];
    this.x = motion[X] + motion[U] * age;
    this.y = motion[Y] + motion[V] * age;
    this.until = now + wallDelay(0, 0, motion[U], motion[V], this.width * this.width);
    mesh.left = this.x - 0.5 * mesh.columns * mesh.width;
    mesh.bottom = this.y - 0.5 * mesh.rows * mesh.height;
  }
}

/** The balls in their cells, and what each does next. */
class Cells {
  constructor(scene, state) {
    const { number } = state, free = scene.containerMass < Infinity;
    this.state = state;
    this.mesh = newMesh(scene);
    this.margin = free ? new Margin(MARGIN * this.mesh.width) : new NoMargin();
    this.renewedAt = state.sums[NOW];
    this.atWall = cellsAtWall(scene, this.mesh, this.margin.width);
    this.occupancy = new Int32Array(this.atWall.length);
    const groups = Math.ceil(number / GROUP);
    this.contactTime = new Float64Array(number);
    this.crossingTime = new Float64Array(number);
    this.nextTime = new Float64Array(groups * GROUP).fill(NEVER);
    this.groupTime = new Float64Array(groups).fill(NEVER);
    const links = ["events", "former", "partner", "partnerEvents", "cell", "place", "bounces"];
    for (const name of links) this[name] = new Int32Array(number);
    this.former.fill(NO_PARTNER);
    this.near = new Int32Array(number);
    this.delays = new Float64Array(2); // across, and up or down
    this.i = this.j = NO_PARTNER;
    this.crossings = 0;
    this.margin.renew(this.renewedAt, this);
    this.fill(LEAST_MEMBERS);
  }

  nextEpoch(shift) {
    for (let k = 0; k < this.state.number; k += 1) {
      this.contactTime[k] -= shift;
      this.crossingTime[k] -= shift;
      this.nextTime[k] -= shift;
    }
    for (let group = 0; group < this.groupTime.length; group += 1) this.groupTime[group] -= shift;
    this.renewedAt -= shift;
    this.margin.until -= shift;
  }

  // Cells

  /** Sort all balls into cells of a capacity, or a larger one, and have each predicted. */
  fill(capacity) {
    const { state, mesh, occupancy } = this, { boundary } = state;
    // As of the last event, or of when cells were put round a free container since.
    const now = Math.max(state.sums[NOW], this.renewedAt);
    this.margin.brink.clear();
    this.capacity = capacity;
    this.members = new Int32Array(occupancy.length * capacity);
    occupancy.fill(0);
    for (let i = 0; i < state.number; i += 1) {
      const age = now - state.clock[i];
      const x = nearestImage(state.x[i] + state.u[i] * age, boundary.periodX);
      const y = nearestImage(state.y[i] + state.v[i] * age, boundary.periodY);
      const column = Math.trunc((x - mesh.left) / mesh.width);
      const row = Math.trunc((y - mesh.bottom) / mesh.height);
      const cell = this.cellAt(
        Math.min(Math.max(column, 0), mesh.columns - 1), Math.min(Math.max(row, 0), mesh.rows - 1),
      );
      if (occupancy[cell] === capacity) return this.fill(2 * capacity);
      this.putInto(i, cell);
      this.predictCrossing(i, now);
      this.enterContact(i, now, NOT_SEARCHED);
      this.enqueue(i, now);
    }
    return undefined;
  }

  /** The cell in a column and a row; along an axis that repeats, beyond the sides too. */
  cellAt(column, row) {
    const { columns, rows } = this.mesh, { boundary } = this.state;
    if (boundary.periodX < Infinity) column = column < 0 ? column + columns : column % columns;
    if (boundary.periodY < Infinity) row = row < 0 ? row + rows : row % rows;
    return row * columns + column;
  }

  putInto(i, cell) {
    const place = this.occupancy[cell];
    this.members[cell * this.capacity + place] = i;
    this.occupancy[cell] = place + 1;
    this.cell[i] = cell;
    this.place[i] = place;
  }

  /** Take ball i out of its cell; the last member takes its place. */
  takeOut(i) {
    const { members, capacity } = this, cell = this.cell[i], place = this.place[i];
    const last = this.occupancy[cell] - 1, moved = members[cell * capacity + last];
    this.occupancy[cell] = last;
    members[cell * capacity + place] = moved;
    this.place[moved] = place;
  }

  /** Append the balls of a cell to ``near``; how many there are then. */
  collect(gathered, column, row) {
    const { near, members, capacity } = this, cell = this.cellAt(column, row);
    const end = this.occupancy[cell];
    for (let place = 0; place < end; place += 1) {
      near[gathered + place] = members[cell * capacity + place];
    }
    return gathered + end;
  }

  /** Time until ball i leaves its cell across, and up or down, in ``delays``; s. */
  crossingDelays(i, now) {
    const { mesh, state } = this, { boundary } = state, cell = this.cell[i];
    const row = Math.floor(cell / mesh.columns), column = cell - row * mesh.columns;
    const age = now - state.clock[i], u = state.u[i], v = state.v[i];
    const x = (state.x[i] + u * age) - (mesh.left + mesh.width * (column + 0.5));
    const y = (state.y[i] + v * age) - (mesh.bottom + mesh.height * (row + 0.5));
    const { width, height } = mesh;
    const across = ((u > 0 ? 0.5 * width : -0.5 * width) - nearestImage(x, boundary.periodX)) / u;
    const up = ((v > 0 ? 0.5 * height : -0.5 * height) - nearestImage(y, boundary.periodY)) / v;
    this.delays[0] = u !== 0 ? across : NEVER;
    this.delays[1] = v !== 0 ? up : NEVER;
  }

  // Entries

  enterContact(i, time, partner) {
    this.contactTime[i] = time;
    this.partner[i] = partner;
    if (partner >= 0) this.partnerEvents[i] = this.events[partner];
  }

  /** Note ball i's earliest event: its contact or a crossing; none is in the past. */
  enqueue(i, now) {
    const { nextTime } = this, group = Math.floor(i / GROUP), end = (group + 1) * GROUP;
    nextTime[i] = Math.max(Math.min(this.contactTime[i], this.crossingTime[i]), now);
    let least = NEVER;
    for (let k = group * GROUP; k < end; k += 1) if (nextTime[k] < least) least = nextTime[k];
    this.groupTime[group] = least;
  }

  predictCrossing(i, now) {
    this.crossingDelays(i, now);
    this.crossingTime[i] = now + Math.min(this.delays[0], this.delays[1]);
  }

  /** The ball that ball i parted from in the last event of both and cannot meet, or NO_PARTNER. */
  partedFrom(i, now) {
    const { x, y, u, v, clock, boundary } = this.state, k = this.former[i];
    if (k < 0 || this.former[k] !== i) return NO_PARTNER;
    // Of two that part, other images may become the nearest, and these may meet.
    const dx = x[k] - x[i], dy = y[k] - y[i], age = now - clock[i];
    const newX = dx + (u[k] - u[i]) * age, newY = dy + (v[k] - v[i]) * age;
    const { periodX, periodY } = boundary;
    if (periodX === Infinity && periodY === Infinity) return k;
    const across = rint(dx / periodX) === rint(newX / periodX);
    return across && rint(dy / periodY) === rint(newY / periodY) ? k : NO_PARTNER;
  }

  /** Enter ball i's first contact with one of those gathered, if it is before ``delay``.
   *
   * partner : of a contact that is earlier than all known ones; NO_ENTRY if the entry has it
   */
  enterNearest(i, now, gathered, delay, partner) {
    const { x, y, u, v, clock, radii, boundary } = this.state, { near } = this;
    const { periodX, periodY } = boundary;
    const parted = this.partedFrom(i, now);
    const ageI = now - clock[i], ui = u[i], vi = v[i], ri = radii[i];
    const xi = x[i] + ui * ageI, yi = y[i] + vi * ageI;
    for (let start = 0; start < gathered; start += BLOCK) {
      const stop = Math.min(start + BLOCK, gathered);
      let twice = 2 * delay;
      for (let place = start; place < stop; place += 1) {
        const k = near[place], age = now - clock[k], uk = u[k], vk = v[k];
        const dx = nearestImage((x[k] + uk * age) - xi, periodX);
        const dy = nearestImage((y[k] + vk * age) - yi, periodY);
        const itsDelay = pairDelay(dx, dy, uk - ui, vk - vi, ri + radii[k], twice);
        if (itsDelay < delay && k !== parted) {
          delay = itsDelay;
          partner = k;
          twice = Math.min(twice, NEARLY_TWICE * delay);
        }
      }
    }
    if (partner !== NO_ENTRY) this.enterContact(i, now + delay, partner);
  }

  /** Enter ball i's earliest contact, with a ball or with the wall. */
  predictContact(i, now, exact) {
    const { margin, mesh } = this, cell = this.cell[i];
    let delay = NEVER, partner = SEARCH_AGAIN, gathered = 0;
    if (this.atWall[cell]) {
      delay = margin.wallContact(i, now, exact, this);
      partner = margin.partner;
    }
    const row = Math.floor(cell / mesh.columns), column = cell - row * mesh.columns;
    for (let up = -1; up <= 1; up += 1) {
      for (let right = -1; right <= 1; right += 1) {
        gathered = this.collect(gathered, column + right, row + up);
      }
    }
    this.enterNearest(i, now, gathered, delay, partner);
  }

  /** Move ball i into the next cell and look at the far side; false if that cell is full. */
  cross(i, now) {
    const { state, margin, mesh, delays } = this;
    this.crossingDelays(i, now);
    const sideways = delays[0], upwards = delays[1], across = sideways <= upwards;
    const w = across ? state.u[i] : state.v[i], step = w > 0 ? 1 : -1;
    const right = across ? step : 0, up = across ? 0 : step;
    const oldRow = Math.floor(this.cell[i] / mesh.columns);
    const oldColumn = this.cell[i] - oldRow * mesh.columns;
    const cell = this.cellAt(oldColumn + right, oldRow + up);
    if (this.occupancy[cell] === this.capacity) return false;
    this.takeOut(i);
    this.putInto(i, cell);
    const row = Math.floor(cell / mesh.columns), column = cell - row * mesh.columns;
    const side = across ? mesh.width : mesh.height;
    this.crossingTime[i] = now + Math.min(side / Math.abs(w), across ? upwards : sideways);
    let delay = this.contactTime[i] - now, partner = NO_ENTRY, gathered = 0;
    if (this.atWall[cell]) {
      const wall = margin.wallContact(i, now, false, this);
      if (wall < delay) {
        delay = wall;
        partner = margin.partner;
      }
    }
    for (let along = -1; along <= 1; along += 1) {
      gathered = this.collect(
        gathered, column + (across ? right : along), row + (across ? along : up),
      );
    }
    this.enterNearest(i, now, gathered, delay, partner);
    return true;
  }

  // Events

  /** Find the ball of the next event and its partner or the wall; the time on clocks, s.
   *
   * Ties go by time and ball. Crossings, stale entries and renewals of the margin on the way are
   * carried out, up to a time.
   * After very many crossings there is no event yet, and the partner is NOT_SEARCHED.
   */
  nextEvent(until) {
    const { nextTime, groupTime, contactTime, margin, state } = this;
    const end = Math.min(until, state.sums[TIME_LIMIT]);
    let crossings = 0;
    for (;;) {
      let group = 0, now = groupTime[0];
      for (let k = 1; k < groupTime.length; k += 1) {
        if (groupTime[k] < now) {
          now = groupTime[k];
          group = k;
        }
      }
      let i = group * GROUP;
      while (nextTime[i] !== now) i += 1;
      this.i = i;
      this.j = this.partner[i];
      const validUntil = Math.min(now, margin.until);
      if (validUntil === NEVER || validUntil > end) return validUntil;
      if (crossings >= CROSSINGS_AT_ONCE && (contactTime[i] > now || validUntil < now)) {
        if (this.crossings === 0 && this.nothingCanMeet()) return NEVER;
        this.j = NOT_SEARCHED;
        this.crossings += crossings;
        return validUntil;
      }
      if (validUntil < now) {
        crossings += RENEWAL + state.number;
        this.renewedAt = validUntil;
        margin.renew(validUntil, this);
        this.fill(this.capacity);
      } else if (contactTime[i] > now) {
        crossings += 1;
        if (this.cross(i, now)) {
          this.enqueue(i, now);
        } else {
          this.fill(2 * this.capacity);
        }
      } else if (this.isStale(i, this.j)) {
        // SEARCH_AGAIN: a lower bound of a free wall's hit has come up; now find it exactly.
        this.predictContact(i, now, this.j === SEARCH_AGAIN);
        this.enqueue(i, now);
      } else {
        this.crossings = 0;
        return now;
      }
    }
  }

  /** Whether it is certain that no ball meets another, or the wall of a free container. */
  nothingCanMeet() {
    const { x, y, u, v, clock, radii, boundary, number } = this.state;
    const { motion, periodX, periodY } = boundary, free = boundary instanceof FreeCircle;
    const repeats = periodY < Infinity, walls = repeats && periodX === Infinity; // left and right
    if (walls && u.some((speed) => speed !== 0)) return false;
    // Of the least speeds the square is zero, and predictions find no contact.
    const spread = (speeds) => (Math.max(...speeds) - Math.min(...speeds)) ** 2;
    const [across, up] = free ? [[...u, motion[U]], [...v, motion[V]]] : [u, v];
    if (spread(across) === 0 && spread(up) === 0) return repeats || free;
    if (!repeats) return false;
    const period = [walls ? 2 * boundary.halfWidth : periodX, periodY];
    const balls = Array.from(radii, (_, k) => [x[k], y[k], u[k], v[k], clock[k]]);
    for (let i = 0; i < number; i += 1) {
      for (let k = i + 1; k < number; k += 1) {
        if (!neverMeet(balls[i], balls[k], radii[i] + radii[k], period)) return false;
      }
    }
    return true;
  }

  isStale(i, j) {
    return j >= 0 ? this.partnerEvents[i] !== this.events[j] : j !== NO_PARTNER;
  }

  /** Predict what balls i and j do after their event; whether i is trapped at the wall for good. */
  afterEvent(i, j, now) {
    const { state, events, former, bounces } = this, { setup } = state;
    events[i] += 1;
    former[i] = j;
    let trapped = false;
    if (j === NO_PARTNER) {
      bounces[i] += 1;
      this.margin.push(now, this);
      const often = bounces[i] > 1 || setup.wallLaw.mayStay();
      if (setup.wallLaw.isEndless(bounces[i])) {
        trapped = true;
      } else if (setup.traps && often && (bounces[i] & (bounces[i] - 1)) === 0) {
        const lasts = bouncingTime(i, now, state); // after 2, 4, 8 … bounces
        trapped = isTrapped(i, now, lasts, false, state);
      }
    } else {
      events[j] += 1;
      former[j] = i;
      bounces[i] = bounces[j] = 0;
    }
    this.predict(i, now);
    if (j !== NO_PARTNER) this.predict(j, now);
    return trapped;
  }

  predict(i, now) {
    this.predictCrossing(i, now);
    this.predictContact(i, now, false);
    this.enqueue(i, now);
  }
}
