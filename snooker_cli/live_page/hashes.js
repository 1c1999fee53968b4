// SHA-256 (FIPS 180-4), and the hash of a repeat's events.

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
  return Number(root & 0xffffffffn);
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

const EVENTS_AT_ONCE = 8; // eight events are three blocks, or four

/** The hash of a repeat's events, kept at 1,000, 10,000, 100,000 … events; see ``event_hashes``. */
class EventHash {
  /** words : those of a record that belong to an event */
  constructor(words) {
    this.sha = new Sha256();
    this.words = words;
    this.waiting = new Int32Array(words.length * EVENTS_AT_ONCE); // which the hash has not taken yet
    this.view = new DataView(this.waiting.buffer);
    this.used = 0; // of them
    this.count = 0;
    this.next = 1000;
    this.kept = [];
  }

  /** Add the events of the last call of ``advance``, but for those that it has.
   *
   * records : of the engine; count : the number of events; before : number of events before them
   */
  addAll(records, count, before) {
    for (let k = this.count - before; k < count; k += 1) this.add(records, k * EVENT_WORDS);
  }

  /** Add the event whose record begins at a word. */
  add(records, begin) {
    const { used, words, waiting } = this;
    for (let k = 0; k < words.length; k += 1) waiting[used + k] = records[begin + words[k]];
    this.used = used + words.length;
    if (this.used === waiting.length) {
      this.sha.updateBlocks(this.view);
      this.used = 0;
    }
    this.count += 1;
    if (this.count === this.next) {
      this.kept.push([this.count, this.digest()]);
      this.next *= 10;
    }
  }

  digest() {
    return this.sha.digest(new Uint8Array(this.waiting.buffer, 0, 4 * this.used));
  }
}
