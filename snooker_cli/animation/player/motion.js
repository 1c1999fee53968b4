// Where everything is at any time: balls move straight between the collisions that are stored, or
// slide along a circle's fixed wall after infinitely many bounces, of which none is stored.
"use strict";

// In place of the container, in a collision that represents all the bounces before a slide, or for
// the pressing of one.
const SLIDE = -2;

// Normal over tangential speed of bounces that cannot be seen any more.
const FLAT = 1e-9;

// A body's row: x, y (m), u, v (m/s), its own clock (s), and 1 if it slides, otherwise 0.
const X = 0, Y = 1, U = 2, V = 3, CLOCK = 4, SLIDES = 5, ROW = 6;

function unpacked(text, Kind) {
  const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  return new Kind(bytes.buffer);
}

class Motion {
  // The bodies are the balls and, as the last one, the container. A body is brought to the present
  // only when it collides.
  constructor(film) {
    this.start = film.start;
    this.end = film.end;
    this.time = unpacked(film.time, Float64Array);
    this.i = unpacked(film.i, Int32Array);
    this.j = unpacked(film.j, Int32Array);
    this.after = unpacked(film.after, Float64Array);
    this.contacts = unpacked(film.contacts, Float32Array);
    this.wall = { radius: film.size[0] / 2, cor: film.wallCor, centre: film.container };
    this.settling = film.settling;
    const balls = unpacked(film.balls, Float64Array);
    this.number = balls.length / 5;
    this.radii = balls.slice(4 * this.number);
    this.bodies = new Float64Array(ROW * (this.number + 1));
    for (let ball = 0; ball < this.number; ball++) {
      for (let row = X; row <= V; row++) {
        this.bodies[ROW * ball + row] = balls[row * this.number + ball];
      }
      this.bodies[ROW * ball + CLOCK] = film.start;
    }
    this.bodies.set([...film.container, film.start], ROW * this.number);
    for (const ball of film.sliding) this.bodies[ROW * ball + SLIDES] = 1;
    this.done = 0;
    this.stride = Math.max(1, Math.ceil(Math.sqrt(this.time.length)));
    this.kept = [this.bodies.slice()];
    while (this.done < this.time.length) {
      this.collide();
      if (this.done % this.stride === 0) this.kept.push(this.bodies.slice());
    }
  }

  turn(body, now, u, v, slides) {
    this.bodies.set([...this.place(body, now), u, v, now, slides], ROW * body);
  }

  // Carries out the next collision.
  collide() {
    const k = this.done, now = this.time[k], after = this.after, i = this.i[k], j = this.j[k];
    this.turn(i, now, after[4 * k], after[4 * k + 1], j === SLIDE ? 1 : 0);
    if (j !== SLIDE) {
      this.turn(j < 0 ? this.number : j, now, after[4 * k + 2], after[4 * k + 3], 0);
    }
    this.done++;
  }

  // Goes to just after a number of collisions, from the last state kept before it.
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
    const b = this.bodies, k = ROW * body, age = time - b[k + CLOCK];
    if (b[k + SLIDES]) return this.sliding(body, age);
    const next = this.done;
    const settles = next < this.time.length
      ? this.j[next] === SLIDE && this.i[next] === body
      : this.settling === body;
    if (settles) return this.bouncing(body, age);
    return [b[k + X] + b[k + U] * age, b[k + Y] + b[k + V] * age];
  }

  // Where a ball is that has slid for so long: it turns round the centre at a constant rate.
  sliding(body, age) {
    const b = this.bodies, k = ROW * body, [cx, cy] = this.wall.centre;
    const x = b[k + X] - cx, y = b[k + Y] - cy;
    const angle = ((x * b[k + V] - y * b[k + U]) / (x * x + y * y)) * age;
    const c = Math.cos(angle), s = Math.sin(angle);
    return [cx + c * x - s * y, cy + s * x + c * y];
  }

  // Where a ball is that has bounced for so long, and will until it slides. A chord between hits
  // with the speeds n and t along the normal and the tangent lasts 2an/(n² + t²) and turns it by
  // 2 atan(n/t).
  bouncing(body, age) {
    const b = this.bodies, k = ROW * body, [cx, cy] = this.wall.centre;
    const x = b[k + X] - cx, y = b[k + Y] - cy, u = b[k + U], v = b[k + V];
    const a = this.wall.radius - this.radii[body];
    const outward = x * u + y * v, square = u * u + v * v;
    const root = Math.sqrt(Math.max(outward ** 2 - square * (x * x + y * y - a * a), 0));
    const hit = (root - outward) / square;
    if (!(hit < age)) return [cx + x + u * age, cy + y + v * age];
    let left = age - hit, angle = Math.atan2(y + v * hit, x + u * hit);
    const tangent = (x * v - y * u) / a;
    let normal = (this.wall.cor * root) / a;
    while (normal > FLAT * Math.abs(tangent)) {
      const lasts = (2 * a * normal) / (normal ** 2 + tangent ** 2);
      if (lasts > left) {
        const inward = a - normal * left, along = tangent * left;
        const c = Math.cos(angle), s = Math.sin(angle);
        return [cx + c * inward - s * along, cy + s * inward + c * along];
      }
      left -= lasts;
      angle += 2 * Math.atan(normal / tangent);
      normal *= this.wall.cor;
    }
    angle += (tangent / a) * left;
    return [cx + a * Math.cos(angle), cy + a * Math.sin(angle)];
  }

  // [time, x, y] of a ball at the start and after each of its collisions. Between them it flies
  // straight; while it slides, there is one for each collision of all. In a periodic box the path
  // goes on outside.
  path(ball) {
    const before = this.done, course = [];
    const add = (time) => course.push([time, ...this.place(ball, time)]);
    this.seek(0);
    add(this.start);
    while (this.done < this.time.length) {
      const k = this.done;
      this.collide();
      if (this.i[k] === ball || this.j[k] === ball || this.bodies[ROW * ball + SLIDES]) add(this.time[k]);
    }
    this.seek(before);
    return course;
  }

  speed(body) {
    return Math.hypot(this.bodies[ROW * body + U], this.bodies[ROW * body + V]);
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
