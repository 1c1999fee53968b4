// What the arena and the charts share: colours, texts of numbers, and a sharp canvas.

// A colour of page.css; it follows the dark mode of the browser.
const paint = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`);
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

// A number with this many decimals, or a small one that needs more than nine as a power.
const decimal = (value, decimals) => (decimals > 9 ? short(value, 8) : value.toFixed(Math.max(decimals, 0)));

// Even steps of 1, 2 or 5 times a power of ten: at most this many up to a value.
function niceStep(range, most) {
  const rough = range / most, power = 10 ** Math.floor(Math.log10(rough));
  return power * [1, 2, 5, 10].find((factor) => factor * power >= rough * 0.999999);
}

const magnitude = (value) => Math.floor(Math.log10(Math.abs(value)) + 1e-9);

// The label of a value on an axis with this step: neighbours differ.
function tickLabel(value, step) {
  if (value !== 0 && (Math.abs(value) >= 1e5 || step < 1e-4)) {
    return short(value, Math.max(1, 1 + magnitude(value) - magnitude(step)));
  }
  return value.toFixed(value === 0 ? 0 : Math.max(0, -magnitude(step))).replace("-", "−");
}

// A canvas of a size in units of the page, as sharp as the screen.
function sized(canvas, width, height) {
  const ratio = window.devicePixelRatio || 1;
  if (canvas.width !== Math.round(width * ratio)) canvas.width = Math.round(width * ratio);
  if (canvas.height !== Math.round(height * ratio)) canvas.height = Math.round(height * ratio);
  const pen = canvas.getContext("2d");
  pen.setTransform(ratio, 0, 0, ratio, 0, 0);
  pen.clearRect(0, 0, width, height);
  return pen;
}

// An element's canvas, cleared, with its width and height.
function sharp(canvas) {
  const width = canvas.clientWidth, height = canvas.clientHeight;
  return [sized(canvas, width, height), width, height];
}
