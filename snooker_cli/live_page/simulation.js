"use strict";

// A scene in, events out: a repeat in steps, with endings as in engine/simulation.py.

const LEAST_EPOCH_EVENTS = 16384, EPOCH_EVENTS_PER_BALL = 64; // events of an epoch, see clock.py
const STALL_LIMIT = 64; // events of one ball in a row, without the clock moving, until a collapse
const CLOCK_DIGITS = 4 * 2 ** -52; // an event later by less than this part does not move the clock

/** The double before a positive one. */
function nextDown(value) {
  const bits = new BigInt64Array(new Float64Array([value]).buffer);
  bits[0] -= 1n;
  return new Float64Array(bits.buffer)[0];
}

/** Whether a ball's own clock is earlier: clocks start at minus zero. */
function isBefore(clock, since) {
  return clock < since || clock < 0 || Object.is(clock, -0);
}

class Simulation {
  /** A repeat at its start.
   *
   * limits : ``collisions`` and ``time`` (s) at which it ends; null or absent for none
   * options : ``hash``, whether to compute a hash of all events; ``engine``, "allpairs" or "cells"
   *     instead of the program's choice
   */
  constructor(scene, limits = {}, options = {}) {
    const { collisions, time } = limits;
    this.scene = scene;
    this.engineName = options.engine;
    this.wanted = collisions ?? NO_LIMIT;
    this.timeLimit = time ?? Infinity;
    this.state = new State(scene, this.timeLimit);
    this.number = this.state.number;
    this.predictAll();
    this.epochLength = Math.max(LEAST_EPOCH_EVENTS, EPOCH_EVENTS_PER_BALL * this.number);
    this.time = 0;
    this.reached = 0; // s; no event is before, if the last call of ``advance`` gave none
    this.stop = null;
    this.eventCount = 0;
    this.makeRoom(1024);
    this.out = new Float64Array(2);
    this.hash = options.hash ? new EventHash() : null;
  }

  /** Begin with an engine that has predicted everything from now on. */
  predictAll() {
    const { scene, state, engineName } = this;
    const few = engineName ? engineName === "allpairs" : usesAllPairs(scene);
    this.engine = few ? new AllPairs(state) : new Cells(scene, state);
  }

  makeRoom(events) {
    const columns = {
      eventTime: Float64Array, eventI: Int32Array, eventJ: Int32Array, eventImpulse: Float64Array,
    };
    for (const [name, ArrayOf] of Object.entries(columns)) {
      const column = new ArrayOf(events);
      if (this[name]) column.set(this[name]);
      this[name] = column;
    }
  }

  // An event in each turn of the loop: stop if there is none, or if the time limit comes first; a
  // ball that slides is brought to now along the wall, and takes the next turn; others collide;
  // record the event and predict what its balls do next.

  /** Simulate at most ``limit`` more events, none later than ``until`` (s).
   *
   * Returns null while the repeat can continue, also if cells were crossed very often without an
   * event; else how it ended: reason, time (s), balls and the program's message.
   */
  advance(limit, until = Infinity) {
    const { state, engine } = this, { sums, counts, boundary } = state;
    this.eventCount = 0;
    while (this.stop === null && this.eventCount < limit) {
      const now = engine.nextEvent(until - sums[EPOCH]);
      if (now === NEVER) return this.end(NOTHING_LEFT);
      if (now > sums[TIME_LIMIT]) return this.end(TIME);
      this.reached = Math.min(sums[EPOCH] + now, until);
      if (!(sums[EPOCH] + now <= until)) return null;
      if (engine.j < NO_PARTNER) {
        const endless = boundary.periodY < Infinity && this.timeLimit === Infinity;
        const isIdle = endless && engine.crossings >= MOST_CROSSINGS;
        return isIdle ? this.end(IDLE) : null;
      }
      let { i, j } = engine;
      this.beginEvent(i, j, now);
      const slider = boundary.isCurved ? boundary.sliderOf(i, j, now, state) : NO_PARTNER;
      let begins = false, size;
      if (slider === NO_PARTNER) {
        size = collide(i, j, now, state);
      } else {
        i = slider;
        j = SLIDE;
        begins = boundary.settles(i);
        size = boundary.slide(i, now, state);
      }
      count(i, j, size, state);
      this.record(i, j, now, size);
      if (begins) engine.beginSlide(i, now);
      const trapped = j !== SLIDE && engine.afterEvent(i, j, now);
      if (state.collisions % this.epochLength === 0) this.nextEpoch();
      if (state.collisions >= this.wanted) return this.end(COLLISIONS);
      if (trapped) return this.end(WALL_TRAP);
      if (j !== SLIDE && this.hasCollapsed()) return this.end(COLLAPSE);
    }
    return this.stop;
  }

  /** Move the clock to the event of balls i and j, and note how long it stands still. */
  beginEvent(i, j, now) {
    const { clock, sums, counts } = this.state;
    if (now - sums[NOW] > CLOCK_DIGITS * (sums[EPOCH] + now)) {
      sums[STILL_SINCE] = now;
      counts[STALLED] = 0;
      counts[INVOLVED] = j >= 0 ? 2 : 1;
    } else {
      counts[STALLED] += 1;
      if (isBefore(clock[i], sums[STILL_SINCE])) counts[INVOLVED] += 1;
      if (j >= 0 && isBefore(clock[j], sums[STILL_SINCE])) counts[INVOLVED] += 1;
    }
    counts[FIRST] = i;
    counts[SECOND] = j;
    sums[NOW] = now;
  }

  /** Whether more events have not moved the clock than a finite rack needs, see clock.py. */
  hasCollapsed() {
    const { counts, setup } = this.state, stalled = counts[STALLED], involved = counts[INVOLVED];
    if (stalled <= STALL_LIMIT) return false;
    return stalled > STALL_LIMIT + setup.settling * ((involved - 1) * (involved + STALL_LIMIT));
  }

  /** Write an event into the record; of two balls, the lesser first. */
  record(i, j, now, impulse) {
    const row = this.eventCount;
    if (row === this.eventTime.length) this.makeRoom(2 * row);
    this.time = this.state.sums[EPOCH] + now;
    this.eventTime[row] = this.time;
    this.eventImpulse[row] = impulse;
    this.eventI[row] = j < 0 || i < j ? i : j;
    this.eventJ[row] = j < 0 || j > i ? j : i;
    this.eventCount = row + 1;
    if (this.hash !== null) {
      this.hash.add(this.time, this.eventI[row], this.eventJ[row], impulse);
    }
  }

  /** Set all clocks back, so that they keep their precision, see clock.py. */
  nextEpoch() {
    const { sums } = this.state, epoch = sums[EPOCH], now = sums[NOW];
    let following = epoch + now;
    while (following - epoch > now) following = nextDown(following);
    this.state.nextEpoch(following, following - epoch);
    this.engine.nextEpoch(following - epoch);
  }

  /** Other laws from now on. */
  setLaws(pairLaw, wallLaw) {
    Object.assign(this.scene, { pairLaw, wallLaw });
    this.state.setLaws(lawOf(pairLaw), lawOf(wallLaw));
  }

  /** Continue after an end, without a limit of time.
   *
   * rules : fields of the scene that differ from now on, such as ``slides``; null for none
   */
  continueWith(rules = null) {
    const { state, number, time } = this;
    this.stop = null;
    this.timeLimit = state.sums[TIME_LIMIT] = Infinity;
    if (rules === null) return;
    const positions = new Float64Array(2 * number), velocities = new Float64Array(2 * number);
    for (let ball = 0; ball < number; ball += 1) {
      positions.set(this.positionOf(ball, time), 2 * ball);
      velocities.set(this.velocityOf(ball, time), 2 * ball);
    }
    const containerPosition = [...this.positionOf(number, time)];
    const containerVelocity = [...this.velocityOf(number, time)];
    const now = { ...rules, positions, velocities, containerPosition, containerVelocity };
    this.scene = { ...this.scene, ...now };
    this.state = new State(this.scene, Infinity);
    this.state.takeOver(state);
    this.predictAll();
  }

  // The state at a time, s, that is not before the last event. Ball number N is the container.

  /** Where ball i is: [x, y] in ``out``, m. */
  positionOf(i, time) {
    const { state } = this, clock = time - state.sums[EPOCH];
    if (i === this.number) {
      const { motion } = state.boundary, age = clock - motion[CLOCK];
      this.out[0] = motion[X] + motion[U] * age;
      this.out[1] = motion[Y] + motion[V] * age;
    } else {
      state.boundary.placeToShow(i, clock, state);
      this.out[0] = nearestImage(placed[0], state.boundary.periodX);
      this.out[1] = nearestImage(placed[1], state.boundary.periodY);
    }
    return this.out;
  }

  /** The velocity of ball i: [u, v] in ``out``, m/s; of a ball that slides at a time. */
  velocityOf(i, time = this.time) {
    const { state } = this;
    if (i === this.number) {
      this.out[0] = state.boundary.motion[U];
      this.out[1] = state.boundary.motion[V];
    } else {
      state.boundary.placeToShow(i, time - state.sums[EPOCH], state);
      this.out[0] = placed[2];
      this.out[1] = placed[3];
    }
    return this.out;
  }

  get wallEvents() {
    return this.state.counts[WALL_EVENTS];
  }

  get pairEvents() {
    return this.state.counts[PAIR_EVENTS];
  }

  /** The impulse on the wall since the start, kg m/s. */
  get wallImpulse() {
    return this.state.sums[WALL_IMPULSE] + this.state.sums[WALL_IMPULSE + REST];
  }

  /** The sum over ball-ball collisions of impulse times contact distance, kg m^2/s. */
  get pairVirial() {
    return this.state.sums[PAIR_VIRIAL] + this.state.sums[PAIR_VIRIAL + REST];
  }

  /** Kinetic energy of the balls, J. */
  kineticEnergy() {
    const { u, v, masses } = this.state;
    let energy = 0;
    for (let k = 0; k < this.number; k += 1) {
      energy += 0.5 * masses[k] * (u[k] * u[k] + v[k] * v[k]);
    }
    return energy;
  }

  /** Momentum of balls and free container, [kg m/s, kg m/s]. */
  momentum() {
    const { u, v, masses, boundary } = this.state, mass = boundary.mass ?? 0;
    let across = mass * boundary.motion[U], up = mass * boundary.motion[V];
    for (let k = 0; k < this.number; k += 1) {
      across += masses[k] * u[k];
      up += masses[k] * v[k];
    }
    return [across, up];
  }

  /** Angular momentum of balls and free container about the origin, kg m^2/s. */
  angularMomentum() {
    const { x, y, u, v, masses, boundary } = this.state, { motion } = boundary;
    let total = (boundary.mass ?? 0) * (motion[X] * motion[V] - motion[Y] * motion[U]);
    for (let k = 0; k < this.number; k += 1) total += masses[k] * (x[k] * v[k] - y[k] * u[k]);
    return total;
  }

  /** SHA-256 of all events so far, in hexadecimal: time, i, j, impulse of each, little-endian. */
  eventHash() {
    return this.hash.digest();
  }

  /** [number, hash] of the first 1,000, 10,000, 100,000 … events. */
  get hashes() {
    return this.hash.kept;
  }

  // Endings

  /** End the repeat for a reason, with the program's sentence. */
  end(reason) {
    const { state, time, timeLimit } = this, { counts } = state, now = general(time, 9);
    const events = grouped(state.collisions), limit = general(timeLimit, 9);
    const messages = {
      [COLLISIONS]: `${events} collisions reached at ${now} s`,
      [TIME]: `${limit} s reached after ${events} collisions`,
      [NOTHING_LEFT]: `no further collision can happen after ${events}, at ${now} s`,
      [IDLE]:
        "no collision in 100,000,000 crossings of cells " +
        `after ${events} collisions, at ${now} s; give a time to end at`,
    };
    const first = counts[FIRST], second = counts[SECOND];
    if (reason in messages) {
      const waits = (reason === TIME || reason === NOTHING_LEFT) && timeLimit < Infinity;
      this.stop = { reason, time: waits ? timeLimit : time, balls: [], message: messages[reason] };
    } else if (reason === WALL_TRAP) {
      this.stop = { reason, time, balls: [first], message: this.trapMessage(first) };
    } else {
      const atWall = second === NO_PARTNER, balls = atWall ? [first] : [first, second];
      const pair = atWall ? `ball ${first} and the wall` : `balls ${first} and ${second}`;
      const { cor } = atWall ? state.setup.wallLaw : state.setup.pairLaw;
      // An elastic ball that moves along the wall touches it at every moment, and loses nothing.
      const what = cor < 1 ? "inelastic collapse" : "collisions without end";
      const message =
        `${what}: collisions continue, but time stays at ${general(time, 17)} s; ` +
        `the last collision is of ${pair}; ${this.savedEvents()}`;
      this.stop = { reason, time, balls, message };
    }
    return this.stop;
  }

  savedEvents() {
    const { collisions } = this.state;
    if (collisions === 1) return "1 collision is saved";
    return `${grouped(collisions)} collisions are saved`;
  }

  trapMessage(ball) {
    const { state, time } = this, law = state.setup.wallLaw;
    const [lasts, given] = bouncesToCome(ball, state);
    const end = general(time + lasts, 9), impulse = general(given, 6);
    let what = "stays at the wall, because the wall CoR is 0";
    if (!law.constant) {
      what =
        `bounces ever faster at the wall: it stops until ${end} s and gives it at ` +
        `most ${impulse} kg m/s more, if no other ball hits it`;
    } else if (law.cor > 0) {
      what =
        `bounces infinitely often at the wall, until ${end} s, and gives it ` +
        `${impulse} kg m/s more`;
    }
    return `wall trap: from ${general(time, 9)} s on, ball ${ball} ${what}; ${this.savedEvents()}`;
  }
}

// Numbers in sentences, as Python writes them

/** A whole number with commas between thousands. */
function grouped(number) {
  return String(number).replace(/\B(?=(\d{3})+$)/g, ",");
}

/** A number with this many significant digits at most, as Python's format "g". */
function general(value, digits) {
  if (!Number.isFinite(value)) return value > 0 ? "inf" : value < 0 ? "-inf" : "nan";
  if (value === 0) return "0";
  let [mantissa, power] = value.toExponential(digits - 1).split("e");
  const more = value.toExponential(Math.min(digits + 40, 100)).split("e")[0];
  const [kept, cut] = [more.slice(0, mantissa.length), more.slice(mantissa.length)];
  // Exactly between two: Python takes the even one, JavaScript the larger.
  if (/^50*$/.test(cut) && /[02468]$/.test(kept)) mantissa = kept;
  const exponent = Number(power), sign = mantissa.startsWith("-") ? "-" : "";
  const figures = mantissa.replace("-", "").replace(".", "").replace(/0+$/, "");
  if (exponent < -4 || exponent >= digits) {
    const size = String(Math.abs(exponent)).padStart(2, "0");
    const fraction = figures.length > 1 ? `.${figures.slice(1)}` : "";
    return `${sign}${figures[0]}${fraction}e${exponent < 0 ? "-" : "+"}${size}`;
  }
  if (exponent < 0) return `${sign}0.${"0".repeat(-exponent - 1)}${figures}`;
  const whole = figures.slice(0, exponent + 1).padEnd(exponent + 1, "0");
  const fraction = figures.slice(exponent + 1);
  return sign + whole + (fraction ? `.${fraction}` : "");
}
