// What the controls of all pages share: elements, sentences, keys, full screen, the legend.

const CROSSING = 6; // s of playing in which a ball crosses the container at speed 1
const LONGEST_FRAME = 0.1; // s that a frame continues by at most
const COMPARED = 1; // s of playing that are compared with what was asked for
const IN_TIME = 0.9; // of it, from which on the gas is as fast as chosen
const LINK_AFTER = 400; // ms of rest until the address is a link to what is shown: browsers limit changes
const FORBIDDEN =
  phrase`This site does not allow WebAssembly, which computes the collisions: save the page, and open the file.`;

const find = (name) => document.getElementById(name);

// A new element with properties.
const element = (tag, properties = {}) => Object.assign(document.createElement(tag), properties);

// A sentence on the page, which a screen reader reads.
function say(text) {
  find("said").textContent = text;
}

// A sentence about what cannot be shown, or none.
function refuse(text) {
  find("refusal").hidden = !text;
  find("refusal").textContent = text;
}

function fullScreen() {
  const refused = () => say(phrase`The browser allows no full screen here.`);
  if (document.fullscreenElement) document.exitFullscreen();
  else document.documentElement.requestFullscreen().catch(refused);
}

// Chooses the next option of a menu of speeds, or the one before; real time is not in their order.
function faster(menu, by) {
  const last = [...menu.options].filter((option) => !option.dataset.aside).length - 1;
  const usual = [...menu.options].findIndex(({ value }) => value === "1");
  const place = menu.selectedIndex > last ? usual : menu.selectedIndex;
  menu.selectedIndex = Math.min(Math.max(place + by, 0), last);
  menu.onchange();
}

// Something that runs on the page: it asks for frames while it plays, and for one after each change.
// A page's own class has charts, draw(now), setPace, speed, and advance(seconds of the computer's clock), which returns
// how many of them it played.
class PlayerPage {
  constructor() {
    this.playing = false;
    this.waiting = false;
    this.relative = false; // colours by speed over the mean
    this.last = null; // ms, the frame before; null where it does not count
    this.wanted = this.done = 0; // s of playing since they were compared
    document.addEventListener("visibilitychange", () => { this.last = null; });
  }

  refresh() {
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame((now) => this.frame(now));
  }

  // The contacts of a gas that flash now: [x, y, radius of the ball, age from 0 to 1], … since: how long ago a contact
  // was, s of playing at speed 1.
  flashesOf(gas, since) {
    const aged = gas.contacts.map((contact) => [contact, since(contact) / this.speed / FLASH]);
    return aged.filter(([, age]) => age < 1).map(([{ x, y, radius }, age]) => [x, y, radius, Math.max(age, 0)]);
  }

  // One frame: continues by the time since the last one, draws, and asks for the next.
  frame(now) {
    this.waiting = false;
    if (this.playing) {
      if (this.last === null) this.wanted = this.done = 0;
      const passed = this.last === null ? 0 : (now - this.last) / 1000;
      this.last = now;
      this.wanted += passed;
      this.done += this.advance(Math.min(passed, LONGEST_FRAME));
    }
    this.showSlowness();
    this.draw(now);
    if (this.playing) this.refresh();
  }

  // Says whether the gas was slower than the chosen speed in the last second of playing.
  showSlowness() {
    if (this.playing && this.wanted < COMPARED) return;
    const isSlow = this.playing && this.done < IN_TIME * this.wanted, isReal = find("speed").value === "real";
    const text = isReal ? phrase`slower than real time` : phrase`slower than chosen`;
    find("slow").textContent = isSlow ? text : "";
    this.wanted = this.done = 0;
  }

  // What buttons, menus and keys of all pages do. keys: what more keys do; fields: a selector of
  // elements that have the keys for themselves.
  listenToAll(keys, fields) {
    find("play").onclick = () => this.play();
    find("colours").onchange = () => {
      this.relative = find("colours").value === "relative";
      this.refresh();
    };
    find("log").onchange = () => {
      this.charts.log = find("log").checked;
      this.refresh();
    };
    for (const button of document.getElementsByName("pace")) button.onchange = () => this.setPace(button.value);
    listenToKeys({
      " ": () => this.play(),
      ArrowUp: () => faster(find("speed"), 1),
      ArrowDown: () => faster(find("speed"), -1),
      e: () => document.querySelector("input[name=pace]:not(:checked)").click(),
      f: () => { if (document.fullscreenEnabled) fullScreen(); },
      ...keys,
    }, fields);
  }
}

// keys: what each key does; fields: a selector of elements that have the keys for themselves.
function listenToKeys(keys, fields) {
  const acts = (event) => !(event.ctrlKey || event.metaKey || event.altKey || event.target.closest?.(fields));
  document.addEventListener("keydown", (event) => {
    const act = keys[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!act || !acts(event)) return;
    event.preventDefault();
    act(event);
  });
  // What was clicked would keep the focus, and the keys.
  document.addEventListener("pointerup", () => setTimeout(() => {
    const { activeElement } = document;
    if (activeElement?.matches("button, :is([type=radio], [type=checkbox], [type=range])")) activeElement.blur();
  }));
  // Else it would press the button that was clicked last, too.
  document.addEventListener("keyup", (event) => { if (event.key === " " && acts(event)) event.preventDefault(); });
}

// Draws again when the screen changes: its size, dark mode, full screen.
function followScreen(redraw) {
  find("full").hidden = !document.fullscreenEnabled;
  find("full").onclick = fullScreen;
  document.addEventListener("fullscreenchange", () => {
    find("full").setAttribute("aria-pressed", String(document.fullscreenElement !== null));
  });
  window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);
  const resized = new ResizeObserver(redraw);
  for (const canvas of document.querySelectorAll("canvas")) resized.observe(canvas);
  // A menu that keeps the focus would keep the keys, too.
  for (const menu of document.querySelectorAll(".bar select, .options select")) {
    menu.addEventListener("change", () => menu.blur());
  }
}

// The colours of speeds in the legend.
function showLegend(colours) {
  find("ramp").style.background = `linear-gradient(to right, ${colours.join(",")})`;
}
