// A link to a scene: what the page's address has after #. It names the scene, and the controls that differ, such as
// scene=crowded&packing=0.6&seed=3, with the names that `snooker live --controls` has.

const copyOf = (config) => JSON.parse(JSON.stringify(config));
const linkedControls = (config) => [...controlsOf(config), SEED];

// The scene's config with controls set to texts, in the order of the page; left: texts of controls that it lacks.
// Each is looked up anew, because `wall` decides which others there are. Throws SceneError.
function followed({ config: own }, texts) {
  const config = copyOf(own), left = new Map(texts);
  for (;;) {
    const control = linkedControls(config).find(({ id }) => left.has(id));
    if (!control) return { config, left };
    control.write(config, linkedValue(control, left.get(control.id), config), copyOf(own));
    left.delete(control.id);
  }
}

// The value that a text of a link gives a control. Throws SceneError for one that the control's field refuses or changes.
function linkedValue(control, text = "", config) {
  const { id, none } = control, choices = control.choices?.(config);
  const value = choices ? text : typedValue(control, text);
  if (choices ? Object.hasOwn(choices, text) : value === null || value === Number(text)) return value;
  const needed = choices ? phrase`one of ${Object.keys(choices).join(", ")}` : rangeOf(control);
  throw new SceneError(none ? phrase`${id}=${text} needs ${needed}, or ${none}` : phrase`${id}=${text} needs ${needed}`);
}

// What an address has after # for a config of a scene; view: "beginner", "full", or null for the page's own.
function linkOf(scene, config, view) {
  const texts = new Map();
  for (const control of linkedControls(config)) {
    const value = control.read(config), { config: without } = followed(scene, texts);
    if (value !== control.read(without)) texts.set(control.id, String(value ?? control.none));
  }
  for (const name of followed(scene, texts).left.keys()) texts.delete(name); // which fit only what a button gave
  const parts = [["scene", scene.name], ...texts, ...(view ? [["view", view]] : [])];
  return parts.map((part) => part.join("=")).join("&");
}

// The scene, config and view of a link; of one with a mistake the scene as it is, and a sentence.
function readLink(text, scenes) {
  const parts = text.split("&").filter(Boolean).map((part) => part.split(/=(.*)/s));
  const { scene: name = scenes[0].name, view = "", ...texts } = Object.fromEntries(parts);
  const found = scenes.find((one) => one.name === name), scene = found ?? scenes[0];
  const link = { scene, config: scene.config, view: null, mistake: "" };
  try {
    if (!found) throw new SceneError(phrase`this page has no scene ${name}; choose one above`);
    if (!/^(beginner|full)?$/.test(view)) throw new SceneError(phrase`view=${view} needs beginner or full`);
    link.view = view || null;
    const { config, left } = followed(scene, Object.entries(texts)), [unknown] = left.keys();
    if (left.size) throw new SceneError(phrase`the scene has no control ${unknown} with the rest of this link; remove it`);
    return { ...link, config };
  } catch (error) {
    if (!(error instanceof SceneError)) throw error;
    return { ...link, mistake: error.message };
  }
}
