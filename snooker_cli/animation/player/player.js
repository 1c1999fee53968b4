// The controls: what is shown, how fast it goes on, and what keys and buttons do.
"use strict";

const film = JSON.parse(document.getElementById("film").textContent);
const find = (name) => document.getElementById(name);
const LONGEST = 60; // s that a film takes at speed 1 unless it was asked to
const CROSSING = 6; // s in which a ball crosses the container then

class Player {
  constructor() {
    this.motion = new Motion(film);
    this.reel = new Reel(this.motion);
    this.arena = new Arena(find("arena"), film, this.motion);
    this.charts = new Charts(find("charts"), film, this.motion);
    this.pace = film.pace;
    this.playing = false;
    this.waiting = false;
    this.speed = 1;
    this.magnify = 1;
    this.relative = false;
    // Film time and collisions in a second of showing.
    const span = film.end - film.start, steps = this.reel.steps;
    this.rate = film.seconds
      ? { time: span / film.seconds, events: steps / film.seconds }
      : {
        time: Math.max(Math.max(...film.size) / film.topSpeed / CROSSING, span / LONGEST),
        events: Math.max(5, steps / LONGEST),
      };
  }

  get ended() {
    return this.pace === "time" ? this.reel.time >= film.end : this.reel.step >= this.reel.steps;
  }

  play(wanted = !this.playing) {
    if (wanted && this.ended) this.reel.goToStep(0);
    this.playing = wanted;
    this.last = null;
    this.refresh();
  }

  // One frame: goes on by the time since the last, draws, and asks for the next.
  frame(now) {
    this.waiting = false;
    if (this.playing) {
      const passed = this.last === null ? 0 : Math.min((now - this.last) / 1000, 0.1);
      this.last = now;
      this.advance(passed * this.speed);
      if (this.ended) this.playing = false;
    }
    this.draw();
    if (this.playing) this.refresh();
  }

  advance(seconds) {
    if (this.pace === "time") this.reel.goToTime(this.reel.time + seconds * this.rate.time);
    else this.reel.goToStep(this.reel.step + seconds * this.rate.events);
  }

  // To just after another collision.
  step(by) {
    this.playing = false;
    const whole = by < 0 ? Math.ceil(this.reel.step) : Math.floor(this.reel.step);
    this.reel.goToStep(whole + by);
    this.refresh();
  }

  goTo(place) {
    if (this.pace === "time") this.reel.goToTime(film.start + place * (film.end - film.start));
    else this.reel.goToStep(place * this.reel.steps);
    this.refresh();
  }

  // The collisions that flash now, and how far each flash is.
  flashes() {
    const found = [], reel = this.reel;
    for (let k = reel.done - 1; k >= Math.max(0, reel.done - MOST_FLASHES); k--) {
      const since = this.pace === "time"
        ? (reel.time - this.motion.time[k]) / this.rate.time
        : (reel.step - (k + 1)) / this.rate.events;
      const age = since / this.speed / FLASH;
      if (age >= 1) break;
      found.push([k, Math.max(age, 0)]);
    }
    return found;
  }

  // Shows the path of a ball, or none for "".
  tag(ball) {
    const number = Number(ball), known = Number.isInteger(number) && number >= 0 && number < this.motion.number;
    find("tagged").value = String(ball);
    this.arena.tag(ball !== "" && known ? number : null);
    this.refresh();
  }

  refresh() {
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame((now) => this.frame(now));
  }

  draw() {
    const reel = this.reel, span = film.end - film.start;
    this.motion.seek(reel.done);
    const fast = this.relative ? 2 * this.motion.meanSpeed() : film.topSpeed;
    this.arena.draw(reel, this.flashes(), this.magnify, fast);
    find("fast").textContent = `${short(fast, 2)} m/s and faster`;
    this.charts.draw(reel, this.pace);
    const place = this.pace === "time" ? (reel.time - film.start) / span : reel.step / this.reel.steps;
    find("scrub").value = String(place);
    find("scrub").style.setProperty("--done", `${100 * place}%`);
    const count = (value) => value.toLocaleString("en");
    find("now").textContent = `t = ${timeText(reel.time)} s`;
    find("count").textContent =
      `collision ${count(film.before + reel.done)} of ${count(film.before + this.motion.time.length)}`;
    find("scrub").setAttribute("aria-valuetext", find("now").textContent);
    find("play").setAttribute("aria-label", this.playing ? "Pause" : "Play");
    document.body.classList.toggle("playing", this.playing);
    find("ending").style.visibility = this.ended ? "visible" : "hidden";
    if (film.free) {
      const [x, y] = this.motion.place(this.motion.number, reel.time);
      const moved = Math.hypot(x - film.container[0], y - film.container[1]);
      find("moved").textContent = `${short(moved, 2)} m`;
    }
  }

  listen() {
    find("play").onclick = () => this.play();
    find("arena").onclick = (event) => {
      const ball = this.arena.ballAt(event.offsetX, event.offsetY);
      if (ball === null) this.play();
      else this.tag(ball === this.arena.tagged ? "" : ball);
    };
    find("tagged").max = this.motion.number - 1;
    find("tagged").oninput = (event) => this.tag(event.target.value);
    find("back").onclick = () => this.step(-1);
    find("forth").onclick = () => this.step(1);
    find("scrub").oninput = (event) => this.goTo(Number(event.target.value));
    find("speed").onchange = (event) => { this.speed = Number(event.target.value); this.refresh(); };
    find("magnify").onchange = (event) => { this.magnify = Number(event.target.value); this.refresh(); };
    find("colours").onchange = (event) => {
      this.relative = event.target.value === "relative";
      this.refresh();
    };
    for (const button of document.getElementsByName("pace")) {
      button.checked = button.value === this.pace;
      button.onchange = () => { this.pace = button.value; this.refresh(); };
    }
    // A menu that keeps the focus would keep the keys, too.
    for (const menu of document.querySelectorAll("select"))
      menu.addEventListener("change", () => menu.blur());
    document.addEventListener("keydown", (event) => this.key(event));
    // Else it would press the button that was clicked last, too.
    document.addEventListener("keyup", (event) => { if (event.key === " ") event.preventDefault(); });
    const dark = window.matchMedia("(prefers-color-scheme: dark)");
    dark.addEventListener("change", () => this.refresh());
    const resized = new ResizeObserver(() => this.refresh());
    for (const name of ["arena", "charts"]) resized.observe(find(name));
  }

  key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey || event.target.closest?.("select, #tagged")) return;
    const faster = (by) => {
      const menu = find("speed"), next = menu.selectedIndex + by;
      menu.selectedIndex = Math.min(Math.max(next, 0), menu.options.length - 1);
      menu.onchange({ target: menu });
    };
    const keys = {
      " ": () => this.play(),
      ArrowRight: () => this.step(event.shiftKey ? 10 : 1),
      ArrowLeft: () => this.step(event.shiftKey ? -10 : -1),
      Home: () => { this.playing = false; this.goTo(0); },
      End: () => { this.playing = false; this.goTo(1); },
      ArrowUp: () => faster(1),
      ArrowDown: () => faster(-1),
      e: () => document.querySelector("input[name=pace]:not(:checked)").click(),
    };
    const named = keys[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!named) return;
    event.preventDefault();
    named();
  }
}

// A time to a ten-thousandth of the film, or as fine as it needs.
function timeText(time) {
  const digits = Math.max(0, 4 - Math.ceil(Math.log10(film.end - film.start)));
  return digits > 9 ? short(time, 6) : time.toFixed(digits);
}

find("title").textContent = film.title;
find("subtitle").textContent = film.subtitle;
find("ending").textContent = film.ending;
find("ending").hidden = !film.ending;
find("ring").style.borderColor = GREEN;
find("ramp").style.background = `linear-gradient(to right, ${film.colours.join(",")})`;
find("container").hidden = !film.free;
for (const factor of film.magnifications) {
  find("magnify").add(new Option(`× ${factor.toLocaleString("en")}`, String(factor)));
}
const player = new Player();
player.listen();
player.refresh();
