// Panels of a chart, one below the other: axes with labels, curves, steps of a histogram.

const RIGHT_MARGIN = 12; // px to the right of a curve
const DASHES = { line: [6, 4], text: "- -" }, DOTS = { line: [1.5, 3], text: "···" };
const VEIL = 0.8; // how much of a curve the paper behind a name hides
const BIN = 0.2, BINS = 15; // of speeds over √(2T/m); the last bin has all faster balls
const MOST_SHARE = 0.25; // of the balls in a bin, at the top of the panel
const EDGE = 1e-9; // a speed this little below an edge, in bins, is above it: equal speeds are in one bin
const SPEED_AXIS = phrase`speed ÷ √(2T/m); last bar: ${(BIN * (BINS - 1)).toFixed(1)} and more`;

// The bin of a speed over √(2T/m).
const binOf = (reduced) => Math.min(Math.floor(reduced / BIN + EDGE), BINS - 1);

// Draws a line through points in order of x. At most four of a pixel's column are kept: the first,
// the lowest, the highest and the last, so that it looks the same and takes as long for any number.
class ThinLine {
  constructor(pen) {
    this.pen = pen;
    pen.beginPath();
  }

  add(x, y) {
    const column = Math.floor(2 * x);
    if (column !== this.column) {
      this.leave();
      this.pen.lineTo(x, y);
      [this.column, this.low, this.high] = [column, y, y];
    }
    [this.x, this.y] = [x, y];
    this.low = Math.min(this.low, y);
    this.high = Math.max(this.high, y);
  }

  leave() {
    if (this.column === undefined) return;
    if (this.low < this.high) for (const y of [this.low, this.high, this.y]) this.pen.lineTo(this.x, y);
  }

  stroke() {
    this.leave();
    this.pen.stroke();
  }
}

// A panel has a name, a largest value `top`, and perhaps a least one `low` [0], `log` for a
// logarithmic axis, `percent` for its labels. `foot` says that an axis with labels is below it.
class Panels {
  constructor(canvas, panels) {
    this.canvas = canvas;
    this.panels = panels;
  }

  // Decides where the panels are on a canvas of a size, px; labels of a font size are to their left.
  layOut(pen, width, height, size) {
    const foot = 2.9 * size, feet = this.panels.filter((panel) => panel.foot).length;
    const room = (height - feet * foot) / this.panels.length;
    this.size = size;
    this.font = pen.font = `${size}px system-ui, "Segoe UI", "DejaVu Sans", sans-serif`;
    this.gap = 0.75 * size;
    let top = 0;
    for (const panel of this.panels) {
      panel.head = top + 1.25 * size;
      panel.bottom = top + room - 0.5 * size;
      panel.right = width - RIGHT_MARGIN;
      top += room + (panel.foot ? foot : 0);
      panel.ticks = panel.log ? logTicks(panel) : linearTicks(panel);
    }
    const labels = this.panels.flatMap(({ ticks }) => ticks.map(([, text]) => text));
    this.left = Math.max(...labels.map((text) => pen.measureText(text).width)) + size;
    this.wide = width - RIGHT_MARGIN - this.left;
  }

  // The height of a value in a panel, px.
  up(panel, value) {
    const low = panel.low ?? 0, room = panel.bottom - panel.head - this.gap;
    const part = panel.log
      ? Math.log(Math.max(value, low / 10) / low) / Math.log(panel.top / low)
      : (value - low) / (panel.top - low);
    return panel.bottom - part * room;
  }

  // The lines and labels of the values of all panels.
  grid(pen) {
    const soft = paint("soft"), rule = paint("rule");
    pen.textBaseline = "middle";
    pen.textAlign = "right";
    pen.lineWidth = 1;
    for (const panel of this.panels) {
      for (const [value, text] of panel.ticks) {
        const y = Math.round(this.up(panel, value)) + 0.5;
        pen.strokeStyle = value === (panel.low ?? 0) ? soft : rule;
        pen.beginPath();
        pen.moveTo(this.left, y);
        pen.lineTo(panel.right, y);
        pen.stroke();
        pen.fillStyle = soft;
        pen.fillText(text, this.left - this.size / 2, y);
      }
    }
  }

  // The labels and the name of an axis below a panel, as many as there is room for.
  footer(pen, panel, across, low, high, least, name) {
    const size = this.size;
    pen.fillStyle = paint("soft");
    pen.textBaseline = "top";
    pen.textAlign = "center";
    let ticks = [];
    for (let most = 6; most > 1; most--) {
      const step = Math.max(niceStep(high - low, most), least);
      ticks = multiples(step, low, high).map((value) => [value, tickLabel(value, step)]);
      const needed = Math.max(...ticks.map(([, text]) => pen.measureText(text).width)) + size;
      if (needed * (high - low) <= step * (across(high) - across(low))) break;
    }
    for (const [value, text] of ticks) {
      const end = panel.right + RIGHT_MARGIN - pen.measureText(text).width / 2;
      pen.fillText(text, Math.min(across(value), end), panel.bottom + size / 2);
    }
    pen.textAlign = "right";
    pen.fillText(name, panel.right, panel.bottom + 1.75 * size);
  }

  // Draws inside a panel only.
  inside(pen, panel, draw) {
    pen.save();
    pen.beginPath();
    pen.rect(this.left, panel.head + this.gap, panel.right - this.left, panel.bottom - panel.head - this.gap + 1);
    pen.clip();
    draw();
    pen.restore();
  }

  // The name of a panel, and on the right texts such as [colour, "3 J"], the last one outermost.
  heading(pen, panel, texts) {
    let right = panel.right;
    pen.font = `600 ${this.font}`;
    pen.textAlign = "right";
    pen.textBaseline = "alphabetic";
    for (const [colour, text] of texts.reverse()) {
      pen.fillStyle = colour;
      pen.fillText(text, right, panel.head);
      right -= pen.measureText(text).width + this.size;
    }
    pen.font = this.font;
    pen.textAlign = "left";
    pen.fillStyle = paint("ink");
    pen.fillText(panel.name, this.left, panel.head, Math.max(right - this.left, 1));
  }

  // A line of text at the right, below a panel's heading or above its foot: the name of a curve.
  note(pen, panel, text, line = 0, low = false) {
    pen.textAlign = "right";
    pen.textBaseline = low ? "bottom" : "top";
    const down = (0.4 + 1.3 * line) * this.size;
    const y = low ? panel.bottom - down : panel.head + this.gap + down;
    const colour = pen.fillStyle, room = panel.right - this.left, wide = Math.min(pen.measureText(text).width, room);
    pen.fillStyle = paint("paper");
    pen.globalAlpha = VEIL;
    pen.fillRect(panel.right - wide - 3, low ? y - 1.2 * this.size : y - 1, wide + 3, 1.2 * this.size);
    pen.globalAlpha = 1;
    pen.fillStyle = colour;
    pen.fillText(text, panel.right, y, room);
  }

  // The steps of a histogram of speeds, filled or as a line. A bar that is too high has no top.
  bars(pen, panel, shares, filled) {
    const width = this.wide / shares.length;
    pen.strokeStyle = pen.fillStyle;
    pen.lineWidth = 1.6;
    this.inside(pen, panel, () => {
      pen.beginPath();
      pen.moveTo(this.left, panel.bottom);
      shares.forEach((share, bin) => {
        const y = this.up(panel, share);
        pen.lineTo(this.left + bin * width, y);
        pen.lineTo(this.left + (bin + 1) * width, y);
      });
      pen.lineTo(panel.right, panel.bottom);
      pen.stroke();
      if (!filled) return;
      pen.globalAlpha = 0.25;
      pen.fill();
    });
  }

  // Where a speed over √(2T/m) is on the axis of a histogram.
  reduced(value) {
    return this.left + (value / (BIN * BINS)) * this.wide;
  }

  // The curve of a density of speeds over √(2T/m) beside a histogram.
  density(pen, panel, law) {
    this.inside(pen, panel, () => {
      pen.beginPath();
      for (let v = 0; v <= BIN * BINS; v += BIN / 8) pen.lineTo(this.reduced(v), this.up(panel, BIN * law(v)));
      pen.stroke();
    });
  }
}

function linearTicks({ low = 0, top, percent }) {
  const step = niceStep(top - low, 4), text = (value) => (percent ? `${Math.round(100 * value)} %` : tickLabel(value, step));
  return multiples(step, low, top).map((value) => [value, text(value)]);
}

// The multiples of a step from one value to another; zero is exact.
function multiples(step, low, high) {
  const first = Math.ceil(low / step - 1e-9), last = Math.floor(high / step + 1e-9);
  return Array.from({ length: last - first + 1 }, (_, k) => (first + k) * step);
}

function logTicks({ low, top }) {
  const first = Math.ceil(Math.log10(low) - 1e-9), last = Math.floor(Math.log10(top) + 1e-9), ticks = [];
  const step = Math.max(1, Math.ceil((last - first) / 4));
  for (let power = first; power <= last; power += step) ticks.push([10 ** power, tickLabel(10 ** power, 10 ** power)]);
  return ticks;
}
