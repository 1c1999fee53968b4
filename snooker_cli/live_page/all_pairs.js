"use strict";

// The engine for few balls in a circle: each keeps its earliest contact, found against all others.

// Wall traps: infinitely many hits of a circle in finite time, see prediction.py

/** How long infinitely many hits of ball i, just off the wall, last at most, s; inf without. */
function bouncingTime(i, now, state) {
  const { motion } = state.boundary, its = now - motion[CLOCK];
  const x = state.x[i] - (motion[X] + motion[U] * its);
  const y = state.y[i] - (motion[Y] + motion[V] * its);
  const u = state.u[i] - motion[U], v = state.v[i] - motion[V];
  const inward = Math.max(-(x * u + y * v), 0), cross = x * v - y * u;
  if (cross === 0) return NEVER;
  const square = x * x + y * y;
  const loss = state.setup.wallLaw.bounceLoss(inward / square, Math.sqrt(square));
  return 2 * inward * square / (loss * cross * cross);
}

/** The speed of the lightest ball if it had all the energy, m/s: none can become faster. */
function highestSpeed(state) {
  const { u, v, masses } = state;
  let energy = 0, lightest = Infinity;
  for (let k = 0; k < state.number; k += 1) {
    energy += masses[k] * (u[k] * u[k] + v[k] * v[k]);
    lightest = Math.min(lightest, masses[k]);
  }
  return Math.sqrt(energy / lightest);
}

/** Whether ball i, just off the wall, will hit it infinitely often before anything else. */
function isTrapped(i, now, lasts, undisturbed, state) {
  const { boundary, radii } = state, { motion } = boundary, its = now - motion[CLOCK];
  if (now + lasts > state.sums[TIME_LIMIT] || lasts === NEVER) return false;
  const x = state.x[i] - (motion[X] + motion[U] * its);
  const y = state.y[i] - (motion[Y] + motion[V] * its);
  const u = state.u[i] - motion[U], v = state.v[i] - motion[V];
  const inward = Math.max(-(x * u + y * v), 0) / Math.sqrt(x * x + y * y);
  const wallSpeed = boundary.pushedSpeed(i, inward, state);
  const speed = Math.sqrt(u * u + v * v) + wallSpeed;
  const fastest = undisturbed ? 0 : highestSpeed(state);
  for (let k = 0; k < state.number; k += 1) {
    if (k === i) continue;
    const uk = state.u[k], vk = state.v[k];
    const itsSpeed = undisturbed ? Math.sqrt(uk * uk + vk * vk) : fastest;
    boundary.place(k, now, state);
    const xk = placed[0], yk = placed[1];
    const dx = xk - state.x[i], dy = yk - state.y[i];
    const gap = Math.sqrt(dx * dx + dy * dy) - (radii[i] + radii[k]);
    if (gap <= (speed + itsSpeed) * lasts) return false;
    if (boundary.wallComesNear(k, xk, yk, (wallSpeed + itsSpeed) * lasts, state)) return false;
  }
  return true;
}

// The event loop for few balls, see all_pairs.py

const BLOCK = 48; // balls after which a search takes the time found so far as its horizon
const NEARLY_TWICE = 2 + 1e-9; // with it, what is left out is later for certain

/** The arrays of a repeat, and what collisions do in it. */
class State {
  constructor(scene, timeLimit) {
    const { positions, velocities, container, containerMass } = scene;
    const circle = container.shape === "circle", number = scene.radii.length;
    const [width, height] = container.size, free = containerMass < Infinity;
    this.number = number;
    for (const name of ["x", "y", "u", "v", "clock"]) this[name] = new Float64Array(number);
    this.clock.fill(-0); // see isBefore
    this.radii = Float64Array.from(scene.radii);
    this.masses = Float64Array.from(scene.masses);
    for (let k = 0; k < number; k += 1) {
      this.x[k] = positions[2 * k];
      this.y[k] = positions[2 * k + 1];
      this.u[k] = velocities[2 * k];
      this.v[k] = velocities[2 * k + 1];
    }
    this.sums = new Float64Array(SUMS);
    this.sums[TIME_LIMIT] = timeLimit;
    this.counts = new Float64Array(COUNTS);
    this.counts[FIRST] = this.counts[SECOND] = NO_PARTNER;
    this.key = scene.wallKey;
    const { contactDuration, elasticBelow } = scene;
    this.setup = {
      pairLaw: null,
      wallLaw: null,
      contactPath: contactDuration ? contactDuration * meanFreePath(scene) : 0,
      elasticBelow,
      circle,
      noRule: !contactDuration && elasticBelow === 0,
      traps: false,
      patience: free || scene.slides ? NO_LIMIT : 64,
      settling: 1,
    };
    let heaviest = free ? containerMass : this.masses[0], lightest = heaviest;
    for (const mass of this.masses) {
      heaviest = Math.max(heaviest, mass);
      lightest = Math.min(lightest, mass);
    }
    this.imbalance = Math.sqrt(heaviest) / Math.sqrt(lightest);
    this.setLaws(lawOf(scene.pairLaw), lawOf(scene.wallLaw));
    if (free) {
      const pushes = Math.min(4 * number * scene.masses[0] / containerMass, 1e100);
      const motion = Float64Array.of(
        ...scene.containerPosition, ...scene.containerVelocity, 0,
      );
      this.boundary = new FreeCircle(width / 2, containerMass, 1 + pushes, motion);
    } else if (circle) {
      this.boundary = new FixedCircle(width / 2);
      if (scene.slides) this.boundary = new SlidingCircle(width / 2, number);
    } else if (container.shape === "box") {
      this.boundary = new StraightWalls(width, height);
    } else if (container.shape === "channel") {
      this.boundary = new ChannelSides(width, height);
    } else {
      this.boundary = new Boundary(width, height);
    }
  }

  setLaws(pairLaw, wallLaw) {
    this.setup.pairLaw = pairLaw;
    this.setup.wallLaw = wallLaw;
    this.setup.traps = this.setup.circle && this.setup.noRule && wallLaw.cor < 1 && !wallLaw.gains;
    const cor = this.setup.noRule && pairLaw.constant ? pairLaw.cor : 1;
    this.setup.settling = Math.min(this.imbalance, cor >= 1 ? Infinity : 2 / (1 - cor));
    this.key ??= 0n; // a wall may become thermal later
  }

  get collisions() {
    return this.counts[WALL_EVENTS] + this.counts[PAIR_EVENTS];
  }

  /** Continue with the sums, the counts and the time of another state, which has the same balls. */
  takeOver({ sums, counts, key }) {
    this.sums.set(sums);
    this.counts.set(counts);
    this.key = key;
    this.sums[CONTACT_LASTS] = this.counts[STALLED] = 0;
    this.counts[INVOLVED] = this.number;
    this.sums[STILL_SINCE] = sums[NOW];
    this.sums[TIME_LIMIT] = Infinity;
    this.clock.fill(sums[NOW]);
    this.boundary.motion[CLOCK] = sums[NOW];
  }

  /** Set all clocks back by a shift, s; the epoch is the time at which they then show zero. */
  nextEpoch(epoch, shift) {
    for (let k = 0; k < this.number; k += 1) this.clock[k] -= shift;
    this.boundary.motion[CLOCK] -= shift;
    this.sums[NOW] -= shift;
    this.sums[STILL_SINCE] -= shift;
    this.sums[TIME_LIMIT] -= shift;
    this.sums[EPOCH] = epoch;
  }
}

/** The next contacts of each ball, and the search for them. */
class AllPairs {
  constructor(state) {
    const { number } = state;
    this.state = state;
    for (const name of ["pairTime", "wallTime", "nextTime"]) this[name] = new Float64Array(number);
    for (const name of ["events", "partnerEvents", "bounces"]) this[name] = new Int32Array(number);
    this.partner = new Int32Array(number).fill(NOT_SEARCHED);
    this.last = new Int32Array(number).fill(NO_PARTNER);
    // The next event.
    this.i = this.j = NO_PARTNER;
    const now = state.sums[NOW];
    this.pairTime.fill(now);
    this.nextTime.fill(now);
    for (let k = 0; k < number; k += 1) this.predictWall(k, now);
  }

  nextEpoch(shift) {
    for (let k = 0; k < this.state.number; k += 1) {
      this.pairTime[k] -= shift;
      this.wallTime[k] -= shift;
      this.nextTime[k] -= shift;
    }
  }

  countEvent(i, partner, inARow) {
    this.events[i] += 1;
    this.last[i] = partner;
    this.bounces[i] = inARow;
  }

  /** Enter ball i's earliest contact with another; its time at the wall is there already. */
  enterContact(i, time, partner) {
    this.pairTime[i] = time;
    this.nextTime[i] = Math.min(time, this.wallTime[i]);
    this.partner[i] = partner;
    if (partner >= 0) this.partnerEvents[i] = this.events[partner];
  }

  /** Find ball i's earliest contact with another, unless it hits the wall before. */
  findContact(i, now, wallDelay) {
    const { state } = this, { x, y, u, v, clock, radii, boundary, number } = state;
    const last = this.last[i], parted = last >= 0 && this.last[last] === i ? last : NO_PARTNER;
    const curved = boundary.isCurved;
    const ageI = now - clock[i], ui = u[i], vi = v[i], ri = radii[i];
    const xi = x[i] + ui * ageI, yi = y[i] + vi * ageI;
    let delay = boundary.searchTime(wallDelay), partner = SEARCH_AGAIN;
    for (let start = 0; start < number; start += BLOCK) {
      const stop = Math.min(start + BLOCK, number);
      let twice = 2 * delay;
      for (let k = start; k < stop; k += 1) {
        const age = now - clock[k], uk = u[k], vk = v[k];
        const dx = (x[k] + uk * age) - xi, dy = (y[k] + vk * age) - yi;
        const itsDelay = pairDelay(dx, dy, uk - ui, vk - vi, ri + radii[k], twice);
        if (itsDelay < delay && k !== parted && (!curved || boundary.bothFly(i, k))) {
          delay = itsDelay;
          partner = k;
          twice = Math.min(twice, NEARLY_TWICE * delay);
        }
      }
    }
    this.completeSearch(i, now, delay, partner);
  }

  /** ``findContact`` for two balls that have just collided, in one pass over the others. */
  findContacts(i, j, now, wallDelayI, wallDelayJ) {
    const { state } = this, { x, y, u, v, clock, radii, boundary, number } = state;
    const curved = boundary.isCurved;
    const xi = x[i], yi = y[i], ui = u[i], vi = v[i], ri = radii[i];
    const xj = x[j], yj = y[j], uj = u[j], vj = v[j], rj = radii[j];
    let delayI = boundary.searchTime(wallDelayI), partnerI = SEARCH_AGAIN;
    let delayJ = boundary.searchTime(wallDelayJ), partnerJ = SEARCH_AGAIN;
    for (let start = 0; start < number; start += BLOCK) {
      const stop = Math.min(start + BLOCK, number);
      let twiceI = 2 * delayI, twiceJ = 2 * delayJ;
      for (let k = start; k < stop; k += 1) {
        if (k === i || k === j) continue; // they part
        const age = now - clock[k], uk = u[k], vk = v[k], rk = radii[k];
        const xk = x[k] + uk * age, yk = y[k] + vk * age;
        const forI = pairDelay(xk - xi, yk - yi, uk - ui, vk - vi, ri + rk, twiceI);
        if (forI < delayI && (!curved || boundary.bothFly(i, k))) {
          delayI = forI;
          partnerI = k;
          twiceI = Math.min(twiceI, NEARLY_TWICE * forI);
        }
        const forJ = pairDelay(xk - xj, yk - yj, uk - uj, vk - vj, rj + rk, twiceJ);
        if (forJ < delayJ && (!curved || boundary.bothFly(j, k))) {
          delayJ = forJ;
          partnerJ = k;
          twiceJ = Math.min(twiceJ, NEARLY_TWICE * forJ);
        }
      }
    }
    this.completeSearch(i, now, delayI, partnerI);
    this.completeSearch(j, now, delayJ, partnerJ);
  }

  /** Enter what a search among balls on straight ways gave, after one among those on arcs. */
  completeSearch(i, now, straight, among) {
    const { boundary } = this.state;
    let delay = straight, partner = among;
    if (boundary.isCurved) {
      [delay, partner] =
        boundary.earliestOnArc(i, now, delay, partner, this.state, this.wallTime);
    }
    let time = now + delay;
    if (partner < 0) time = boundary.searchedUntil(time, delay < straight);
    this.enterContact(i, time, partner);
  }

  /** Enter when ball i, after any event but a hit of the wall, hits it; the time until then, s. */
  predictWall(i, now) {
    const { boundary } = this.state;
    const delay = boundary.delayToWall(i, now, boundary.takeOffWall(i), this.state);
    this.wallTime[i] = now + delay;
    return delay;
  }

  /** Find the ball of the next event and its partner or the wall; the time on clocks, s.
   *
   * Ties go by time, ball, and wall first. An entry is stale if the partner has had another event
   * since it was made. Then search again from there.
   */
  nextEvent() {
    const { nextTime, wallTime, pairTime, partner, partnerEvents, events, state } = this;
    for (;;) {
      let i = 0;
      let now = nextTime[0];
      for (let k = 1; k < nextTime.length; k += 1) {
        if (nextTime[k] < now) {
          now = nextTime[k];
          i = k;
        }
      }
      const j = partner[i];
      this.i = i;
      if (wallTime[i] <= pairTime[i]) {
        this.j = NO_PARTNER;
        return now;
      }
      this.j = j;
      if (j >= 0 && partnerEvents[i] === events[j]) return now;
      if (state.boundary.isCurved && now > state.sums[TIME_LIMIT]) return now;
      this.findContact(i, now, wallTime[i] - now);
    }
  }

  /** How many balls, other than i, have their next event up to a time, s. */
  otherEvents(end, i) {
    let number = 0;
    for (let k = 0; k < this.state.number; k += 1) {
      number += k !== i && this.nextTime[k] <= end ? 1 : 0;
    }
    return number;
  }

  /** Predict what ball i does after a hit of the wall; whether it is trapped there for good. */
  afterWallHit(i, now) {
    const { state, bounces } = this, { boundary, setup } = state;
    this.countEvent(i, NO_PARTNER, bounces[i] + 1);
    boundary.predictWalls(now, state, this);
    const delay = boundary.delayToNextHit(i, state);
    this.wallTime[i] = now + delay;
    this.findContact(i, now, delay);
    if (!setup.traps || (bounces[i] === 1 && !setup.wallLaw.mayStay())) return false;
    if (setup.wallLaw.isEndless(bounces[i])) return true;
    const lasts = bouncingTime(i, now, state);
    const undisturbed = bounces[i] <= setup.patience;
    let trapped = false;
    if (!undisturbed || this.otherEvents(now + lasts, i) === 0) {
      trapped = isTrapped(i, now, lasts, undisturbed, state);
    }
    const slidesFrom = boundary.settle(i, trapped, now, state);
    if (slidesFrom === NEVER) return trapped;
    // Not a hit, but when it begins to slide; until then it meets no ball.
    this.wallTime[i] = this.nextTime[i] = slidesFrom;
    this.pairTime[i] = NEVER;
    return false;
  }

  /** Predict what balls i and j do after their event; whether i is trapped at the wall for good. */
  afterEvent(i, j, now) {
    if (j === NO_PARTNER) return this.afterWallHit(i, now);
    this.countEvent(i, j, 0);
    this.countEvent(j, i, 0);
    const delayI = this.predictWall(i, now), delayJ = this.predictWall(j, now);
    this.findContacts(i, j, now, delayI, delayJ);
    return false;
  }

  /** Ball i slides from now on: it has no wall ahead, and its contacts are searched next. */
  beginSlide(i, now) {
    this.countEvent(i, NO_PARTNER, 0);
    this.wallTime[i] = NEVER;
    this.enterContact(i, now, NOT_SEARCHED);
  }
}
