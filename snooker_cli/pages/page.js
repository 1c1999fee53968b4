// What the controls of all pages share: elements, sentences, keys, full screen, the legend.
"use strict";

const find = (name) => document.getElementById(name);

// A sentence on the page, which a screen reader reads.
function say(text) {
  find("said").textContent = text;
}

function fullScreen() {
  const refused = () => say("The browser allows no full screen here.");
  if (document.fullscreenElement) document.exitFullscreen();
  else document.documentElement.requestFullscreen().catch(refused);
}

// Chooses the next option of a menu of speeds, or the one before; real time is not in their order.
function faster(menu, by) {
  const last = [...menu.options].filter((option) => !option.dataset.aside).length - 1;
  menu.selectedIndex = Math.min(Math.max(menu.selectedIndex + by, 0), last);
  menu.onchange();
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

// The colours of speeds and contacts in the legend.
function showLegend(colours) {
  find("ring").style.borderColor = GREEN;
  find("ramp").style.background = `linear-gradient(to right, ${colours.join(",")})`;
}
