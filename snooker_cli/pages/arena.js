// The container, the balls coloured by speed, marks on those that turn, and the flashes of contacts.

const FLASH = 0.3; // s of playing
const MOST_FLASHES = 60;
const SMALLEST = 2; // px: the radius of balls that would be too small to see, to the middle of their rim
const SHADES = 64;
const RIM = "#434854"; // around each ball: it is dark on every floor, also where the ball is pale
// Of species, for colour-blind people too (Okabe & Ito); without the green of contacts.
const SPECIES = ["#0072b2", "#e69f00", "#cc79a7", "#f0e442", "#d55e00", "#56b4e9"];
const VIOLET = "#7b2cbf"; // the path of the tagged ball
const MARK = [[RIM, 3], ["#fff", 1]]; // of a ball that turns, on each of its colours
const NEAR = 6; // px: how near to a small ball a click is
const MOST_PARTS = 3000; // of a ball's path: the latest ones, because more would fill the container

function shades(colours) {
  const parts = colours.map((text) => [1, 3, 5].map((at) => parseInt(text.slice(at, at + 2), 16)));
  return Array.from({ length: SHADES }, (_, k) => {
    const place = (k / (SHADES - 1)) * (parts.length - 1);
    const first = Math.min(Math.floor(place), parts.length - 2), share = place - first;
    const mixed = parts[first].map((low, c) => Math.round(low + share * (parts[first + 1][c] - low)));
    return `rgb(${mixed.join(",")})`;
  });
}

// view: of ``viewOf``, and the colours of speeds.
class Arena {
  constructor(canvas, gas, view) {
    this.canvas = canvas;
    this.gas = gas;
    this.view = view;
    this.shades = shades(view.colours);
    this.still = window.matchMedia("(prefers-reduced-motion: reduce)").matches;
    this.colours = null; // of each ball, instead of those of speeds
  }

  // The ball at a place of the canvas as it was drawn last, or null.
  ballAt(px, py) {
    let nearest = Infinity, clicked = null;
    for (const [ball, x, y, r] of this.drawn) {
      const apart = Math.hypot(px - x, py - y);
      if (apart <= Math.max(r, NEAR) && apart < nearest) [nearest, clicked] = [apart, ball];
    }
    return clicked;
  }

  // flashes: [x, y, radius of the ball, age from 0 to 1], ... of contacts; topSpeed: of the brightest colour.
  draw(time, flashes, topSpeed) {
    const [pen, width, height] = sharp(this.canvas), { view, gas } = this;
    const centre = gas.place(gas.number, time);
    const origin = view.follow ? centre : [0, 0];
    const [left, right, bottom, top] = view.extent;
    const scale = Math.min(width / (right - left), height / (top - bottom));
    const x = (value) => width / 2 + (value - origin[0] - (left + right) / 2) * scale;
    const y = (value) => height / 2 - (value - origin[1] - (bottom + top) / 2) * scale;

    pen.fillStyle = paint("floor");
    this.outline(pen, x(centre[0]), y(centre[1]), scale);
    pen.fill();
    pen.save();
    if (view.periodic) {
      this.outline(pen, x(centre[0]), y(centre[1]), scale);
      pen.clip();
    }
    this.drawn = [];
    this.balls(pen, x, y, scale, time, centre, topSpeed);
    if (gas.tagged !== null) this.course(pen, x, y, time, centre);
    pen.restore();
    pen.lineWidth = view.periodic ? 1 : 2;
    pen.strokeStyle = paint(view.periodic ? "soft" : "ink");
    pen.setLineDash(view.periodic ? [5, 4] : []);
    this.outline(pen, x(centre[0]), y(centre[1]), scale);
    pen.stroke();
    pen.setLineDash([]);
    if (view.periodic) this.sides(pen, x, y, centre);
    pen.strokeStyle = pen.fillStyle = paint("contact");
    for (const [px, py, r, age] of flashes) this.flash(pen, x(px), y(py), r * scale, age);
  }

  outline(pen, x, y, scale) {
    pen.beginPath();
    for (const [px, py] of this.view.outline) pen.lineTo(x + px * scale, y - py * scale);
    pen.closePath();
  }

  // The walls of a container that repeats, such as left and right of a channel.
  sides(pen, x, y, centre) {
    const [w, h] = this.view.size, [left, right, bottom, top] = [-w / 2, w / 2, -h / 2, h / 2];
    const ends = {
      left: [left, bottom, left, top], right: [right, bottom, right, top],
      bottom: [left, bottom, right, bottom], top: [left, top, right, top],
    };
    pen.lineWidth = 2;
    pen.strokeStyle = paint("ink");
    pen.beginPath();
    for (const side of this.view.sides) {
      const [ax, ay, bx, by] = ends[side];
      pen.moveTo(x(centre[0] + ax), y(centre[1] + ay));
      pen.lineTo(x(centre[0] + bx), y(centre[1] + by));
    }
    pen.stroke();
  }

  balls(pen, x, y, scale, time, centre, topSpeed) {
    const { gas } = this, periodic = this.view.periodic, [w, h] = this.view.size;
    pen.lineWidth = 1;
    pen.strokeStyle = RIM;
    for (let ball = 0; ball < gas.number; ball++) {
      let [px, py] = gas.place(ball, time);
      const r = gas.radii[ball], turned = gas.scene.surface ? gas.simulation.angleOf(ball, time) : null;
      const part = Math.min(gas.speed(ball) / topSpeed, 1) || 0;
      pen.fillStyle = this.colours?.[ball] ?? this.shades[Math.round(part * (SHADES - 1))];
      let across = [0], along = [0];
      if (periodic) {
        px -= w * Math.round((px - centre[0]) / w);
        py -= h * Math.round((py - centre[1]) / h);
        across = images(px - centre[0], r, w);
        along = images(py - centre[1], r, h);
      }
      for (const dx of across) {
        for (const dy of along) {
          pen.beginPath();
          pen.arc(x(px + dx), y(py + dy), Math.max(r * scale - 0.5, SMALLEST), 0, 2 * Math.PI);
          pen.fill();
          pen.stroke();
          if (turned !== null) {
            pen.beginPath();
            pen.moveTo(x(px + dx), y(py + dy));
            pen.lineTo(x(px + dx + r * Math.cos(turned)), y(py + dy + r * Math.sin(turned)));
            strokes(pen, MARK);
            pen.strokeStyle = RIM;
          }
          this.drawn.push([ball, x(px + dx), y(py + dy), r * scale]);
        }
      }
    }
  }

  // The tagged ball's path until now. Where a container repeats, what leaves it goes on at the other side.
  course(pen, x, y, time, centre) {
    const line = this.gas.pathUntil(time, MOST_PARTS).map(([, ...place]) => place);
    const parts = line.slice(1).flatMap((end, k) =>
      (this.view.periodic ? partsInside(line[k], end, centre, this.view.size) : [[line[k], end]]));
    pen.beginPath();
    for (const [[ax, ay], [bx, by]] of parts.slice(-MOST_PARTS)) {
      pen.moveTo(x(ax), y(ay));
      pen.lineTo(x(bx), y(by));
    }
    strokes(pen, [["#fff", 3.5], [VIOLET, 1.5]]);
  }

  flash(pen, px, py, r, age) {
    const grown = this.still ? 0.5 : 1 - (1 - age) ** 2;
    pen.globalAlpha = (1 - age) ** 1.5;
    pen.lineWidth = 2;
    pen.beginPath();
    pen.arc(px, py, Math.max(2, r * (0.15 + 0.55 * grown)), 0, 2 * Math.PI);
    pen.stroke();
    pen.beginPath();
    pen.arc(px, py, Math.max(1.5, r * 0.16 * (1 - age)), 0, 2 * Math.PI);
    pen.fill();
    pen.globalAlpha = 1;
  }
}

// Draws a line in colours and widths, one on top of the other.
function strokes(pen, lines) {
  for (const [colour, width] of lines) {
    pen.strokeStyle = colour;
    pen.lineWidth = width;
    pen.stroke();
  }
}

// What the arena shows of a container, which it follows when it moves. extent: left, right, bottom
// and top, m.
function viewOf({ shape, size: [width, height] }) {
  const corners = 180, angle = (2 * Math.PI) / corners, radius = width / 2;
  const outline = shape === "circle"
    ? Array.from({ length: corners }, (_, k) => [radius * Math.cos(k * angle), radius * Math.sin(k * angle)])
    : [[-1, -1], [1, -1], [1, 1], [-1, 1]].map(([x, y]) => [(x * width) / 2, (y * height) / 2]);
  const margin = 0.03 * Math.max(width, height), reach = [width / 2 + margin, height / 2 + margin];
  const { periodic, sides } = SHAPES[shape];
  return { outline, periodic: periodic.includes(true), sides, size: [width, height],
    extent: [-reach[0], reach[0], -reach[1], reach[1]], follow: true };
}

// A straight way as its parts in the boxes of a size that it passes, each moved into the box at a centre.
function partsInside(begin, end, centre, size) {
  const along = (share) => [0, 1].map((axis) => begin[axis] + share * (end[axis] - begin[axis]));
  const shares = [0, 1].flatMap((axis) => {
    const from = (begin[axis] - centre[axis]) / size[axis], to = (end[axis] - centre[axis]) / size[axis];
    const first = Math.ceil(Math.min(from, to) - 0.5), edges = Math.floor(Math.max(from, to) - 0.5) - first + 1;
    const last = Array.from({ length: Math.min(edges, MOST_PARTS) }, (_, k) => first + (from < to ? edges - 1 - k : k));
    return last.map((edge) => (edge + 0.5 - from) / (to - from));
  });
  const cuts = [...shares.sort((first, second) => first - second), 1];
  return cuts.map((cut, k) => {
    const from = k ? cuts[k - 1] : 0, middle = along((from + cut) / 2);
    const moved = middle.map((value, axis) => size[axis] * Math.round((value - centre[axis]) / size[axis]));
    return [from, cut].map((share) => along(share).map((value, axis) => value - moved[axis]));
  });
}

// Where a ball of a periodic box is seen again, as it sticks out of the box.
function images(place, radius, side) {
  if (place > side / 2 - radius) return [0, -side];
  return place < radius - side / 2 ? [0, side] : [0];
}
