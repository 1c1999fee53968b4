"use strict";

// What happens in a collision, as in engine/collision.py, contact.py, wall_laws.py and laws.py.
//
// These scripts are the program's engine once more: the same names, and the same arithmetic in the
// same order, so that all bits are equal. Only + - * / and Math.sqrt, which are exactly rounded,
// change the state. There are no vectors; a search takes the same minimum, of equal ones the same
// ball. docs/how-it-works.md explains the ideas; CONTRIBUTING.md says which script is which file.
//
// Balls are arrays with one element each: x, y (m), u, v (m/s), clock (s), radii (m), masses (kg).
// A ball moves only in its own events; ``age`` is the time since then, and ``its`` that since the
// last hit of a container that moves.

const NEVER = Infinity;
const NO_PARTNER = -1; // the wall
const SLIDE = -2; // the same in an event that sums up a motion along the wall
const SEARCH_AGAIN = -2; // no ball, or no certain wall, up to a time; never recorded
const NOT_SEARCHED = -3;
const NO_LIMIT = 2 ** 62;

// Elements of ``sums``, see kernel_state.py.
const CONTACT_LASTS = 0, EPOCH = 1, NOW = 2, STILL_SINCE = 3, TIME_LIMIT = 4;
const WALL_IMPULSE = 5, PAIR_VIRIAL = 6, REST = 2, SUMS = 9;

// Elements of ``counts``.
const WALL_EVENTS = 0, PAIR_EVENTS = 1, FIRST = 2, SECOND = 3, STALLED = 4, INVOLVED = 5, COUNTS = 6;

// Elements of the container's ``motion``: place, velocity and clock, zeros if it is fixed.
const X = 0, Y = 1, U = 2, V = 3, CLOCK = 4;

// Why a repeat stops; null while it continues.
const TIME = "time", NOTHING_LEFT = "nothing_left", WALL_TRAP = "wall_trap";
const COLLAPSE = "collapse", COLLISIONS = "collisions", IDLE = "idle";

// Results of several numbers, in the same memory each time: a place (m) and a velocity (m/s).
const placed = new Float64Array(4);

// Bits

const SPLITTER = 134217729; // 2^27 + 1
const LEAST_PRODUCT = 2 ** -960; // below, parts of Dekker's product may be no doubles

/** a b + c, rounded once; c is -a b but for a rounding or two, as all callers have it.
 *
 * The error of the product is exact (Dekker, doi:10.1007/BF01397083), and so are the differences.
 */
function fused(a, b, c) {
  const product = a * b;
  if (Math.abs(product) < LEAST_PRODUCT && a !== 0 && b !== 0) return fusedSlowly(a, b, c);
  let split = SPLITTER * a;
  const highA = split - (split - a), lowA = a - highA;
  split = SPLITTER * b;
  const highB = split - (split - b), lowB = b - highB;
  const error = lowA * lowB - (((product - highA * highB) - lowA * highB) - highA * lowB);
  return (c + product) + error;
}

/** The same for any numbers, with whole multiples of the least double. */
function fusedSlowly(a, b, c) {
  const sum = wholeOf(a) * wholeOf(b) + (wholeOf(c) << 1074n); // over 2^2148
  const size = sum < 0n ? -sum : sum;
  const dropped = Math.max(size.toString(2).length - 53, 1074), unit = 1n << BigInt(dropped);
  let kept = size / unit;
  const twice = 2n * (size % unit);
  if (twice > unit || (twice === unit && kept % 2n === 1n)) kept += 1n;
  return (sum < 0n ? -1 : 1) * Number(kept) * 2 ** (dropped - 2148);
}

/** A double over the least one, 2^-1074: a whole number. */
function wholeOf(value) {
  const bits = new BigUint64Array(new Float64Array([Math.abs(value)]).buffer)[0];
  const power = bits >> 52n, fraction = bits & ((1n << 52n) - 1n);
  const whole = power === 0n ? fraction : (fraction | (1n << 52n)) << (power - 1n);
  return value < 0 ? -whole : whole;
}

/** A number rounded to a whole one, of two equally near ones to the even one. */
function rint(value) {
  const size = Math.abs(value);
  const whole = size < 4503599627370496 ? (size + 4503599627370496) - 4503599627370496 : size;
  return value < 0 ? -whole : whole;
}

/** The size of a number that is not negative, with the sign of another, which may be -0. */
function copySign(size, other) {
  return other < 0 || (other === 0 && 1 / other < 0) ? -size : size;
}

// Contact: times until two balls, or a ball and the wall, touch; see contact.py

/** Time until two balls at relative (x, y), moving at relative (u, v), touch; s, or inf.
 *
 * distance : of their centres when they touch, m
 * twice : twice a horizon, s. The delay may also be inf if the contact is later than that: it is
 *     c / (-b + sqrt(D)) with sqrt(D) <= -b, so at least c / (-2b). This is ``may_touch``.
 */
function pairDelay(x, y, u, v, distance, twice) {
  const b = x * u + y * v;
  const square = distance * distance, c = x * x + y * y - square;
  // In this order, because the second condition is hard for a processor to guess.
  if (!(c + b * twice < 0) || !(b < 0)) return NEVER;
  const cross = x * v - y * u;
  const discriminant = (u * u + v * v) * square - cross * cross;
  if (!(discriminant > 0 || c <= 0)) return NEVER;
  return (c > 0 ? c : 0) / (Math.sqrt(discriminant > 0 ? discriminant : 1) - b);
}

/** Time until a ball at (x, y) from the circle's centre hits the wall; s, or inf at rest. */
function wallDelay(x, y, u, v, reachSquared) {
  const b = x * u + y * v;
  const w2 = u * u + v * v;
  let c = x * x + y * y - reachSquared;
  c = c < 0 ? c : 0;
  const root = Math.sqrt(b * b - w2 * c);
  if (!(w2 > 0)) return NEVER;
  return b > 0 ? -c / (root + b) : (root - b) / w2;
}

/** Time until a ball that has just left the wall at (x, y) is back at it; s, or inf at rest. */
function chordDelay(x, y, u, v) {
  const b = x * u + y * v;
  const w2 = u * u + v * v;
  const inward = b < 0 ? -b : 0;
  return w2 > 0 ? 2 * inward / w2 : NEVER;
}

/** Time until a ball at (x, y) from a box's centre hits a side; s, or inf at rest. */
function sideDelay(x, y, u, v, halfWidth, halfHeight) {
  const across = u !== 0 ? ((u > 0 ? halfWidth : -halfWidth) - x) / u : NEVER;
  const along = v !== 0 ? ((v > 0 ? halfHeight : -halfHeight) - y) / v : NEVER;
  const earlier = across < along ? across : along;
  return earlier > 0 ? earlier : 0;
}

// Collisions, see collision.py

/** The part of (u, v) along (x, y), as a multiple of (x, y); rounded once in effect. */
function normalPart(x, y, u, v) {
  const across = x * x, up = y * y;
  const square = across + up;
  // Knuth's TwoSum: what |x|^2 is more than the rounded one.
  const added = square - across;
  let rest = (across - (square - added)) + (up - added);
  rest += fused(x, x, -across) + fused(y, y, -up);
  const along = u * x + v * y;
  const normal = along / square;
  return normal + (fused(-normal, square, along) - normal * rest) * (1 / square);
}

/** Whether the part of (u, v) along (x, y) is below a speed; never if that is zero. */
function isSlow(x, y, u, v, speed) {
  const normal = u * x + v * y;
  return normal * normal < speed * speed * (x * x + y * y);
}

/** The first ball's part of a change that is divided in proportion n to m; n may be infinite. */
function firstShare(change, m, n) {
  return m <= n ? change - change * (m / (m + n)) : change * (n / (m + n));
}

/** The second ball's part. */
function secondShare(change, m, n) {
  return m <= n ? change * (m / (m + n)) : change - change * (n / (m + n));
}

/** Collide balls i and j, both at the present; the impulse (1 + e) mu |v_n|, kg m/s. */
function hitPair(i, j, state, elastic) {
  const { u, v, masses, setup, boundary } = state;
  const x = nearestImage(state.x[j] - state.x[i], boundary.periodX);
  const y = nearestImage(state.y[j] - state.y[i], boundary.periodY);
  const du = u[i] - u[j], dv = v[i] - v[j];
  const isElastic = elastic || isSlow(x, y, du, dv, setup.elasticBelow);
  const length = Math.sqrt(x * x + y * y), normal = normalPart(x, y, du, dv);
  // Of velocity, over (x, y).
  const change = isElastic ? 2 * normal : setup.pairLaw.kick(normal, length);
  const m = masses[i];
  const first = firstShare(change, m, masses[j]), second = secondShare(change, m, masses[j]);
  u[i] -= first * x;
  v[i] -= first * y;
  u[j] += second * x;
  v[j] += second * y;
  return m * first * length;
}

/** The change of a relative velocity (u, v) in a hit of a circle at (x, y), over (x, y). */
function changeAtCircle(x, y, u, v, setup, elastic) {
  const isElastic = elastic || isSlow(x, y, u, v, setup.elasticBelow), law = setup.wallLaw;
  const normal = normalPart(x, y, u, v), length = Math.sqrt(x * x + y * y);
  if (normal <= 0) return law.recoil(normal, length, isElastic);
  return isElastic ? law.elasticKick(normal, length) : law.kick(normal, length);
}

/** How long a contact lasts in the TC model at the balls' present speeds, s. */
function contactLasts(state) {
  const { u, v, setup } = state, { motion } = state.boundary, number = u.length;
  let total = 0;
  for (let k = 0; k < number; k += 1) {
    const uk = u[k] - motion[U], vk = v[k] - motion[V];
    total += uk * uk + vk * vk;
  }
  return total > 0 ? setup.contactPath / Math.sqrt(total / number) : 0;
}

/** Whether ball i, not yet moved to the present, still has its last contact. */
function inContact(i, now, state) {
  // In the first epoch a clock at zero has not been moved: there was no contact.
  const moved = state.clock[i] > 0 || state.sums[EPOCH] > 0;
  return moved && now - state.clock[i] < state.sums[CONTACT_LASTS];
}

/** Bring ball i to the present, in a periodic box to its image inside. */
function move(i, now, state) {
  const { x, y, boundary } = state, age = now - state.clock[i];
  x[i] = nearestImage(x[i] + state.u[i] * age, boundary.periodX);
  y[i] = nearestImage(y[i] + state.v[i] * age, boundary.periodY);
  state.clock[i] = now;
}

/** Bring balls i and j to the present and collide them; the impulse, kg m/s. */
function collide(i, j, now, state) {
  const { sums, counts } = state;
  const done = counts[WALL_EVENTS] + counts[PAIR_EVENTS];
  if (state.setup.contactPath > 0 && done % state.number === 0) {
    sums[CONTACT_LASTS] = contactLasts(state);
  }
  const elastic = inContact(i, now, state);
  move(i, now, state);
  if (j === NO_PARTNER) return state.boundary.hitWall(i, now, state, elastic);
  const bothElastic = elastic || inContact(j, now, state);
  move(j, now, state);
  return hitPair(i, j, state, bothElastic);
}

/** Add a nonnegative number to a sum, and the rounding error to the sum's rest (Fast2Sum). */
function addUp(sums, which, size) {
  const before = sums[which];
  const after = before + size;
  sums[which] = after;
  sums[which + REST] += size - (after - before);
}

/** Count an event and add up its impulse; a negative j is one at the wall. */
function count(i, j, impulse, state) {
  const { counts, sums, radii } = state;
  if (j < 0) {
    counts[WALL_EVENTS] += 1;
    addUp(sums, WALL_IMPULSE, impulse);
  } else {
    counts[PAIR_EVENTS] += 1;
    addUp(sums, PAIR_VIRIAL, impulse * (radii[i] + radii[j]));
  }
}

// Laws of collision, see laws.py and wall_laws.py

/** What all laws do that have no such method of their own. */
class Law {
  constructor(cor) {
    this.cor = cor;
  }

  get constant() {
    return false;
  }

  get gains() {
    return false;
  }

  elasticKick(normal, length) {
    return 2 * normal;
  }

  recoil(normal, length, elastic) {
    const back = elastic ? this.elasticKick(-normal, length) : this.kick(-normal, length);
    return 2 * normal + back;
  }

  bounceLoss(normal, length) {
    return 0;
  }

  bounceChanges(normal, length) {
    return NEVER;
  }

  mayStay() {
    return this.cor === 0;
  }

  isEndless(bounces) {
    return false;
  }

  /** Collide ball i with a fixed circular wall; the impulse, kg m/s. */
  hitCircle(i, state, elastic) {
    const x = state.x[i], y = state.y[i];
    const change = changeAtCircle(x, y, state.u[i], state.v[i], state.setup, elastic);
    state.u[i] -= change * x;
    state.v[i] -= change * y;
    return Math.abs(state.masses[i] * change * Math.sqrt(x * x + y * y));
  }

  /** Collide ball i with the straight wall ahead of it, left or right if ``across``. */
  hitSide(i, across, state, elastic) {
    const velocity = across ? state.u : state.v;
    const normal = velocity[i], speed = Math.abs(normal);
    const isElastic = elastic || speed < state.setup.elasticBelow;
    const change = isElastic ? this.elasticKick(speed, 1) : this.kick(speed, 1);
    velocity[i] -= copySign(change, normal);
    return state.masses[i] * change;
  }
}

class Constant extends Law {
  get constant() {
    return true;
  }

  kick(normal, length) {
    return (1 + this.cor) * normal;
  }

  recoil(normal, length, elastic) {
    return (1 - (elastic ? 1 : this.cor)) * normal;
  }

  bounceLoss(normal, length) {
    return 1 - this.cor;
  }

  bounceChanges(normal, length) {
    return (1 + this.cor) / (1 - this.cor);
  }
}

class Viscoelastic extends Law {
  constructor(cor, corSpeed) {
    super(cor);
    this.corSpeed = corSpeed;
  }

  kick(normal, length) {
    const root = Math.sqrt(Math.min(Math.abs(normal) * length / this.corSpeed, 1));
    return (2 - (1 - this.cor) * (root * Math.sqrt(root))) * normal;
  }

  bounceLoss(normal, length) {
    const part = normal * length / this.corSpeed;
    if (part === 0) return 1;
    const root = Math.sqrt(Math.min(part, 1));
    const share = part < 1 ? 0.25 * root * Math.sqrt(root) : part / (3 + part);
    return (1 - this.cor) * share;
  }

  bounceChanges(normal, length) {
    return 2 / this.bounceLoss(normal, length);
  }

  isEndless(bounces) {
    return bounces >= 2 ** 20;
  }
}

class Driven extends Law {
  constructor(cor, speed) {
    super(cor);
    this.speed = speed;
  }

  get gains() {
    return true;
  }

  kick(normal, length) {
    return (1 + this.cor) * (normal + this.speed / length);
  }

  elasticKick(normal, length) {
    return this.kick(normal, length);
  }
}

class Thermal extends Law {
  constructor(temperature) {
    super(0);
    this.temperature = temperature;
  }

  get gains() {
    return true;
  }

  mayStay() {
    return false;
  }

  hitCircle(i, state, elastic) {
    return leave(i, state.x[i], state.y[i], this.temperature, state);
  }

  hitSide(i, across, state, elastic) {
    const x = across ? copySign(1, state.u[i]) : 0, y = across ? 0 : copySign(1, state.v[i]);
    return leave(i, x, y, this.temperature, state);
  }
}

class Sides extends Law {
  constructor(left, right, bottom, top) {
    super(Math.min(left.cor, right.cor, bottom.cor, top.cor));
    Object.assign(this, { left, right, bottom, top });
  }

  get gains() {
    return [this.left, this.right, this.bottom, this.top].some((law) => law.gains);
  }

  mayStay() {
    return false;
  }

  hitSide(i, across, state, elastic) {
    let law = state.v[i] > 0 ? this.top : this.bottom;
    if (across) law = state.u[i] > 0 ? this.right : this.left;
    return law.hitSide(i, across, state, elastic);
  }
}

/** The law of a scene's plain description. */
function lawOf(plain) {
  const { word, cor } = plain;
  if (word === "constant") return new Constant(cor);
  if (word === "viscoelastic") return new Viscoelastic(cor, plain.corSpeed);
  if (word === "driven") return new Driven(cor, plain.speed);
  if (word === "thermal") return new Thermal(plain.temperature);
  return new Sides(...SIDES.map((side) => lawOf(plain[side])));
}

/** Give ball i a random velocity away from a wall towards (x, y); its impulse, kg m/s. */
function leave(i, x, y, temperature, state) {
  const { u, v, counts } = state, m = state.masses[i];
  const seed = state.key + mixed(BigInt(counts[WALL_EVENTS] + counts[PAIR_EVENTS]));
  const start = mixed(BigInt.asUintN(64, seed));
  const spread = Math.sqrt(temperature / m);
  const inwards = spread * Math.sqrt(-2 * logarithm(uniform(start, 0)));
  // Marsaglia's polar method, doi:10.1137/1006063.
  let across = 0, square = 0, tried = 0;
  while (!(square > 0 && square <= 1)) {
    across = 2 * uniform(start, 2 * tried + 1) - 1;
    const up = 2 * uniform(start, 2 * tried + 2) - 1;
    square = across * across + up * up;
    tried += 1;
  }
  const along = spread * (across * Math.sqrt(-2 * logarithm(square) / square));
  const length = Math.sqrt(x * x + y * y);
  x /= length;
  y /= length;
  const outwards = u[i] * x + v[i] * y;
  u[i] = -inwards * x - along * y;
  v[i] = -inwards * y + along * x;
  return m * Math.max(outwards + inwards, 0);
}

/** SplitMix64 of 64 bits (Steele, Lea & Flood, doi:10.1145/2714064.2660195). */
function mixed(bits) {
  let z = BigInt.asUintN(64, bits + 0x9e3779b97f4a7c15n);
  z = BigInt.asUintN(64, (z ^ (z >> 30n)) * 0xbf58476d1ce4e5b9n);
  z = BigInt.asUintN(64, (z ^ (z >> 27n)) * 0x94d049bb133111ebn);
  return z ^ (z >> 31n);
}

/** The number at a place of a sequence, from 2^-53 to 1. */
function uniform(seed, place) {
  return (Number(mixed(BigInt.asUintN(64, seed + BigInt(place))) >> 11n) + 1) * 2 ** -53;
}

/** Natural logarithm of a number from 2^-106 to 1. */
function logarithm(value) {
  let exponent = 0;
  while (value < 2 ** -32) {
    value *= 2 ** 32;
    exponent -= 32;
  }
  while (value < 0.7071067811865476) {
    value *= 2;
    exponent -= 1;
  }
  const z = (value - 1) / (value + 1);
  const square = z * z;
  let series = 1 / 23;
  for (let odd = 21; odd > 0; odd -= 2) series = series * square + 1 / odd;
  return exponent * 0.6931471805599453 + 2 * z * series;
}

