"use strict";

// Boundaries: what balls do at the edge of the container, as in engine/boundaries.py

/** An offset along an axis to the nearest image, m; most are near already and need no division.
 *
 * period : after which way the container repeats along the axis, m; infinite with walls
 */
function nearestImage(offset, period) {
  const isNear = offset < 0.49 * period && offset > -0.49 * period;
  return isNear ? offset : offset - period * rint(offset / period);
}

/** An edge without walls, and what all others have in common. */
class Boundary {
  constructor(periodX = Infinity, periodY = Infinity) {
    this.periodX = periodX;
    this.periodY = periodY;
    this.motion = new Float64Array(5);
    this.isCurved = false; // whether balls may slide, see sliding.js
  }

  delayToWall(i, now, leftWall, state) {
    return NEVER;
  }

  delayToNextHit(i, state) {
    return NEVER;
  }

  hitWall(i, now, state, elastic) {
    return 0;
  }

  searchTime(delay) {
    return delay;
  }

  searchedUntil(time, early) {
    return NEVER;
  }

  predictWalls(now, state, agenda) {}

  pushedSpeed(i, inward, state) {
    return 0;
  }

  bouncingMass(mass) {
    return mass;
  }

  wallComesNear(k, x, y, way, state) {
    return false;
  }

  takeOffWall(i) {
    return false;
  }

  settle(i, trapped, now, state) {
    return NEVER;
  }

  /** Where ball i is at a time, m, and its velocity, m/s, in ``placed``. */
  place(i, now, state) {
    const age = now - state.clock[i];
    placed[0] = state.x[i] + state.u[i] * age;
    placed[1] = state.y[i] + state.v[i] * age;
    placed[2] = state.u[i];
    placed[3] = state.v[i];
  }

  /** As ``place``, also of a ball that bounces until it slides. */
  placeToShow(i, now, state) {
    this.place(i, now, state);
  }
}

class FixedCircle extends Boundary {
  constructor(radius) {
    super();
    this.radius = radius;
  }

  delayToWall(i, now, leftWall, state) {
    const age = now - state.clock[i];
    if (leftWall) return this.delayToNextHit(i, state) - age;
    const u = state.u[i], v = state.v[i], reach = this.radius - state.radii[i];
    return wallDelay(state.x[i] + u * age, state.y[i] + v * age, u, v, reach * reach);
  }

  delayToNextHit(i, state) {
    return chordDelay(state.x[i], state.y[i], state.u[i], state.v[i]);
  }

  hitWall(i, now, state, elastic) {
    return state.setup.wallLaw.hitCircle(i, state, elastic);
  }
}

class FreeCircle extends Boundary {
  constructor(radius, mass, searchFactor, motion) {
    super();
    Object.assign(this, { radius, mass, searchFactor, motion });
  }

  delayToWall(i, now, leftWall, state) {
    const { motion } = this, age = now - state.clock[i];
    if (leftWall && motion[CLOCK] === state.clock[i]) { // no ball has hit it since
      return this.delayToNextHit(i, state) - age;
    }
    const u = state.u[i], v = state.v[i], its = now - motion[CLOCK];
    const x = (state.x[i] + u * age) - (motion[X] + motion[U] * its);
    const y = (state.y[i] + v * age) - (motion[Y] + motion[V] * its);
    const reach = this.radius - state.radii[i];
    return wallDelay(x, y, u - motion[U], v - motion[V], reach * reach);
  }

  delayToNextHit(i, state) {
    const { motion } = this, its = state.clock[i] - motion[CLOCK];
    const x = state.x[i] - (motion[X] + motion[U] * its);
    const y = state.y[i] - (motion[Y] + motion[V] * its);
    return chordDelay(x, y, state.u[i] - motion[U], state.v[i] - motion[V]);
  }

  hitWall(i, now, state, elastic) {
    const { motion } = this, its = now - motion[CLOCK];
    motion[X] += motion[U] * its;
    motion[Y] += motion[V] * its;
    motion[CLOCK] = now;
    const x = state.x[i] - motion[X], y = state.y[i] - motion[Y], m = state.masses[i];
    const u = state.u[i] - motion[U], v = state.v[i] - motion[V];
    const change = changeAtCircle(x, y, u, v, state.setup, elastic);
    const first = firstShare(change, m, this.mass), second = secondShare(change, m, this.mass);
    motion[U] += second * x;
    motion[V] += second * y;
    state.u[i] -= first * x;
    state.v[i] -= first * y;
    return Math.abs(m * first * Math.sqrt(x * x + y * y));
  }

  searchTime(delay) {
    return delay * this.searchFactor;
  }

  searchedUntil(time, early) {
    return time;
  }

  predictWalls(now, state, agenda) {
    const { x, y, u, v, clock, radii } = state, { motion } = this; // whose clock is at now
    for (let k = 0; k < state.number; k += 1) {
      const age = now - clock[k], reach = this.radius - radii[k];
      const xk = (x[k] + u[k] * age) - motion[X], yk = (y[k] + v[k] * age) - motion[Y];
      const time = now + wallDelay(xk, yk, u[k] - motion[U], v[k] - motion[V], reach * reach);
      agenda.wallTime[k] = time;
      agenda.nextTime[k] = Math.min(time, agenda.pairTime[k]);
    }
  }

  pushedSpeed(i, inward, state) {
    const m = state.masses[i], u = this.motion[U], v = this.motion[V];
    const changes = state.setup.wallLaw.bounceChanges(inward, 1);
    return changes * (inward * (m / (m + this.mass))) + Math.sqrt(u * u + v * v);
  }

  bouncingMass(mass) {
    return mass / (1 + mass / this.mass);
  }

  wallComesNear(k, x, y, way, state) {
    const dx = x - this.motion[X], dy = y - this.motion[Y];
    return this.radius - state.radii[k] - Math.sqrt(dx * dx + dy * dy) <= way;
  }
}

class StraightWalls extends Boundary {
  constructor(width, height) {
    super();
    this.halfWidth = width / 2;
    this.halfHeight = height / 2;
  }

  delayToWall(i, now, leftWall, state) {
    const age = now - state.clock[i], r = state.radii[i], u = state.u[i], v = state.v[i];
    const x = state.x[i] + u * age, y = state.y[i] + v * age;
    return sideDelay(x, y, u, v, this.halfWidth - r, this.halfHeight - r);
  }

  hitWall(i, now, state, elastic) {
    const r = state.radii[i], x = state.x[i], y = state.y[i], u = state.u[i], v = state.v[i];
    const across = u !== 0 ? this.halfWidth - r - (u > 0 ? x : -x) : NEVER;
    const along = v !== 0 ? this.halfHeight - r - (v > 0 ? y : -y) : NEVER;
    // The nearest side ahead.
    return state.setup.wallLaw.hitSide(i, across <= along, state, elastic);
  }
}

class ChannelSides extends Boundary {
  constructor(width, height) {
    super(Infinity, height);
    this.halfWidth = width / 2;
  }

  delayToWall(i, now, leftWall, state) {
    const u = state.u[i], x = state.x[i] + u * (now - state.clock[i]);
    const reach = this.halfWidth - state.radii[i];
    return u !== 0 ? Math.max(((u > 0 ? reach : -reach) - x) / u, 0) : NEVER;
  }

  hitWall(i, now, state, elastic) {
    return state.setup.wallLaw.hitSide(i, true, state, elastic);
  }
}
