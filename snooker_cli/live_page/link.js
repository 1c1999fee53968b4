// A link to a scene: what the page's address has after #. It names the scene, and the keys of its config
// that differ, such as scene=crowded&balls.packing=0.5&seed=3, with the names that `-o` of the program has.
"use strict";

const INNER = /^(collapse\.tc|wall_(speed|temperature)\.(left|right|bottom|top))$/; // their mapping may be missing
const OPTIONAL = /^(container\.mass|(wall_)?cor_speed|wall_(cor|speed|temperature))$/;

const hasKeys = (value) => value !== null && typeof value === "object";

// [path, value] of each key of a config that differs from another; a control removes no key of a mapping.
function differences(value, other, path = "") {
  if (value === other) return [];
  if (!hasKeys(value)) return [[path, value]];
  const inner = (key) => (Array.isArray(value) ? `${path}[${key}]` : path ? `${path}.${key}` : key);
  return Object.keys(value).flatMap((key) => differences(value[key], other?.[key], inner(key)));
}

// What an address has after # for a config of a scene; view: "beginner", "full", or null for the page's own.
function linkOf(scene, config, view) {
  const changes = differences(config, scene.config).map(([path, value]) => [path, String(value).replace("e+", "e")]);
  const all = [["scene", scene.name], ...changes, ...(view ? [["view", view]] : [])];
  return all.map(([key, value]) => `${key}=${value}`).join("&");
}

// The scene, config and view of a link; of one with a mistake the scene as it is, and a sentence.
// limits: of numbers by their key: the least, the largest, and whether they are whole
function readLink(text, scenes, limits) {
  const link = { scene: scenes[0], view: null, mistake: "" };
  try {
    const parts = decodeURIComponent(text).split("&").filter(Boolean).map((part) => part.split(/=(.*)/s));
    const { scene: name = scenes[0].name, view = "", ...changes } = Object.fromEntries(parts);
    const scene = scenes.find((one) => one.name === name);
    if (!scene) throw new SceneError(phrase`this page has no scene ${name}; choose one above`);
    link.scene = scene;
    if (!/^(beginner|full)?$/.test(view)) throw new SceneError(phrase`view=${view} needs beginner or full`);
    link.view = view || null;
    const config = JSON.parse(JSON.stringify(scene.config));
    for (const [path, value = ""] of Object.entries(changes)) setKey(config, path, value, limits);
    if (!agrees(config)) throw new SceneError(phrase`its keys of walls, container and collapse exclude each other; remove one`);
    return { ...link, config };
  } catch (error) {
    const isCut = error instanceof URIError;
    if (!isCut && !(error instanceof SceneError)) throw error;
    return { ...link, config: link.scene.config, mistake: isCut ? phrase`it is damaged; copy it again` : error.message };
  }
}

// Sets a key of a config to the value that a text has; collapse.tc replaces any other collapse. Throws SceneError.
function setKey(config, path, text, limits) {
  const names = path.match(/[^.[\]]+/g) ?? [], last = names.pop(), isInner = INNER.test(path);
  if (isInner && (last === "tc" || !hasKeys(config[names[0]]))) config[names[0]] = {};
  let part = config;
  for (const name of names) part = hasKeys(part) && Object.hasOwn(part, name) ? part[name] : null;
  const isThere = hasKeys(part) && (isInner || Object.hasOwn(part, last)) && names[0] !== "start";
  const isText = path === "collapse", isNumber = Object.hasOwn(limits, last);
  if (!isThere || !(isText || isNumber)) throw new SceneError(phrase`a link cannot change ${path} of this scene; remove it`);
  const [low, high, isWhole] = isNumber ? limits[last] : [], value = text ? Number(text) : NaN;
  if (text === "null" && OPTIONAL.test(path)) part[last] = null;
  else if (isText && text === "stop") part[last] = text;
  else if (value >= low && value <= high && (!isWhole || Number.isInteger(value))) part[last] = value;
  else {
    const number = isWhole ? phrase`a whole number from ${low} to ${high}` : phrase`a number from ${low} to ${high}`;
    const needed = isText ? phrase`stop, or collapse.tc=0.01` : number;
    throw new SceneError(phrase`${path}=${text} needs ${needed}`);
  }
}

// Whether the keys that a link can change fit each other, see `_faults` of config/models.py.
function agrees(config) {
  const { container, collapse, wall_speed: speed, wall_temperature: temperature, wall_cor_speed: corSpeed } = config;
  const given = [speed, temperature].filter((value) => value !== null);
  const sides = sidesOf(config), isFixed = container.mass === null, slides = collapse === "slide";
  const hasAt = (side) => (value) => (hasKeys(value) ? value[side] ?? null : value) !== null;
  return (isFixed || isCircle(config))
    && (!given.length || (isFixed && hasWalls(container) && !slides))
    && given.filter(hasKeys).every((value) => Object.keys(value).every((side) => sides.includes(side)))
    && (given.length < 2 || !(sides.length ? sides : ["left"]).some((side) => given.every(hasAt(side))))
    && (rebounds(config) || (config.wall_cor ?? corSpeed) === null)
    && (speed === null || corSpeed === null)
    && (!slides || (isFixed && corSpeed === null));
}
