// Where everything is at any time: balls move straight between the collisions that are stored.
"use strict";

function unpacked(text, Kind) {
  const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  return new Kind(bytes.buffer);
}

class Motion {
  // The bodies are the balls and, as the last one, the container. A body's row holds x, y (m), u, v
  // (m/s) and its own clock (s): it is brought to the present only when it collides.
  constructor(film) {
    this.start = film.start;
    this.end = film.end;
    this.time = unpacked(film.time, Float64Array);
    this.i = unpacked(film.i, Int32Array);
    this.j = unpacked(film.j, Int32Array);
    this.after = unpacked(film.after, Float64Array);
    this.contacts = unpacked(film.contacts, Float32Array);
    const balls = unpacked(film.balls, Float64Array);
    this.number = balls.length / 5;
    this.radii = balls.slice(4 * this.number);
    this.bodies = new Float64Array(5 * (this.number + 1));
    for (let ball = 0; ball < this.number; ball++) {
      for (let row = 0; row < 4; row++) this.bodies[5 * ball + row] = balls[row * this.number + ball];
      this.bodies[5 * ball + 4] = film.start;
    }
    this.bodies.set([...film.container, film.start], 5 * this.number);
    this.done = 0;
    this.stride = Math.max(1, Math.ceil(Math.sqrt(this.time.length)));
    this.kept = [this.bodies.slice()];
    while (this.done < this.time.length) {
      this.collide();
      if (this.done % this.stride === 0) this.kept.push(this.bodies.slice());
    }
  }

  bring(body, now) {
    const b = this.bodies, k = 5 * body, age = now - b[k + 4];
    b[k] += b[k + 2] * age;
    b[k + 1] += b[k + 3] * age;
    b[k + 4] = now;
  }

  turn(body, now, u, v) {
    this.bring(body, now);
    this.bodies[5 * body + 2] = u;
    this.bodies[5 * body + 3] = v;
  }

  // Carries out the next collision.
  collide() {
    const k = this.done++, now = this.time[k], after = this.after, j = this.j[k];
    this.turn(this.i[k], now, after[4 * k], after[4 * k + 1]);
    this.turn(j < 0 ? this.number : j, now, after[4 * k + 2], after[4 * k + 3]);
  }

  // Goes to just after so many collisions, from the last state kept before it.
  seek(done) {
    const page = Math.floor(done / this.stride);
    if (done < this.done || page * this.stride > this.done) {
      this.bodies.set(this.kept[page]);
      this.done = page * this.stride;
    }
    while (this.done < done) this.collide();
  }

  // How many collisions there have been at a time; one at that very time is among them.
  count(time) {
    let low = 0, high = this.time.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.time[middle] <= time) low = middle + 1;
      else high = middle;
    }
    return low;
  }

  // [x, y] of a body at a time that no collision lies before but those done.
  place(body, time) {
    const b = this.bodies, k = 5 * body, age = time - b[k + 4];
    return [b[k] + b[k + 2] * age, b[k + 1] + b[k + 3] * age];
  }

  speed(body) {
    return Math.hypot(this.bodies[5 * body + 2], this.bodies[5 * body + 3]);
  }

  // The balls' mean speed now, m/s.
  meanSpeed() {
    let sum = 0;
    for (let ball = 0; ball < this.number; ball++) sum += this.speed(ball);
    return sum / this.number;
  }

  // All places at a time: [[x, y], ...], the container's last.
  places(time) {
    this.seek(this.count(time));
    return Array.from({ length: this.number + 1 }, (_, body) => this.place(body, time));
  }
}

// A moment of showing. At an even pace it is known by its time; one collision after the other by its
// step: k is just after collision k, and between two the balls move as usual.
class Reel {
  constructor(motion) {
    this.motion = motion;
    this.knots = [motion.start, ...motion.time];
    if (motion.end > this.knots[this.knots.length - 1]) this.knots.push(motion.end);
    this.steps = this.knots.length - 1;
    this.goToStep(0);
  }

  goToTime(time) {
    const { start, end } = this.motion;
    this.time = Math.min(Math.max(time, start), end);
    this.done = this.motion.count(this.time);
    const before = this.knots[this.done], after = this.knots[this.done + 1];
    this.step = this.done + (after > before ? (this.time - before) / (after - before) : 0);
  }

  goToStep(step) {
    this.step = Math.min(Math.max(step, 0), this.steps);
    const whole = Math.min(Math.floor(this.step), this.steps);
    this.done = Math.min(whole, this.motion.time.length);
    const before = this.knots[whole], after = this.knots[Math.min(whole + 1, this.steps)];
    this.time = before + (this.step - whole) * (after - before);
  }
}
