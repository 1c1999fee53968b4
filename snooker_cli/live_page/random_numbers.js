"use strict";

// Random numbers and hashes with the bits of placement/random_numbers.py and of NumPy's PCG64.

const MASK_32 = 0xffffffffn, MASK_64 = (1n << 64n) - 1n, MASK_128 = (1n << 128n) - 1n;
const PLACES = 1, MAXWELL = 2, WALL = 3; // streams of a repeat besides that of its directions

/** The 32-bit words of a whole number, the lowest first. */
function wordsOf(number) {
  const words = [];
  do {
    words.push(Number(number & MASK_32));
    number >>= 32n;
  } while (number > 0n);
  return words;
}

/** Four numbers of 64 bits from a seed and a key, as NumPy's SeedSequence (O'Neill's seed_seq). */
function seedSequence(seed, spawnKey) {
  const entropy = wordsOf(seed);
  while (entropy.length < 4) entropy.push(0);
  for (const key of spawnKey) entropy.push(...wordsOf(BigInt(key)));
  let constant = 0x43b0d7e5;
  function hashed(value) {
    value ^= constant;
    constant = Math.imul(constant, 0x931e8875);
    value = Math.imul(value, constant);
    return value ^ (value >>> 16);
  }
  function mix(a, b) {
    const result = Math.imul(a, 0xca01f9dd) - Math.imul(b, 0x4973f715) | 0;
    return result ^ (result >>> 16);
  }
  const pool = [0, 1, 2, 3].map((k) => hashed(entropy[k]));
  for (let from = 0; from < 4; from += 1) {
    for (let to = 0; to < 4; to += 1) {
      if (from !== to) pool[to] = mix(pool[to], hashed(pool[from]));
    }
  }
  for (const word of entropy.slice(4)) {
    for (let to = 0; to < 4; to += 1) pool[to] = mix(pool[to], hashed(word));
  }
  constant = 0x8b51f9dd;
  const words = [];
  for (let k = 0; k < 8; k += 1) {
    let value = pool[k % 4] ^ constant;
    constant = Math.imul(constant, 0x58f38ded);
    value = Math.imul(value, constant);
    words.push(BigInt((value ^ (value >>> 16)) >>> 0));
  }
  return [0, 2, 4, 6].map((k) => words[k] | (words[k + 1] << 32n));
}

/** The random bits of a repeat for a purpose: PCG64 (O'Neill, XSL-RR). */
class Stream {
  constructor(seed, repeat, ...purpose) {
    const [high, low, streamHigh, streamLow] = seedSequence(seed, [repeat, ...purpose]);
    this.increment = ((((streamHigh << 64n) | streamLow) << 1n) | 1n) & MASK_128;
    this.state = 0n;
    this.step();
    this.state = (this.state + ((high << 64n) | low)) & MASK_128;
    this.step();
  }

  step() {
    this.state = (this.state * 0x2360ed051fc65da44385df649fccf645n + this.increment) & MASK_128;
  }

  /** The next 64 bits. */
  raw() {
    this.step();
    const folded = (this.state >> 64n) ^ (this.state & MASK_64), turn = this.state >> 122n;
    return ((folded >> turn) | (folded << (64n - turn))) & MASK_64;
  }

  /** A multiple of 2^-53 from 0 to below 1. */
  uniform() {
    return Number(this.raw() >> 11n) * 2 ** -53;
  }
}

/** Uniform points of the unit disk, x0, y0, x1 …; their squared radius is above ``least``. */
function pointsInDisc(stream, number, least) {
  const chosen = [];
  // Drawn in batches, as in Python: what is left of a batch is not used.
  while (chosen.length < 2 * number) {
    const missing = number - chosen.length / 2, drawn = missing + Math.floor(missing / 2) + 8;
    for (let k = 0; k < drawn; k += 1) {
      const x = 2 * stream.uniform() - 1, y = 2 * stream.uniform() - 1;
      const square = x * x + y * y;
      if (square > least && square <= 1 && chosen.length < 2 * number) chosen.push(x, y);
    }
  }
  return chosen;
}

/** Random unit vectors, x0, y0, x1 …. */
function randomDirections(number, seed, repeat) {
  const points = pointsInDisc(new Stream(seed, repeat), number, 0.0625);
  for (let k = 0; k < 2 * number; k += 2) {
    const x = points[k], y = points[k + 1], length = Math.sqrt(x * x + y * y);
    points[k] = x / length;
    points[k + 1] = y / length;
  }
  return points;
}

/** Pairs of independent normal deviates of variance 1, as Marsaglia's polar method gives them. */
function randomNormals(number, seed, repeat) {
  const points = pointsInDisc(new Stream(seed, repeat, MAXWELL), number, 0);
  for (let k = 0; k < 2 * number; k += 2) {
    const x = points[k], y = points[k + 1], square = x * x + y * y;
    const factor = Math.sqrt(-2 * logarithm(square) / square);
    points[k] = x * factor;
    points[k + 1] = y * factor;
  }
  return points;
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

/** The whole numbers below ``number`` in random order. */
function shuffled(stream, number) {
  const keys = Array.from({ length: number }, () => stream.raw());
  const order = (a, b) => (keys[a] < keys[b] ? -1 : keys[a] > keys[b] ? 1 : a - b);
  return keys.map((_, k) => k).sort(order);
}

/** The key of the random numbers of a repeat's thermal wall, below 2^63. */
function wallKey(seed, repeat) {
  return new Stream(seed, repeat, WALL).raw() >> 1n;
}

// SHA-256 (FIPS 180-4)

const primes = [];
for (let number = 2; primes.length < 64; number += 1) {
  if (primes.every((prime) => number % prime)) primes.push(number);
}

/** The first 32 binary digits after the point of the n-th root of a small prime, n = 2 or 3. */
function rootDigits(prime, n) {
  const wanted = BigInt(prime) << BigInt(32 * n);
  let root = 0n;
  for (let bit = 40n; bit >= 0n; bit -= 1n) {
    const larger = root | (1n << bit);
    if (larger ** BigInt(n) <= wanted) root = larger;
  }
  return Number(root & MASK_32);
}

const ROUND_CONSTANTS = Int32Array.from(primes, (prime) => rootDigits(prime, 3));
const FIRST_STATE = Int32Array.from(primes.slice(0, 8), (prime) => rootDigits(prime, 2));

class Sha256 {
  constructor() {
    this.state = Int32Array.from(FIRST_STATE);
    this.block = new Uint8Array(64);
    this.view = new DataView(this.block.buffer);
    this.words = new Int32Array(64);
    this.length = 0; // bytes
  }

  update(bytes) {
    for (let k = 0; k < bytes.length; k += 1) {
      this.block[this.length % 64] = bytes[k];
      this.length += 1;
      if (this.length % 64 === 0) this.mixBlock(this.view, 0);
    }
  }

  /** Take whole blocks of 64 bytes, after none or whole ones; faster than ``update``. */
  updateBlocks(view) {
    for (let begin = 0; begin < view.byteLength; begin += 64) this.mixBlock(view, begin);
    this.length += view.byteLength;
  }

  mixBlock(view, begin) {
    const { state, words } = this;
    for (let k = 0; k < 16; k += 1) words[k] = view.getInt32(begin + 4 * k);
    for (let k = 16; k < 64; k += 1) {
      const p = words[k - 15], q = words[k - 2];
      const s = ((p >>> 7) | (p << 25)) ^ ((p >>> 18) | (p << 14)) ^ (p >>> 3);
      const t = ((q >>> 17) | (q << 15)) ^ ((q >>> 19) | (q << 13)) ^ (q >>> 10);
      words[k] = (words[k - 16] + s + words[k - 7] + t) | 0;
    }
    let a = state[0], b = state[1], c = state[2], d = state[3];
    let e = state[4], f = state[5], g = state[6], h = state[7];
    for (let k = 0; k < 64; k += 1) {
      const s = ((e >>> 6) | (e << 26)) ^ ((e >>> 11) | (e << 21)) ^ ((e >>> 25) | (e << 7));
      const t = (h + s + ((e & f) ^ (~e & g)) + ROUND_CONSTANTS[k] + words[k]) | 0;
      const w = ((a >>> 2) | (a << 30)) ^ ((a >>> 13) | (a << 19)) ^ ((a >>> 22) | (a << 10));
      const z = (w + ((a & b) ^ (a & c) ^ (b & c))) | 0;
      h = g;
      g = f;
      f = e;
      e = (d + t) | 0;
      d = c;
      c = b;
      b = a;
      a = (t + z) | 0;
    }
    state[0] += a;
    state[1] += b;
    state[2] += c;
    state[3] += d;
    state[4] += e;
    state[5] += f;
    state[6] += g;
    state[7] += h;
  }

  /** The hash of all bytes so far and of some more, in hexadecimal; others may follow instead. */
  digest(more = []) {
    const last = new Sha256();
    last.state.set(this.state);
    last.block.set(this.block);
    last.length = this.length;
    last.update(more);
    const padding = new Uint8Array(((119 - (last.length % 64)) % 64) + 9);
    padding[0] = 0x80;
    new DataView(padding.buffer).setBigUint64(padding.length - 8, BigInt(8 * last.length));
    last.update(padding);
    return Array.from(last.state, (word) => (word >>> 0).toString(16).padStart(8, "0")).join("");
  }
}

/** SHA-256 of a text, in hexadecimal. */
function hashOfText(text) {
  const sha = new Sha256();
  sha.update(utf8(text));
  return sha.digest();
}

/** The bytes of a text in UTF-8. */
function utf8(text) {
  const bytes = unescape(encodeURIComponent(text));
  return Uint8Array.from(bytes, (letter) => letter.charCodeAt(0));
}

const EVENT_BYTES = 24, EVENTS_AT_ONCE = 8; // eight events are three blocks

/** The hash of a repeat's events, kept at 1,000, 10,000, 100,000 … events; see ``event_hashes``. */
class EventHash {
  constructor() {
    this.sha = new Sha256();
    this.bytes = new Uint8Array(EVENT_BYTES * EVENTS_AT_ONCE);
    this.view = new DataView(this.bytes.buffer);
    this.used = 0; // bytes of events that the hash has not taken yet
    this.count = 0;
    this.next = 1000;
    this.kept = [];
  }

  /** Add the events of the last call of ``advance``. */
  addAll({ eventCount, eventTime, eventI, eventJ, eventImpulse }) {
    for (let k = 0; k < eventCount; k += 1) {
      this.add(eventTime[k], eventI[k], eventJ[k], eventImpulse[k]);
    }
  }

  add(time, i, j, impulse) {
    const { view, used } = this;
    view.setFloat64(used, time, true);
    view.setInt32(used + 8, i, true);
    view.setInt32(used + 12, j, true);
    view.setFloat64(used + 16, impulse, true);
    this.used = used + EVENT_BYTES;
    if (this.used === view.byteLength) {
      this.sha.updateBlocks(view);
      this.used = 0;
    }
    this.count += 1;
    if (this.count === this.next) {
      this.kept.push([this.count, this.digest()]);
      this.next *= 10;
    }
  }

  digest() {
    return this.sha.digest(this.bytes.subarray(0, this.used));
  }
}
