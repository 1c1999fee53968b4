// A scene in, events out. The program's own kernels, as WebAssembly, compute them, with the same bits:
// ``follow`` of page_kernels.py simulates, ``show`` says where balls are. ENGINE, which webassembly.py
// makes, says where in memory each array is, and what the numbers of its rows and elements mean.

// A tag of the texts that users read: ``translated_script`` of html_page.py replaces them.
const phrase = String.raw;

const {
  ball: BALL, history: HISTORY, sums: SUMS, counts: COUNTS, law: LAW, laws: LAWS, shapes: SHAPES, answers: ANSWERS,
  followed: FOLLOWED, SETTLES, NO_PARTNER, FULL, REASONS, LENGTHS, EVENT_COLUMNS, CARRIED, MOST_NUMBERS,
} = ENGINE.names;
const SQUARES = phrase`squares of speeds are no numbers of double precision`;
const [COLLISIONS, TIME, NOTHING_LEFT, WALL_TRAP, COLLAPSE, IDLE, REST, FAR] = REASONS;
const FARTHEST_TURNS = 21361415; // 2 ** 27 rad
const NO_LIMIT = 2 ** 53; // as good as no limit for a number of events
const LARGE = 1e100; // large but finite, so that times zero it is zero
const IDLE_CALLS = 5000; // of ``follow`` in a row without an event, after which a repeat without a time ends

const ARRAYS = {
  float64: Float64Array, int64: BigInt64Array, int32: Int32Array, bool: Uint8Array,
};
const ALIGNED = 16, PAGE = 65536; // bytes

/** The bytes of an element of an array. Records, whose type is V and their bytes, are words of 4 bytes. */
const bytesOf = (type) => ARRAYS[type]?.BYTES_PER_ELEMENT ?? Number(type.slice(1));

const modules = {}; // the compiled code of each boundary

/** Compile the modules, which are one after the other, deflated and in base64.
 *
 * Rejects where a page may not do so.
 */
async function compileModules({ lengths, packed }) {
  const bytes = Uint8Array.from(atob(packed), (letter) => letter.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  const codes = await new Response(stream).arrayBuffer();
  let begin = 0;
  await Promise.all(Object.entries(lengths).map(async ([boundary, length]) => {
    const code = codes.slice(begin, begin + length);
    begin += length;
    modules[boundary] = await WebAssembly.compile(code);
  }));
}

/** A block of memory with the parts of a page, and the kernels that work on it.
 *
 * parts : arrays by the names of ``Page``, such as ``state.balls``; numbers are arrays of one element
 */
class Kernels {
  constructor(boundary, number) {
    const { exports } = new WebAssembly.Instance(modules[boundary]);
    const layout = [...ENGINE.common, ...ENGINE.boundaries[boundary]], { memory } = exports;
    const lengthOf = (name) => {
      const [more, unit] = LENGTHS[name];
      return Math.floor((number + more) / unit) * unit;
    };
    const placed = [];
    let end = ENGINE.begin + 8 * (layout.length + 1);
    for (const [name, type, shape, place] of layout) {
      const size = (shape ?? []).reduce((count, part) => count * (Number.isInteger(part) ? part : lengthOf(part)), 1);
      if (shape) end = Math.ceil(end / ALIGNED) * ALIGNED;
      placed.push([name, type, size, shape ? end : ENGINE.begin + place, shape && ENGINE.begin + place]);
      if (shape) end += size * bytesOf(type);
    }
    const missing = end - memory.buffer.byteLength;
    if (missing > 0) memory.grow(Math.ceil(missing / PAGE));
    const view = new DataView(memory.buffer);
    view.setBigInt64(ENGINE.begin, BigInt(number), true);
    this.parts = {};
    for (const [name, type, size, place, slot] of placed) {
      if (slot) view.setUint32(slot, place, true);
      const Values = ARRAYS[type] ?? Int32Array, lengths = bytesOf(type) / Values.BYTES_PER_ELEMENT;
      this.parts[name] = new Values(memory.buffer, place, size * lengths);
    }
    this.block = new Uint8Array(memory.buffer, ENGINE.begin, end - ENGINE.begin);
    this.follow = () => exports.follow(ENGINE.begin);
    this.show = () => exports.show(ENGINE.begin);
    this.trap = () => exports.trap(ENGINE.begin);
  }
}

// A scene in memory, as engine/conversion.py has it

/** The law of collision of a scene, as a row of ``Setup.laws``. */
function lawRow({ name, cor = 0, ...others }) {
  const row = new Float64Array(LAW.COLUMNS), { number, ofPackage } = LAWS[name];
  row.set([number, cor, ...(ofPackage ? [] : Object.values(others))]);
  return row;
}

/** The numbers of a law of a package, in order; none of one of snooker. */
const packageNumbers = (law) => (LAWS[law.name].ofPackage ?? []).map((name) => law[name]);

const SMOOTH = { inertia: 0.5, tangential_cor: -1, friction: 0, wall_tangential_cor: -1, wall_friction: 0 };

const isFree = ({ containerMass }) => containerMass < Infinity;

/** The name of the boundary of a scene. */
function boundaryOf(scene) {
  const { shape } = scene.container;
  if (shape !== "circle") return shape;
  if (isFree(scene)) return "free_circle";
  return scene.slides ? "sliding_circle" : "fixed_circle";
}

/** Write what collisions do in a scene. */
function writeSetup(scene, parts) {
  const { pairLaw, wallLaw, contactDuration, elasticBelow, masses, surface } = scene;
  for (const [name, value] of Object.entries(surface ?? SMOOTH)) parts[`state.surface.law.${name}`][0] = value;
  const walls = SIDES.map((side) => wallLaw[side] ?? wallLaw);
  [pairLaw, ...walls].forEach((law, row) => {
    parts["state.setup.laws"].set(lawRow(law), row * LAW.COLUMNS);
    parts["state.setup.package_laws.numbers"]?.set(packageNumbers(law), row * MOST_NUMBERS);
  });
  const noRule = !contactDuration && elasticBelow === 0, passive = !givesEnergy(wallLaw);
  const loses = noRule && passive && Math.min(...walls.map(({ cor }) => cor)) < 1;
  const bodies = isFree(scene) ? [...masses, scene.containerMass] : masses;
  const imbalance = Math.sqrt(Math.max(...bodies)) / Math.sqrt(Math.min(...bodies));
  const slowCor = noRule && pairLaw.name === "constant" ? pairLaw.cor : 1;
  parts["state.setup.contact_path"][0] = contactDuration ? contactDuration * meanFreePath(scene) : 0;
  parts["state.setup.elastic_below"][0] = elasticBelow;
  parts["state.setup.traps"][0] = Number(scene.container.shape === "circle" && loses);
  parts["state.setup.settling"][0] = Math.min(imbalance, slowCor >= 1 ? Infinity : 2 / (1 - slowCor));
}

const givesEnergy = (law) => lawsOfWall(law).some(({ name }) => LAWS[name].addsEnergy);

// Events are records of words of 4 bytes: their columns, one after the other, see fields.py.
const EVENT_WORDS = EVENT_COLUMNS.reduce((total, [, , words]) => total + words, 0);

/** The words of the columns that events of a scene have. */
const wordsOf = (scene) => EVENT_COLUMNS.filter(([, , , needs]) => Boolean(scene[needs]))
  .flatMap(([, begin, words]) => Array.from({ length: words }, (_, k) => begin + k));

/** A column of records: the value in a row. */
function eventColumn(name, records) {
  const [, begin, words] = EVENT_COLUMNS.find(([own]) => own === name), step = EVENT_WORDS / words;
  const values = new (words === 2 ? Float64Array : Int32Array)(records.buffer, records.byteOffset + 4 * begin);
  return (row) => values[row * step];
}

/** Write a scene at its start. */
function writeScene(scene, timeLimit, parts) {
  const { positions, velocities, radii, masses, container, containerMass } = scene;
  const number = radii.length, [width, height] = container.size, balls = parts["state.balls"];
  for (let k = 0; k < number; k += 1) {
    balls[BALL.X * number + k] = positions[2 * k];
    balls[BALL.Y * number + k] = positions[2 * k + 1];
    balls[BALL.U * number + k] = velocities[2 * k];
    balls[BALL.V * number + k] = velocities[2 * k + 1];
    balls[BALL.CLOCK * number + k] = -0; // no ball has collided, see ``is_before`` of clock.py
  }
  parts["state.sizes.radii"].set(radii);
  parts["state.sizes.masses"].set(masses);
  for (const { name } of CARRIED) parts[`state.surface.${name}`].set(scene[name] ?? []);
  parts["state.history"].fill(NO_PARTNER, HISTORY.FORMER * number);
  parts["search.times"].fill(Infinity);
  const counts = parts["state.counts"];
  counts[COUNTS.FIRST] = counts[COUNTS.SECOND] = BigInt(NO_PARTNER);
  counts[COUNTS.KEY] = BigInt.asIntN(64, scene.wallKey ?? 0n); // a wall may become thermal later
  parts["state.sums"][SUMS.TIME_LIMIT] = timeLimit;
  writeSetup(scene, parts);
  const sizes = {
    radius: width / 2,
    "circle.radius": width / 2,
    mass: containerMass,
    search_factor: 1 + Math.min((4 * number * masses[0]) / containerMass, LARGE),
    half_width: width / 2,
    half_height: height / 2,
    width,
    height,
  };
  for (const [name, size] of Object.entries(sizes)) {
    const part = parts[`state.boundary.${name}`];
    if (part) part[0] = size;
  }
  ["across", "up"].forEach((name, axis) => {
    parts[`state.frame.${name}`][0] = Number(isFree(scene) || repeatsAlong(axis, container));
  });
  const motion = parts["state.boundary.motion"];
  motion?.set([...scene.containerPosition, ...scene.containerVelocity, 0, NO_PARTNER]);
}

/** A repeat in steps, with endings as in engine/simulation.py. */
class Simulation {
  /** A repeat at its start.
   *
   * limits : ``collisions`` and ``time`` (s) at which it ends; null or absent for none
   * options : ``hash``, whether to compute a hash of all events
   */
  constructor(scene, limits = {}, options = {}) {
    this.scene = scene;
    this.number = scene.radii.length;
    this.wanted = limits.collisions ?? NO_LIMIT;
    this.timeLimit = limits.time ?? Infinity;
    this.hash = options.hash ? new EventHash(wordsOf(scene)) : null;
    this.collisions = 0;
    this.time = 0; // s, of the last event
    this.reached = 0; // s; no other event is before
    this.eventCount = 0; // of the last call of ``advance``
    this.idle = 0; // calls in a row without an event, although there was time
    this.stop = null;
    this.begin(this.timeLimit);
  }

  /** Put the scene into new memory. */
  begin(timeLimit) {
    this.kernels = new Kernels(boundaryOf(this.scene), this.number);
    const { parts } = this.kernels;
    writeScene(this.scene, timeLimit, parts);
    this.parts = parts;
    this.sums = parts["state.sums"];
    this.counts = parts["state.counts"];
    this.balls = parts["state.balls"];
    this.motions = parts["state.boundary.motions"]; // absent where no ball slides
    this.spins = parts["state.surface.spins"]; // rad/s
    this.turned = parts.turned;
    this.flights = parts.flights;
    this.events = parts["followed.events"]; // EVENT_WORDS for each event
    this.eventTime = eventColumn("time", this.events);
    this.eventI = eventColumn("i", this.events);
    this.eventJ = eventColumn("j", this.events);
    this.eventSums = parts["followed.sums"]; // FOLLOWED_SUMS for each event
    this.eventPlaces = parts["followed.places"]; // of ball i, and of ball j or the container
    this.eventVelocities = parts["followed.velocities"]; // of the same, after the event
    this.shown = NaN;
  }

  /** Simulate at most ``limit`` more events, or as many as fit, none later than ``until`` (s).
   *
   * Returns null while the repeat can continue, also if a search for an event takes long; else how
   * it ended: reason, time (s), balls and the program's message.
   */
  advance(limit, until = Infinity) {
    this.eventCount = 0;
    if (this.stop !== null) return this.stop;
    const { kernels, parts } = this, { answers } = parts;
    parts.limit[0] = BigInt(Math.min(limit, this.wanted - this.collisions, ENGINE.events));
    parts.until[0] = until;
    kernels.follow();
    this.shown = NaN;
    const count = answers[ANSWERS.EVENTS_DONE], reason = answers[ANSWERS.REASON];
    this.eventCount = count;
    this.reached = answers[ANSWERS.REACHED];
    this.collisions += count;
    if (count > 0) this.time = this.eventTime(count - 1);
    if (this.hash !== null) this.hash.addAll(this.events, count, this.collisions - count);
    if (this.collisions >= this.wanted) return this.end(COLLISIONS);
    if (reason !== FULL) return this.end(REASONS[reason]);
    this.idle = count > 0 || this.reached >= until ? 0 : this.idle + 1;
    // No velocity changes meanwhile, and one proof is enough.
    if (this.idle === 1 && this.nothingCanMeet()) return this.end(NOTHING_LEFT);
    return this.idle >= IDLE_CALLS && this.timeLimit === Infinity ? this.end(IDLE) : null;
  }

  /** Whether it is certain that no ball in a periodic box or channel meets another, or a wall. */
  nothingCanMeet() {
    const { balls, number, scene } = this, { size } = scene.container;
    const row = (which) => balls.subarray(which * number, (which + 1) * number);
    const across = repeatsAlong(0, scene.container) ? BALL.V : BALL.U;
    if (keepsDrift(scene.container) && row(across).some((speed) => speed !== 0)) return false;
    const all = Array.from(scene.radii, (_, k) =>
      [BALL.X, BALL.Y, BALL.U, BALL.V, BALL.CLOCK].map((which) => balls[which * number + k]));
    return all.every((ball, i) => all.every((other, k) =>
      k <= i || neverMeet(ball, other, scene.radii[i] + scene.radii[k], size)));
  }

  /** Other laws from now on.
   *
   * With them, a ball that bounces infinitely often may do so no more: it flies again. The impulse
   * of its bounces since the last event counts as nothing.
   */
  setLaws(pairLaw, wallLaw, surface = this.scene.surface) {
    const { number, balls, parts, motions, sums } = this;
    motions?.forEach((motion, ball) => {
      if (motion !== BigInt(SETTLES)) return;
      const flight = [...this.positionOf(ball, this.time), ...this.velocityOf(ball), sums[SUMS.NOW]];
      [BALL.X, BALL.Y, BALL.U, BALL.V, BALL.CLOCK].forEach((row, k) => { balls[row * number + ball] = flight[k]; });
      parts["state.history"][HISTORY.FORMER * number + ball] = NO_PARTNER;
      motions[ball] = 0n;
      parts["search.begun"][0] = 0; // all predictions are made anew
    });
    Object.assign(this.scene, { pairLaw, wallLaw, surface });
    writeSetup(this.scene, this.parts);
  }

  /** A copy of all that the repeat has reached, for ``restore``. */
  save() {
    const { collisions, time, reached, idle, stop, kernels } = this;
    return { collisions, time, reached, idle, stop, block: kernels.block.slice() };
  }

  /** Go back, or on, to what ``save`` has given. The hash stays that of all events so far. */
  restore({ block, ...reached }) {
    Object.assign(this, reached);
    this.kernels.block.set(block);
    this.eventCount = 0;
    this.shown = NaN;
  }

  /** Continue after an end, without a limit of time.
   *
   * rules : fields of the scene that differ from now on, such as ``slides``; null for none
   */
  continueWith(rules = null) {
    const { number, time, sums, counts, parts, turned } = this;
    this.stop = null;
    this.timeLimit = sums[SUMS.TIME_LIMIT] = Infinity;
    if (rules === null) return;
    const positions = new Float64Array(2 * number), velocities = new Float64Array(2 * number);
    for (let ball = 0; ball < number; ball += 1) {
      positions.set(this.positionOf(ball, time), 2 * ball);
      velocities.set(this.velocityOf(ball, time), 2 * ball);
    }
    const containerPosition = this.positionOf(number, time), containerVelocity = this.velocityOf(number, time);
    const now = { positions, velocities, containerPosition, containerVelocity };
    this.scene = { ...this.scene, ...rules, ...now };
    this.begin(Infinity);
    this.sums.set(sums);
    this.counts.set(counts);
    for (const { name } of CARRIED) this.parts[`state.surface.${name}`].set(parts[`state.surface.${name}`]);
    this.turned.set(turned);
    this.sums[SUMS.CONTACT_LASTS] = 0;
    this.sums[SUMS.STILL_SINCE] = sums[SUMS.NOW];
    this.counts[COUNTS.STALLED] = 0n;
    this.counts[COUNTS.INVOLVED] = BigInt(number);
    this.balls.fill(sums[SUMS.NOW], BALL.CLOCK * number);
    const motion = this.parts["state.boundary.motion"];
    if (motion) motion[BALL.CLOCK] = sums[SUMS.NOW];
  }

  // The state at a time, s, that is not before the last event. Ball number N is the container.

  /** Let ``flights`` have where all balls are at a time, s. */
  show(time) {
    if (time === this.shown) return;
    this.parts.until[0] = time;
    this.kernels.show();
    this.shown = time;
  }

  /** Where ball i is, [x, y], m. */
  positionOf(i, time) {
    this.show(time);
    return [this.flights[4 * i + BALL.X], this.flights[4 * i + BALL.Y]];
  }

  /** The velocity of ball i, [u, v], m/s. */
  velocityOf(i, time = this.time) {
    this.show(time);
    return [this.flights[4 * i + BALL.U], this.flights[4 * i + BALL.V]];
  }

  /** By how much ball i has turned to the left since the start, rad. */
  angleOf(i, time) {
    return this.spins[i] * time + this.turned[i];
  }

  /** Whether the way of a ball is curved, or bounces along the wall. */
  isCurved(ball) {
    return this.motions?.[ball] >= SETTLES;
  }

  get wallEvents() {
    return Number(this.counts[COUNTS.WALL_EVENTS]);
  }

  get pairEvents() {
    return Number(this.counts[COUNTS.PAIR_EVENTS]);
  }

  /** The impulse on the wall since the start, kg m/s. */
  get wallImpulse() {
    return this.sums[SUMS.WALL_IMPULSE] + this.sums[SUMS.WALL_IMPULSE_REST];
  }

  /** The sum over ball-ball collisions of impulse times contact distance, kg m^2/s. */
  get pairVirial() {
    return this.sums[SUMS.PAIR_VIRIAL] + this.sums[SUMS.PAIR_VIRIAL_REST];
  }

  /** A sum of a function of mass, place and velocity over balls; number N is a free container. */
  sumOf(value, begin = 0, end = this.number + isFree(this.scene)) {
    this.show(this.time);
    const { flights, number, scene } = this, { masses, containerMass } = scene;
    let sum = 0;
    for (let k = begin; k < end; k += 1) {
      sum += value(k < number ? masses[k] : containerMass, ...flights.subarray(4 * k, 4 * k + 4));
    }
    return sum;
  }

  /** Kinetic energy of the balls, without that of their spins, J. */
  kineticEnergy() {
    return this.sumOf((m, x, y, u, v) => 0.5 * m * (u * u + v * v), 0, this.number);
  }

  /** The sum over balls of their moments of inertia, kg m^2, times a function of the spin, rad/s. */
  spinSum(value) {
    const { spins, scene: { radii, masses, surface } } = this;
    return surface ? spins.reduce((sum, w, k) => sum + surface.inertia * masses[k] * radii[k] ** 2 * value(w), 0) : 0;
  }

  /** Energy of the spins of the balls, J. */
  spinEnergy() {
    return this.spinSum((w) => 0.5 * w * w);
  }

  /** Kinetic energy of a free container, J. */
  containerEnergy() {
    return this.sumOf((m, x, y, u, v) => 0.5 * m * (u * u + v * v), this.number);
  }

  /** Momentum of balls and free container, [kg m/s, kg m/s]. */
  momentum() {
    return [this.sumOf((m, x, y, u) => m * u), this.sumOf((m, x, y, u, v) => m * v)];
  }

  /** Angular momentum of balls, with their spins, and free container about the origin, kg m^2/s. */
  angularMomentum() {
    return this.sumOf((m, x, y, u, v) => m * (x * v - y * u)) + this.spinSum((w) => w);
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

  /** The program's sentence on balls that are too slow. */
  restMessage(events, now) {
    const motion = this.parts["state.frame.motion"], shared = Math.hypot(motion[BALL.U], motion[BALL.V]);
    if (shared === 0) return phrase`all balls are slower than 2e-154 m/s after ${events}, at ${now} s: ${SQUARES}`;
    return phrase`all balls are slower than 2e-154 m/s, beside the ${general(shared, 3)} m/s that all share, after ${events}, at ${now} s: ${SQUARES}`;
  }

  /** The program's sentence on what has gone too far. */
  farMessage(events, now) {
    const lost = phrase`places have lost half of their digits`;
    if (this.scene.slides) return phrase`a ball slides more than ${grouped(FARTHEST_TURNS)} times round after ${events}, at ${now} s: ${lost}`;
    const distance = general(Math.hypot(...this.positionOf(this.number, this.time)), 3);
    return phrase`the container is ${distance} m away after ${events}, at ${now} s: ${lost}`;
  }

  /** End the repeat for a reason, with the program's sentence. */
  end(reason) {
    const { time, timeLimit, counts, scene } = this, now = general(time, 9);
    const events = collisionsText(this.collisions), after = grouped(this.collisions);
    const limit = general(timeLimit, 9), searches = grouped(IDLE_CALLS * ENGINE.searches);
    const messages = {
      [COLLISIONS]: phrase`${events} reached at ${now} s`,
      [TIME]: phrase`${limit} s reached after ${events}`,
      [NOTHING_LEFT]: phrase`no further collision can happen after ${after}, at ${now} s`,
      [IDLE]: phrase`no collision in ${searches} searches after ${events}, at ${now} s; give a time to end at`,
      [FAR]: this.farMessage(events, now),
      [REST]: this.restMessage(events, now),
    };
    const first = Number(counts[COUNTS.FIRST]), second = Number(counts[COUNTS.SECOND]);
    if (reason in messages) {
      const waits = (reason === TIME || reason === NOTHING_LEFT) && timeLimit < Infinity;
      this.stop = { reason, time: waits ? timeLimit : time, balls: [], message: messages[reason] };
    } else if (reason === WALL_TRAP) {
      this.stop = { reason, time, balls: [first], message: this.trapMessage(first) };
    } else {
      const atWall = second === NO_PARTNER, balls = atWall ? [first] : [first, second];
      const pair = atWall ? phrase`ball ${first} and the wall` : phrase`balls ${first} and ${second}`;
      const cor = Math.min(...(atWall ? lawsOfWall(scene.wallLaw) : [scene.pairLaw]).map((law) => law.cor ?? 0));
      // An elastic ball that moves along the wall touches it at every moment, and loses nothing.
      const what = cor < 1 ? phrase`inelastic collapse` : phrase`collisions without end`;
      const parts = [
        phrase`${what}: collisions continue, but time stays at ${general(time, 17)} s`,
        phrase`the last collision is of ${pair}`,
        this.savedEvents(),
      ];
      this.stop = { reason, time, balls, message: parts.join("; ") };
    }
    return this.stop;
  }

  /** End the repeat for a reason of the page. */
  halt(message) {
    const { time, collisions } = this;
    const sentence = phrase`${message}, after ${grouped(collisions)} collisions`;
    this.stop = { reason: null, time, balls: [], message: sentence };
  }

  savedEvents() {
    const { collisions } = this;
    if (collisions === 1) return phrase`1 collision is saved`;
    return phrase`${grouped(collisions)} collisions are saved`;
  }

  trapMessage(ball) {
    const { time, kernels, parts } = this, { name, cor } = this.scene.wallLaw;
    kernels.trap();
    const lasts = parts.answers[ANSWERS.LASTS], given = parts.answers[ANSWERS.GIVEN];
    const end = general(time + lasts, 9), impulse = general(given, 6);
    let what = phrase`stays at the wall, because the wall CoR is 0`;
    if (name !== "constant" || (rubsWall(this.scene.surface) && cor > 0)) {
      const most = phrase`at most ${impulse} kg m/s more, if no other ball hits it`;
      what = phrase`bounces ever faster at the wall: it stops by ${end} s and gives it ${most}`;
    } else if (cor > 0) {
      what = phrase`bounces infinitely often at the wall, until ${end} s, and gives it ${impulse} kg m/s more`;
    }
    return phrase`wall trap: from ${general(time, 9)} s on, ball ${ball} ${what}; ${this.savedEvents()}`;
  }
}

// Numbers in sentences, as Python writes them

/** A whole number with commas between thousands. */
function grouped(number) {
  return String(number).replace(/\B(?=(\d{3})+$)/g, ",");
}

const collisionsText = (number) => (number === 1 ? phrase`1 collision` : phrase`${grouped(number)} collisions`);

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

// Scenes in which nothing happens, see ``never_meet`` of contact.py

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

/** A double over the least one, 2^-1074: a whole number. */
function wholeOf(value) {
  const bits = new BigUint64Array(new Float64Array([Math.abs(value)]).buffer)[0];
  const power = bits >> 52n, fraction = bits & ((1n << 52n) - 1n);
  const whole = power === 0n ? fraction : (fraction | (1n << 52n)) << (power - 1n);
  return value < 0 ? -whole : whole;
}
