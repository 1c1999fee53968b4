// Kinetic energy, temperature and pressure as curves that grow.
"use strict";

// A colour of player.css; it follows the dark mode of the browser.
const paint = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`);
const MARGIN = 12; // px to the right of a curve
const RAISED = { "-": "⁻", 0: "⁰", 1: "¹", 2: "²", 3: "³", 4: "⁴", 5: "⁵", 6: "⁶", 7: "⁷", 8: "⁸", 9: "⁹" };

// A number with this many digits, large and small ones as 1.2 × 10⁻¹⁵.
function short(value, digits = 3) {
  if (value === 0) return "0";
  let text = value.toPrecision(digits);
  const size = Math.abs(Number(text));
  if (size >= 1e5 || size < 1e-4) {
    const [mantissa, power] = Number(text).toExponential(digits - 1).split("e");
    const raised = String(Number(power)).replace(/./g, (letter) => RAISED[letter]);
    text = `${mantissa} × 10${raised}`;
  } else if (text.includes("e")) {
    text = String(Number(text));
  }
  return text.replace("-", "−");
}

// Even steps of 1, 2 or 5 times a power of ten: at most this many up to a value.
function niceStep(range, most) {
  const rough = range / most, power = 10 ** Math.floor(Math.log10(rough));
  return power * [1, 2, 5, 10].find((factor) => factor * power >= rough * 0.999999);
}

function tickLabel(value, step) {
  if (Math.abs(value) >= 1e5 || step < 1e-4) return short(value, 2);
  return value.toFixed(Math.max(0, -Math.floor(Math.log10(step) + 1e-9)));
}

// A canvas as sharp as the screen, with the units of the page.
function sharp(canvas) {
  const ratio = window.devicePixelRatio || 1;
  const width = canvas.clientWidth, height = canvas.clientHeight;
  if (canvas.width !== Math.round(width * ratio)) canvas.width = Math.round(width * ratio);
  if (canvas.height !== Math.round(height * ratio)) canvas.height = Math.round(height * ratio);
  const pen = canvas.getContext("2d");
  pen.setTransform(ratio, 0, 0, ratio, 0, 0);
  pen.clearRect(0, 0, width, height);
  return [pen, width, height];
}

class Charts {
  constructor(canvas, film, motion) {
    this.canvas = canvas;
    this.motion = motion;
    this.energy = unpacked(film.kineticEnergy, Float64Array);
    this.sum = unpacked(film.pressureSum, Float64Array);
    this.gain = film.pressureGain ? unpacked(film.pressureGain, Float64Array) : null;
    this.before = film.before;
    this.rows = [motion.start, ...motion.time];
    const temperature = this.energy.map((energy) => energy / motion.number);
    const pressure = this.rows.map((time, row) => this.pressure(row, time));
    const now = (reel) => this.energy[reel.done];
    this.panels = [
      { name: "kinetic energy", unit: "J", colour: "first", values: this.energy, now },
      { name: "temperature", unit: "J", colour: "second", values: temperature,
        now: (reel) => now(reel) / motion.number },
      { name: "mean pressure since t = 0", unit: "Pa m", colour: "third", values: pressure,
        most: film.pressureTop, now: (reel) => this.pressure(reel.done, reel.time) },
    ];
    for (const panel of this.panels) {
      const most = panel.most ?? panel.values.reduce((most, value) => Math.max(most, value), 0);
      panel.top = 1.08 * most || 1;
    }
  }

  // Mean pressure from the repeat's start to a time after a number of the film's collisions, Pa m.
  pressure(row, time) {
    const gain = this.gain ? this.gain[row] : 0;
    return time > 0 ? (this.sum[row] + gain * (time - this.rows[row])) / time : gain;
  }

  draw(reel, pace) {
    const [pen, width, height] = sharp(this.canvas);
    pen.font = "12px system-ui, 'Segoe UI', 'DejaVu Sans', sans-serif";
    const foot = 34, each = (height - foot) / this.panels.length;
    this.panels.forEach((panel, k) => {
      const box = { left: 52, right: width - MARGIN, top: k * each + 24, bottom: (k + 1) * each - 6 };
      this.panel(pen, box, panel, reel, pace, k === this.panels.length - 1);
    });
  }

  panel(pen, box, panel, reel, pace, last) {
    const byStep = pace === "events", { start, end } = this.motion;
    const [low, high] = byStep ? [0, this.motion.time.length || 1] : [start, end];
    const across = (value) => box.left + ((value - low) / (high - low)) * (box.right - box.left);
    const up = (value) => box.bottom - (value / panel.top) * (box.bottom - box.top);
    const at = (row) => across(byStep ? row : this.rows[row]);
    const soft = paint("soft"), rule = paint("rule"), colour = paint(panel.colour);

    pen.lineWidth = 1;
    pen.textBaseline = "middle";
    pen.textAlign = "right";
    const rise = niceStep(panel.top, 4);
    for (let value = 0; value <= panel.top; value += rise) {
      pen.strokeStyle = value === 0 ? soft : rule;
      pen.beginPath();
      pen.moveTo(box.left, Math.round(up(value)) + 0.5);
      pen.lineTo(box.right, Math.round(up(value)) + 0.5);
      pen.stroke();
      pen.fillStyle = soft;
      pen.fillText(tickLabel(value, rise), box.left - 6, up(value));
    }
    if (last) this.footer(pen, box, across, low, high, byStep);

    pen.save();
    pen.beginPath();
    pen.rect(box.left, box.top, box.right - box.left, box.bottom - box.top + 1);
    pen.clip();
    pen.strokeStyle = colour;
    pen.lineWidth = 1.6;
    pen.lineJoin = "round";
    pen.beginPath();
    const first = panel.values[0] === 0 ? 1 : 0; // a mean since t = 0 begins with a collision
    for (let row = first; row <= reel.done; row++) pen.lineTo(at(row), up(panel.values[row]));
    const value = panel.now(reel);
    const x = across(byStep ? Math.min(reel.step, high) : reel.time);
    pen.lineTo(x, up(value));
    pen.stroke();
    pen.restore();
    pen.fillStyle = colour;
    pen.beginPath();
    pen.arc(x, up(Math.min(value, panel.top)), 3.5, 0, 2 * Math.PI);
    pen.fill();

    pen.textBaseline = "alphabetic";
    const text = `${short(value)} ${panel.unit}`, plain = pen.font;
    pen.font = plain.replace("12px", "600 12px");
    const room = box.right - box.left - pen.measureText(text).width - 8;
    pen.textAlign = "right";
    pen.fillStyle = colour;
    pen.fillText(text, box.right, box.top - 9);
    pen.font = plain;
    pen.textAlign = "left";
    pen.fillStyle = paint("ink");
    pen.fillText(panel.name, box.left, box.top - 9, Math.max(room, 1));
  }

  footer(pen, box, across, low, high, byStep) {
    const run = Math.max(niceStep(high - low, 5), byStep ? 1 : 0);
    pen.fillStyle = paint("soft");
    pen.textBaseline = "top";
    pen.textAlign = "center";
    for (let value = Math.ceil(low / run) * run; value <= high * (1 + 1e-12); value += run) {
      const label = tickLabel(value, run), end = box.right + MARGIN - pen.measureText(label).width / 2;
      pen.fillText(label, Math.min(across(value), end), box.bottom + 6);
    }
    pen.textAlign = "right";
    pen.fillText(byStep ? "collisions shown" : "time (s)", box.right, box.bottom + 21);
  }
}
