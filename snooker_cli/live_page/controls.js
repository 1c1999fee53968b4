// The sliders of the scene: what each reads and changes in a config, and where it fits.

const wallIs = (type) => (config) => hasWalls(config.container) && wallType(config) === type;
const isCircle = ({ container }) => (container.shape ?? "circle") === "circle";

// How a key of a config, or of its balls, is read and written.
const keyOf = (part) => (key) => ({
  read: (config) => part(config)[key],
  write: (config, value) => { part(config)[key] = value; },
});
const ofConfig = keyOf((config) => config);

// The sides of a container that can differ.
const sidesOf = ({ container: { shape } }) => SHAPES[shape ?? "circle"]?.sides ?? [];
const isBySide = (value) => value !== null && typeof value === "object";

// "passive", "driven", "warm", or "sides" for walls that differ.
function wallType({ wall_speed: speed, wall_temperature: temperature }) {
  if (isBySide(speed) || isBySide(temperature)) return "sides";
  if (temperature !== null) return "warm";
  return speed ? "driven" : "passive";
}

// Whether balls rebound from a wall with a CoR; from one with a temperature they do not.
function rebounds(config) {
  const temperature = config.wall_temperature;
  if (!isBySide(temperature)) return temperature === null;
  return sidesOf(config).some((side) => (temperature[side] ?? null) === null);
}

// The groups of balls that share a radius and a speed: those on rings, or species.
const speciesOf = ({ balls }) => [balls].flat().filter((group) => "rings" in group || "count" in group);

// The ball with a mass of its own: the last one of a list, or the first before a gas.
function singleBall({ balls }) {
  if (Array.isArray(balls)) return "position" in balls[0] ? balls[0] : null;
  return balls.list?.length > 1 ? balls.list[balls.list.length - 1] : null;
}

// The controls of a config, in the order of the page.
function controlsOf(config) {
  const species = speciesOf(config).flatMap((_, k, all) => ofSpecies(k, all.length));
  const sides = sidesOf(config).flatMap((side) => WALLS.map(({ key, ...wall }) => ({
    ...wall, id: `${wall.id}-${side}`, label: `${SIDE_NAMES[side]} ${wall.label}`,
    fits: (now) => isBySide(now[key]) && Boolean(now[key][side]),
    ...keyOf((now) => now[key])(side),
  })));
  return [...CORS, ...SURFACES, ...species, ...CONTROLS, ...sides].filter(({ fits }) => fits(config));
}

// The controls of one of several species.
function ofSpecies(k, several) {
  const it = keyOf((config) => speciesOf(config)[k]), hasKey = (key) => (config) => key in speciesOf(config)[k];
  const which = several > 1 ? { id: `-${k + 1}`, label: `, ${phrase`species ${k + 1}`}` } : { id: "", label: "" };
  const controls = [
    { id: "rings", label: phrase`rings`, low: 0, high: 7, step: 1,
      help: phrase`Rings around the central ball: n rings have 1 + 3n(n + 1) balls.` },
    { id: "count", label: phrase`balls`, low: 1, high: MOST_BALLS, step: 1, help: phrase`Number of balls.` },
    { id: "radius", label: phrase`radius`, unit: "m", low: 0.001, high: 3, log: true,
      help: phrase`Radius of every ball.` },
    { id: "mass", label: phrase`mass`, unit: "kg", low: 0.01, high: 1e4, log: true, help: phrase`Mass of every ball.`,
      fits: (config) => speciesOf(config).length > 1 },
    { id: "speed", label: phrase`speed at the start`, unit: "m/s", low: 0.1, high: 100, log: true,
      help: phrase`Speed of the balls at the start; with Maxwell’s distribution the root mean square.` },
  ];
  return controls.map(({ id, label, ...control }) => ({
    fits: hasKey(id), ...control, id: id + which.id, label: label + which.label, ...it(id),
  }));
}

// What a wall can give to balls, all round or at one side.
const WALLS = [
  { key: "wall_speed", type: "driven", id: "wall-speed", label: phrase`wall speed`, unit: "m/s", low: 0.01, high: 100,
    log: true, live: true, help: phrase`Speed at which the wall moves inwards when it is hit.` },
  { key: "wall_temperature", type: "warm", id: "wall-temperature", label: phrase`wall temperature`, unit: "J", low: 0.1,
    high: 1000, log: true, live: true,
    help: phrase`Temperature of the wall, J: twice as high a temperature gives balls twice the energy.` },
];

const OF_WALL = ["wall_cor", "wall_tangential_cor", "wall_friction"];
const hasRoughWall = (config) => hasWalls(config.container) && rebounds(config) && config.collapse !== "slide";

// A control has a label, a unit, a sentence, `low` and `high`, `step` or `log`, `live` if it changes
// a gas that runs. `read` and `write` know the config, `fits` says whether a config has it.
const CORS = [
  { id: "cor", label: phrase`CoR of balls`, low: 0, high: 1, step: 0.01, live: true,
    help: phrase`Coefficient of restitution between balls: 1 keeps all energy, 0 has no rebound.`,
    fits: () => true, read: (config) => config.cor,
    write: (config, value, own) => { // the wall keeps its own
      const wallCor = config.wall_cor ?? config.cor;
      config.cor = value;
      if (hasWalls(config.container) && rebounds(config)) setWallCor(config, wallCor, own);
    } },
  { id: "wall-cor", label: phrase`CoR of the wall`, low: 0, high: 1, step: 0.01, live: true,
    help: phrase`Coefficient of restitution at the wall.`,
    fits: (config) => hasWalls(config.container) && rebounds(config), read: (config) => config.wall_cor ?? config.cor,
    write: setWallCor },
];

// Of rough balls. Some have an end for no value: a friction without a limit, or a wall that is as balls are.
const SURFACES = [
  ["tangential_cor", -1, "",
    phrase`Tangential restitution of balls: at −1 they are smooth, at 0 they roll off each other, at 1 the slip turns round.`],
  ["friction", 0, phrase`unlimited`,
    phrase`The impulse along the surface of a ball is at most this much of that across; at the right end it has no limit.`],
  ["wall_tangential_cor", -1, phrase`same`, phrase`The same at the wall; at the right end it is that of balls.`],
  ["wall_friction", 0, phrase`same`, phrase`The same at the wall; at the right end it is that of balls.`],
].map(([key, low, none, help]) => ({
  id: key.replaceAll("_", "-"), label: SURFACE_NAMES[key], low, high: 1, step: 0.01, live: true, none, help,
  fits: (config) => isRough(config) && (!OF_WALL.includes(key) || hasRoughWall(config)),
  ...ofConfig(key), read: (config) => config[key] ?? (none ? null : low),
}));

const CONTROLS = [
  { id: "packing", label: phrase`packing`, low: 0.01, high: 0.75, step: 0.01,
    help: phrase`Area of the balls over the area of the container.`,
    fits: ({ balls, container }) => "packing" in balls || "packing" in container,
    read: ({ balls, container }) => balls.packing ?? container.packing,
    write: ({ balls, container }, value) => { ("packing" in balls ? balls : container).packing = value; } },
  { id: "mass", label: phrase`mass of the single ball`, unit: "kg", low: 1, high: 1e6, log: true,
    help: phrase`Mass of the ball that is given by itself.`,
    fits: (config) => singleBall(config) !== null, read: (config) => singleBall(config).mass,
    write: (config, value) => { singleBall(config).mass = value; } },
  ...[
    ["radius", phrase`container’s radius`, phrase`Inner radius of the container.`],
    ["width", phrase`container’s width`, phrase`Inner width of the container.`],
  ].map(([key, label, help]) => ({
    id: `container-${key}`, label, unit: "m", low: 1, high: 100, log: true,
    help, fits: ({ container }) => key in container,
    ...keyOf(({ container }) => container)(key),
  })),
  { id: "container-mass", label: phrase`container’s mass`, unit: "kg", low: 1, high: 1e8, log: true, none: phrase`fixed`,
    help: phrase`Mass of a container that moves; at the right end it is fixed.`,
    fits: (config) => isCircle(config) && wallType(config) === "passive" && config.collapse !== "slide",
    read: ({ container }) => container.mass, write: ({ container }, value) => { container.mass = value; } },
  { id: "wall", label: phrase`wall`, live: true,
    choices: (config) => ({
      passive: phrase`passive`, driven: phrase`driven`, warm: phrase`with a temperature`,
      ...(sidesOf(config).length ? { sides: phrase`sides that differ` } : {}),
    }),
    help: phrase`A driven wall moves inwards when it is hit. Balls leave a wall with a temperature at random. Both fix the container.`,
    fits: ({ container }) => hasWalls(container), read: wallType, write: setWall },
  ...WALLS.map(({ key, type, ...wall }) => ({ ...wall, fits: wallIs(type), ...ofConfig(key) })),
];

const SEED = { id: "seed", low: 0, high: Number.MAX_SAFE_INTEGER, step: 1, ...ofConfig("seed") };

// A link has what controls read, so this decides the config: no matter how it was reached. A CoR of the wall that is
// that of balls is left out, unless the scene's own config has it.
function setWallCor(config, value, own) {
  config.wall_cor = value === config.cor && value !== own.wall_cor ? null : value;
}

// Another type of wall: as in the scene's own config if it has this type, else with values that suit the
// gas. Sides that differ begin with a hot one on the left and a cold one on the right. The container is then fixed.
function setWall(config, type, own) {
  const isOwn = type === wallType(own), kept = OF_WALL.map((key) => [key, (rebounds(config) ? config : own)[key]]);
  const { speed, mass = 1 } = speciesOf(config)[0] ?? {}, usual = speed || 10, energy = (mass * usual * usual) / 2;
  const temperatures = { warm: energy, sides: { left: 2 * energy, right: energy / 2 } };
  const made = { wall_speed: type === "driven" ? usual / 10 : null, wall_temperature: temperatures[type] ?? null };
  const { wall_speed, wall_temperature, wall_cor_speed = null } = isOwn ? own : made;
  Object.assign(config, { wall_speed, wall_temperature, wall_cor_speed });
  for (const [key, value] of kept) config[key] = rebounds(config) ? value : null;
  if (type !== "passive") config.container.mass = null;
  if (own.collapse === "slide" && !config.collapse.tc) config.collapse = type === "passive" ? "slide" : "stop";
}

// The name of a control, which those of several species or walls share; see CONTROLS of page.py.
const nameOf = (id) => id.replace(/-(\d+|left|right|bottom|top)$/, "");

// Draws the controls that fit a config, and reports what a user changes.
class Controls {
  // chosen: names of the controls to show, or null for all; change: a function of a control and its new value
  constructor(home, chosen, change) {
    this.home = home;
    this.chosen = chosen;
    this.change = change;
  }

  show(config) {
    const isChosen = ({ id }) => !this.chosen || this.chosen.includes(nameOf(id));
    const fitting = controlsOf(config).filter(isChosen).map((control) => ({ ...control, choices: control.choices?.(config) }));
    const names = JSON.stringify(fitting.map(({ id, label, choices }) => [id, label, choices]));
    if (names !== this.names) {
      this.home.replaceChildren(...fitting.map((control) => this.made(control)));
      this.names = names;
    }
    for (const control of fitting) this.set(control, control.read(config));
  }

  made(control) {
    const { label, unit, help, choices, none } = control, id = `set-${control.id}`;
    const sentence = control.live ? help : phrase`${help} A change restarts the gas.`;
    const row = element("div", { className: "control", title: sentence });
    const name = element("label", { textContent: label, htmlFor: id });
    const described = element("span", { id: `${id}-help`, className: "help", textContent: sentence });
    if (choices) {
      const menu = element("select", { id, onchange: () => this.change(control, menu.value) });
      for (const [value, text] of Object.entries(choices)) menu.append(new Option(text, value));
      menu.setAttribute("aria-describedby", described.id);
      row.append(name, menu, described);
      return row;
    }
    const slider = element("input", { type: "range", min: 0, max: 1, step: "any" });
    slider.setAttribute("aria-label", label);
    slider.onpointerdown = () => { slider.held = slider.shown; };
    slider.onpointercancel = () => this.change(control, slider.held); // the finger scrolls
    slider.onchange = () => { slider.value = slider.dataset.value; };
    slider.oninput = () => this.change(control, valueOnSlider(control, Number(slider.value)));
    const number = element("input", { id, type: "number", min: control.log ? 0 : control.low, step: control.step ?? "any" });
    number.placeholder = none ?? "";
    if (control.step) number.max = control.high;
    number.onchange = () => {
      const value = typedValue(control, number.value);
      if (!Number.isNaN(value)) this.change(control, value);
      else if (number.value !== "") say(phrase`Give ${rangeOf(control)} for “${label}”.`);
      number.value = number.dataset.value; // also where the change was refused, or the field is empty
    };
    number.setAttribute("aria-describedby", described.id);
    row.append(name, slider, number, element("span", { className: "unit", textContent: unit ?? "" }), described);
    return row;
  }

  set(control, value) {
    const field = find(`set-${control.id}`);
    if (control.choices) {
      field.value = value;
      return;
    }
    const part = value === null ? 1 : placeOnSlider(control, value), slider = field.previousSibling;
    slider.shown = value;
    const text = value === null ? control.none : `${brief(value)} ${control.unit ?? ""}`;
    slider.setAttribute("aria-valuetext", text.trim());
    if (control.log && value !== null) field.step = 10 ** (Math.floor(Math.log10(value)) - 1); // of its second digit
    slider.dataset.value = part;
    if (document.activeElement !== slider || part < 0 || part > 1) slider.value = part;
    slider.style.setProperty("--done", `${100 * Math.min(Math.max(part, 0), 1)}%`);
    field.dataset.value = value === null ? "" : brief(value);
    if (document.activeElement !== field) field.value = field.dataset.value;
  }
}

// A number for a field: large ones as 1e7.
function brief(value) {
  const text = String(Number(value.toPrecision(6)));
  return Math.abs(value) < 1e6 ? text : Number(text).toExponential().replace("+", "");
}

// The numbers that a field takes: of a logarithmic slider any amount.
const limitsOf = ({ low, high, step }) => (step ? [low, high] : [LEAST_AMOUNT, MOST_AMOUNT]);

// What a field takes, in words.
function rangeOf(control) {
  const [low, high] = limitsOf(control);
  return control.step === 1 ? phrase`a whole number from ${low} to ${high}` : phrase`a number from ${low} to ${high}`;
}

// The value that a text gives a control: with steps the nearest within its limits; NaN if the text is refused.
function typedValue(control, text) {
  const { none, step } = control, [low, high] = limitsOf(control), typed = Number(text);
  if (text === "" || text === none) return none ? null : NaN;
  if (!step) return typed >= low && typed <= high ? typed : NaN;
  const value = Math.min(Math.max(typed, low), high);
  return step === 1 ? Math.round(value) : value;
}

function valueOnSlider({ low, high, step, log, none }, part) {
  if (none && part === 1) return null;
  if (log) return Number((low * (high / low) ** part).toPrecision(2));
  return Number((Math.round((low + part * (high - low)) / step) * step).toFixed(6));
}

// A sentence of a text without a capital and a stop.
const sentenceOf = (text) => `${text[0].toUpperCase()}${text.slice(1)}.`;

// Why a scene cannot exist, and which controls help. The radii of a scene with a packing follow from it.
function refusalOf({ message, helps }, config) {
  if (!helps.length) return sentenceOf(message);
  const all = controlsOf(config), isPacked = helps.includes("radius") && all.some(({ id }) => id === "packing");
  const labels = (ids) => {
    const found = all.filter(({ id }) => ids.includes(nameOf(id)));
    return [...new Set(found.map(({ label }) => phrase`“${label.split(",")[0]}”`))].join(` ${phrase`or`} `);
  };
  const lower = labels(isPacked ? ["packing"] : helps);
  const raise = helps.includes("container") && !isPacked && labels(["container-radius", "container-width"]);
  const ways = [lower && phrase`lower ${lower}`, raise && phrase`raise ${raise}`].filter(Boolean);
  return sentenceOf(`${message}: ${ways.join(`, ${phrase`or`} `) || phrase`choose another scene`}`);
}

const placeOnSlider = ({ low, high, log }, value) =>
  log ? Math.log(value / low) / Math.log(high / low) : (value - low) / (high - low);
