"use strict";

// Balls that slide along a fixed circular wall after infinitely many bounces, as
// snooker_cli/engine/sliding.py: a is the distance of the ball's centre from that of the circle,
// v_n and v_t are the normal and the tangential part of its velocity, e is the wall's CoR.

const FLIES = 0, SETTLES = 1, SLIDES = 2; // SETTLES: it bounces until it slides
const FLAT = 2 ** -27; // normal over tangential speed below which its square does not count
const NEARLY_ELASTIC = 1e-3, HALVINGS = 7;
const STEPS = 512; // towards a contact, after which a ball searches again from there
const SHORT = 2 ** -46; // part of the container's radius that is the rounding of a few places

const turn = new Float64Array(2); // the result of ``turnBy``

/** Cosine and sine of an angle, to an ulp or two up to 1e5, in ``turn``; polynomials of fdlibm. */
function turnBy(angle) {
  const quarters = rint(angle * 0.63661977236758134308);
  const z = ((angle - quarters * 1.57079632673412561417e00) - quarters * 6.07710050630396597660e-11)
    - quarters * 2.02226624879595063154e-21;
  const w = z * z;
  let sine = 1.58969099521155010221e-10;
  sine = sine * w - 2.50507602534068634195e-08;
  sine = sine * w + 2.75573137070700676789e-06;
  sine = sine * w - 1.98412698298579493134e-04;
  sine = sine * w + 8.33333333332248946124e-03;
  sine = sine * w - 1.66666666666666324348e-01;
  sine = z + z * w * sine;
  let cosine = -1.13596475577881948265e-11;
  cosine = cosine * w + 2.08757232129817482790e-09;
  cosine = cosine * w - 2.75573143513906633035e-07;
  cosine = cosine * w + 2.48015872894767294178e-05;
  cosine = cosine * w - 1.38888888888741095749e-03;
  cosine = cosine * w + 4.16666666666666019037e-02;
  cosine = 1 - (0.5 * w - w * w * cosine);
  const turns = quarters - 4 * Math.floor(0.25 * quarters);
  if (turns === 1 || turns === 3) [cosine, sine] = [-sine, cosine];
  turn[0] = turns < 2 ? cosine : -cosine;
  turn[1] = turns < 2 ? sine : -sine;
}

/** Sum of q e^k/(1 + (q e^k)^2) over all k from 0.
 *
 * q : normal over tangential speed after a hit; 2 a/v_t times the sum is how long all chords last
 */
function chordSum(q, restitution) {
  const d = 1 - restitution;
  let total = 0;
  if (d > NEARLY_ELASTIC) {
    while (q > FLAT && q < Infinity) {
      total += q / (1 + q * q);
      q *= restitution;
    }
    return total + q / d;
  }
  const h = d * (1 + d * (1 / 2 + d * (1 / 3 + d * (1 / 4 + d * (1 / 5 + d / 6))))); // -ln e
  q = Math.min(q, 1e150); // whose square is finite; its arc tangent is already pi/2
  total = q / (1 + q * q) * (0.5 + h / 12 * (2 / (1 + q * q) - 1));
  for (let k = 0; k < HALVINGS; k += 1) q = q / (1 + Math.sqrt(1 + q * q));
  const z = q * q;
  const arc = q * (1 - z * (1 / 3 - z * (1 / 5 - z * (1 / 7 - z / 9))));
  return total + 2 ** HALVINGS * arc / h;
}

/** How long the bounces of ball i, trapped just off the wall, last, s; their impulse, kg m/s. */
function bouncesToCome(i, state) {
  const { motion } = state.boundary, law = state.setup.wallLaw, e = law.cor;
  const its = state.clock[i] - motion[CLOCK];
  const x = state.x[i] - (motion[X] + motion[U] * its);
  const y = state.y[i] - (motion[Y] + motion[V] * its);
  const u = state.u[i] - motion[U], v = state.v[i] - motion[V];
  const square = x * x + y * y, inward = Math.max(-(x * u + y * v), 0);
  const cross = Math.abs(x * v - y * u), mass = state.boundary.bouncingMass(state.masses[i]);
  if (!law.constant) {
    const distance = Math.sqrt(square), changes = law.bounceChanges(inward / square, distance);
    return [bouncingTime(i, state.sums[NOW], state), mass * changes * inward / distance];
  }
  if (e === 0) return [0, 0];
  const lasts = 2 * (square / cross) * chordSum(inward / cross, e);
  const share = (1 + e) / (1 - e);
  return [lasts, mass * share * inward / Math.sqrt(square)];
}

/** Where ball i, just off the wall and trapped, is at a time, s; its impulse on the wall.
 *
 * If it bounces infinitely often until then, this is where and when it begins to slide.
 */
function bounced(i, until, state) {
  const e = state.boundary.cors[i];
  let x = state.x[i], y = state.y[i], u = state.u[i], v = state.v[i], now = state.clock[i];
  const square = x * x + y * y, cross = x * v - y * u; // a v_t
  let inward = Math.max(-(x * u + y * v), 0); // a v_n
  let c = 1, s = 0, given = 0, along, aside;
  let flat = inward <= FLAT * Math.abs(cross);
  while (!flat) {
    const chord = inward * inward + cross * cross;
    const end = now + 2 * inward * square / chord;
    if (end > until) break;
    along = (cross * cross - inward * inward) / chord;
    aside = 2 * inward * cross / chord;
    [c, s] = [c * along - s * aside, s * along + c * aside];
    given += (1 + e) * inward;
    inward *= e;
    now = end;
    flat = inward <= FLAT * Math.abs(cross);
  }
  if (flat) {
    const rest = inward / (1 - e);
    let end = now + 2 * rest * square / (cross * cross);
    if (end <= until) {
      turnBy(2 * rest / cross);
      given += (1 + e) * rest;
    } else { // it seems to slide already
      end = until;
      turnBy(cross / square * (until - now));
    }
    [along, aside] = turn;
    [c, s] = [c * along - s * aside, s * along + c * aside];
    inward = 0;
    now = end;
  }
  const length = Math.sqrt(c * c + s * s); // 1 but for many roundings
  c /= length;
  s /= length;
  [x, y] = [c * x - s * y, s * x + c * y];
  u = (-inward * x - cross * y) / square;
  v = (-inward * y + cross * x) / square;
  return { x, y, u, v, clock: now, impulse: state.masses[i] * given / Math.sqrt(square) };
}

/** How fast ball i turns round the centre, rad/s. */
function angularVelocity(i, { x, y, u, v }) {
  return (x[i] * v[i] - y[i] * u[i]) / (x[i] * x[i] + y[i] * y[i]);
}

/** Time until a ball on an arc touches one that flies, and whether it does; see ``arc_delay``.
 *
 * If not, it is a time up to which they do not touch: inf if not before the horizon.
 */
function arcDelay([x, y, w, px, py, pu, pv, speed], distance, largest, horizon) {
  const a = Math.sqrt(x * x + y * y);
  const bend = largest * w * w * a;
  const inner = a - distance;
  const least = SHORT * a / speed;
  const tangible = 4 * SHORT * distance * speed;
  const slack = 8 * SHORT * distance * a;
  let t = 0;
  for (let k = 0; k < STEPS; k += 1) {
    turnBy(w * t);
    const c = turn[0], s = turn[1];
    const ax = c * x - s * y, ay = s * x + c * y;
    const bx = px + pu * t, by = py + pv * t;
    let step;
    if (inner > 0 && bx * bx + by * by < inner * inner) {
      step = (1 - SHORT) * wallDelay(bx, by, pu, pv, inner * inner);
    } else {
      const dx = bx - ax, dy = by - ay;
      let g = dx * dx + dy * dy - distance * distance;
      let fall = -2 * (dx * (pu + w * ay) + dy * (pv - w * ax));
      if (g <= 0 && fall > tangible) return [t, true];
      if (fall > tangible) {
        step = 2 * g / (fall + Math.sqrt(fall * fall + 4 * bend * g));
        if (step <= least) return [t, true];
      } else if (bend > 0) {
        fall = Math.min(fall, 0);
        g = Math.max(g, 0) + slack;
        step = (Math.sqrt(fall * fall + 4 * bend * g) - fall) / (2 * bend);
      } else {
        return [NEVER, false];
      }
    }
    t += Math.max(step, least);
    if (!(t < horizon)) return [NEVER, false];
  }
  return [t, false];
}

/** A fixed circular wall at which trapped balls slide. */
class SlidingCircle extends FixedCircle {
  constructor(radius, number) {
    super(radius);
    this.isCurved = true;
    this.motions = new Int32Array(number); // FLIES, SETTLES or SLIDES
    this.cors = new Float64Array(number); // of the wall, for bounces of a ball that settles
  }

  place(i, now, state) {
    if (this.motions[i] !== SLIDES) return super.place(i, now, state);
    const { x, y, u, v } = state;
    turnBy(angularVelocity(i, state) * (now - state.clock[i]));
    const c = turn[0], s = turn[1];
    placed[0] = c * x[i] - s * y[i];
    placed[1] = s * x[i] + c * y[i];
    placed[2] = c * u[i] - s * v[i];
    placed[3] = s * u[i] + c * v[i];
    return undefined;
  }

  placeToShow(i, now, state) {
    if (this.motions[i] !== SETTLES) return this.place(i, now, state);
    const ball = bounced(i, now, state), age = now - ball.clock;
    placed[0] = ball.x + ball.u * age;
    placed[1] = ball.y + ball.v * age;
    placed[2] = ball.u;
    placed[3] = ball.v;
    return undefined;
  }

  // What the event loop asks

  /** Which of balls i and j slides or settles up to now, before the two collide; or NO_PARTNER. */
  sliderOf(i, j, now, { clock }) {
    const { motions } = this;
    if (motions[i] === SETTLES || (motions[i] === SLIDES && clock[i] < now)) return i;
    return j >= 0 && motions[j] === SLIDES && clock[j] < now ? j : NO_PARTNER;
  }

  settles(i) {
    return this.motions[i] === SETTLES;
  }

  /** When ball i, which has just hit the wall, begins to slide, s; never if it does not. */
  settle(i, trapped, now, state) {
    const x = state.x[i], y = state.y[i], u = state.u[i], v = state.v[i];
    const inward = Math.max(-(x * u + y * v), 0), cross = x * v - y * u;
    const square = (1 - state.setup.wallLaw.cor) * cross * cross;
    // From then on bounces are shorter than the rounding of the clock.
    const least = CLOCK_DIGITS * (state.sums[EPOCH] + now) * square;
    if (trapped || (cross !== 0 && 2 * inward * (x * x + y * y) <= least)) {
      this.motions[i] = SETTLES;
      this.cors[i] = state.setup.wallLaw.cor;
      return bounced(i, NEVER, state).clock;
    }
    return NEVER;
  }

  takeOffWall(i) {
    const slid = this.motions[i] === SLIDES;
    if (slid) this.motions[i] = FLIES;
    return slid;
  }

  bothFly(i, k) {
    return this.motions[i] === FLIES && this.motions[k] === FLIES;
  }

  searchedUntil(time, early) {
    return early ? time : NEVER;
  }

  /** When ball i first touches another, if one of them slides, and which, if before ``delay``. */
  earliestOnArc(i, now, delay, partner, state, wallTime) {
    const { motions } = this, rim = this.radius, { u, v, radii } = state;
    this.place(i, now, state);
    const xi = placed[0], yi = placed[1];
    const wi = motions[i] === SLIDES ? angularVelocity(i, state) : 0;
    for (let k = 0; k < state.number; k += 1) {
      if (k === i || motions[k] === SETTLES) continue;
      if (motions[i] !== SLIDES && motions[k] !== SLIDES) continue;
      this.place(k, now, state);
      const xk = placed[0], yk = placed[1];
      let until = delay, way;
      if (motions[i] === SLIDES && motions[k] === SLIDES) {
        const wk = angularVelocity(k, state), speed = (Math.abs(wi) + Math.abs(wk)) * rim;
        if (Math.abs(wi - wk) * rim <= 8 * SHORT * speed) continue; // side by side
        way = [xi, yi, wi - wk, xk, yk, 0, 0, speed];
      } else if (motions[i] === SLIDES) {
        until = Math.min(delay, wallTime[k] - now);
        const speed = Math.abs(wi) * rim + Math.sqrt(u[k] * u[k] + v[k] * v[k]);
        way = [xi, yi, wi, xk, yk, u[k], v[k], speed];
      } else {
        const wk = angularVelocity(k, state);
        const speed = Math.abs(wk) * rim + Math.sqrt(u[i] * u[i] + v[i] * v[i]);
        way = [xk, yk, wk, xi, yi, u[i], v[i], speed];
      }
      const [itsDelay, touches] = arcDelay(way, radii[i] + radii[k], 2 * rim, until);
      if (itsDelay < delay) {
        delay = itsDelay;
        partner = touches ? k : SEARCH_AGAIN;
      }
    }
    return [delay, partner];
  }

  /** Bring ball i to where it begins to slide, or slides, now; its impulse on the way, kg m/s. */
  slide(i, now, state) {
    const { x, y, u, v, clock } = state;
    let size;
    if (this.motions[i] === SLIDES) {
      const w = angularVelocity(i, state), reach = Math.sqrt(x[i] * x[i] + y[i] * y[i]);
      size = state.masses[i] * w * w * reach * (now - clock[i]);
      this.place(i, now, state);
      [x[i], y[i], u[i], v[i]] = placed;
    } else {
      const ball = bounced(i, NEVER, state);
      size = ball.impulse;
      // It begins exactly on its circle, so that the roundings of many bounces do not add up.
      const part = (this.radius - state.radii[i]) / Math.sqrt(ball.x * ball.x + ball.y * ball.y);
      x[i] = ball.x * part;
      y[i] = ball.y * part;
      u[i] = ball.u;
      v[i] = ball.v;
      this.motions[i] = SLIDES;
    }
    clock[i] = now;
    return size;
  }
}
