// The controls: what is shown, how fast it continues, and what keys, buttons and links do.
"use strict";

const content = JSON.parse(find("film").textContent);
const LONGEST = 60; // s that a film takes at speed 1 unless the page gives a length
const LINK_AFTER = 400; // ms of rest until the link is that of the moment: browsers limit changes

// One of the films side by side: its balls, its moment, its arena and the text below.
class Screen {
  constructor(film) {
    const figure = element("figure"), canvas = element("canvas");
    this.caption = element("figcaption");
    figure.append(canvas, this.caption);
    find("arenas").append(figure);
    canvas.setAttribute("role", "img");
    canvas.setAttribute("aria-label", `Balls in their container, coloured by speed, ${film.subtitle}`);
    this.film = film;
    this.motion = new Motion(film);
    this.reel = new Reel(this.motion);
    this.arena = new Arena(canvas, film, this.motion);
  }

  get count() {
    const count = (value) => value.toLocaleString("en"), { before } = this.film;
    return `collision ${count(before + this.reel.done)} of ${count(before + this.motion.time.length)}`;
  }

  // How far the container has moved, m.
  get moved() {
    const [x, y] = this.motion.place(this.motion.number, this.reel.time);
    return Math.hypot(x - this.film.container[0], y - this.film.container[1]);
  }
}

class Player extends Showing {
  constructor() {
    super();
    this.screens = content.films.map((film) => new Screen(film));
    this.reels = this.screens.map(({ reel }) => reel);
    this.several = this.screens.length > 1;
    this.charts = new Charts(find("charts"), this.screens.map(({ film, motion }) => new Course(film, motion)));
    this.pace = content.pace;
    this.speed = 1;
    const films = content.films, largest = (value) => Math.max(...films.map(value));
    this.start = films[0].start;
    this.end = largest(({ end }) => end);
    this.steps = Math.max(...this.reels.map(({ steps }) => steps));
    this.topSpeed = largest(({ topSpeed }) => topSpeed);
    // Film time and collisions in a second of showing.
    const span = this.end - this.start, { seconds } = content;
    this.rate = seconds
      ? { time: span / seconds, events: this.steps / seconds }
      : {
        time: Math.max(Math.max(...films[0].size) / this.topSpeed / CROSSING, span / LONGEST),
        events: Math.max(5, this.steps / LONGEST),
      };
  }

  // Films that ended earlier stay at their end, so that the others are ahead.
  get time() {
    return Math.max(...this.reels.map(({ time }) => time));
  }

  get step() {
    return Math.max(...this.reels.map(({ step }) => step));
  }

  get ended() {
    return this.pace === "time" ? this.time >= this.end : this.step >= this.steps;
  }

  play(wanted = !this.playing) {
    if (wanted && this.ended) this.goTo(0);
    this.playing = wanted;
    this.last = null;
    this.refresh();
  }

  advance(passed) {
    const seconds = passed * this.speed;
    if (this.pace === "time") this.goToTime(this.time + seconds * this.rate.time);
    else this.goToStep(this.step + seconds * this.rate.events);
    if (this.ended) this.playing = false;
  }

  goToTime(time) {
    for (const reel of this.reels) reel.goToTime(time);
    this.refresh();
  }

  goToStep(step) {
    for (const reel of this.reels) reel.goToStep(step);
    this.refresh();
  }

  // To just after another collision.
  stepBy(by) {
    this.playing = false;
    this.goToStep((by < 0 ? Math.ceil(this.step) : Math.floor(this.step)) + by);
  }

  goTo(place) {
    if (this.pace === "time") this.goToTime(this.start + place * (this.end - this.start));
    else this.goToStep(place * this.steps);
  }

  // The films continue in step: at one time, or after the same number of collisions.
  setPace(pace) {
    this.pace = pace;
    if (this.several) pace === "time" ? this.goToTime(this.time) : this.goToStep(this.step);
    this.nameSpeeds();
    this.refresh();
  }

  // The menu says what each speed is at this pace.
  nameSpeeds() {
    const menu = find("speed"), byStep = this.pace === "events";
    for (const option of menu.options) {
      option.dataset.name ??= option.textContent;
      if (option.value === "real") option.disabled = byStep;
      else {
        const rate = short(Number(option.value) * this.rate[this.pace], 2);
        const unit = byStep ? "collisions" : "s";
        option.textContent = `${option.dataset.name} (${rate} ${unit} per second)`;
      }
    }
    if (byStep && menu.value === "real") menu.value = "1";
    this.speed = menu.value === "real" ? 1 / this.rate.time : Number(menu.value);
  }

  // The contacts of a film that flash now: place, radius of the ball, and how far the flash is.
  flashes({ reel, motion }) {
    const flashes = [];
    for (let k = reel.done - 1; k >= Math.max(0, reel.done - MOST_FLASHES); k--) {
      const since = this.pace === "time"
        ? (reel.time - motion.time[k]) / this.rate.time
        : (reel.step - (k + 1)) / this.rate.events;
      const age = since / this.speed / FLASH;
      if (age >= 1) break;
      const [x, y] = motion.contacts.subarray(2 * k, 2 * k + 2);
      flashes.push([x, y, motion.radii[motion.i[k]], Math.max(age, 0)]);
    }
    return flashes;
  }

  // Shows the path of a ball, or none for "".
  tag(ball) {
    const number = Number(ball), whole = ball !== "" && Number.isInteger(number) && number >= 0;
    find("tagged").value = String(ball);
    for (const { arena, motion } of this.screens) arena.tag(whole && number < motion.number ? number : null);
    const shown = this.screens.some(({ arena }) => arena.tagged !== null);
    const most = Math.max(...this.screens.map(({ motion }) => motion.number)) - 1;
    if (shown) say(`The path of ball ${number} is shown.`);
    else say(ball === "" ? "No path is shown." : `There is no ball ${ball}: give a number from 0 to ${most}.`);
    this.refresh();
  }

  draw() {
    for (const screen of this.screens) {
      const { motion, reel, arena } = screen;
      motion.seek(reel.done);
      const fast = this.relative ? 2 * motion.meanSpeed() : this.topSpeed;
      arena.draw(reel.time, this.flashes(screen), fast);
      find("fast").textContent = this.relative && this.several
        ? "twice the mean speed and faster"
        : `${short(fast, 2)} m/s and faster`;
    }
    this.charts.draw(this.reels, this.pace);
    this.write();
  }

  // The texts, and what screen readers read.
  write() {
    const place = this.pace === "time" ? (this.time - this.start) / (this.end - this.start) : this.step / this.steps;
    find("scrub").value = String(place);
    find("scrub").style.setProperty("--done", `${100 * place}%`);
    const inTime = !this.several || this.pace === "time";
    find("now").textContent = inTime ? `t = ${timeText(this.time)} s` : `collision ${Math.floor(this.step)}`;
    find("count").textContent = this.several ? "" : this.screens[0].count;
    this.screens.forEach((screen, k) => {
      if (!this.several) return;
      const name = element("b", { textContent: screen.film.subtitle });
      name.style.color = `var(--${FILM_COLOURS[k]})`;
      const early = screen.reel.time >= screen.film.end && !this.ended;
      screen.arena.canvas.style.opacity = early ? 0.4 : 1;
      const now = `${early ? "ended at " : ""}t = ${timeText(screen.reel.time)} s, ${screen.count}`;
      screen.caption.replaceChildren(name, now);
    });
    find("scrub").setAttribute("aria-valuetext", find("now").textContent);
    find("play").setAttribute("aria-label", this.playing ? "Pause" : "Play");
    document.body.classList.toggle("playing", this.playing);
    find("ending").style.visibility = this.ended ? "visible" : "hidden";
    find("moved").textContent = this.screens.map(({ moved }) => `${short(moved, 2)} m`).join(", ");
    if (!this.playing) {
      find("charts").setAttribute("aria-label", this.charts.sentence(this.reels));
      clearTimeout(this.linking);
      this.linking = setTimeout(() => this.writeLink(), LINK_AFTER);
    }
  }

  // Goes to the time and the ball of a link such as #t=3&ball=5.
  readLink() {
    const given = new URLSearchParams(location.hash.slice(1)), time = Number(given.get("t") || NaN);
    if (given.has("ball")) this.tag(given.get("ball"));
    if (Number.isFinite(time)) {
      this.playing = false;
      this.goToTime(time);
    }
  }

  // Makes the page's address a link to this moment. A page in a frame of another has no address.
  writeLink() {
    if (this.playing || location.protocol === "about:") return;
    const link = new URLSearchParams();
    if (this.time > this.start) link.set("t", Number(this.time.toPrecision(12)));
    const tagged = this.screens.find(({ arena }) => arena.tagged !== null);
    if (tagged) link.set("ball", tagged.arena.tagged);
    const text = String(link) && `#${link}`;
    if (text !== location.hash) history.replaceState(null, "", text || location.pathname + location.search);
  }

  listen() {
    for (const { arena } of this.screens) {
      arena.canvas.onclick = (event) => {
        const ball = arena.ballAt(event.offsetX, event.offsetY);
        if (ball === null) {
          this.play();
          say(this.playing ? "The film plays." : `The film pauses at ${timeText(this.time)} s.`);
        } else this.tag(ball === arena.tagged ? "" : ball);
      };
    }
    find("tagged").max = Math.max(...this.screens.map(({ motion }) => motion.number)) - 1;
    find("tagged").oninput = (event) => this.tag(event.target.value);
    find("back").onclick = () => this.stepBy(-1);
    find("forth").onclick = () => this.stepBy(1);
    find("scrub").oninput = (event) => this.goTo(Number(event.target.value));
    find("speed").onchange = () => { this.nameSpeeds(); this.refresh(); };
    for (const button of document.getElementsByName("pace")) button.checked = button.value === this.pace;
    window.addEventListener("hashchange", () => this.readLink());
    followScreen(() => this.refresh());
    this.listenToAll({
      ArrowRight: ({ shiftKey }) => this.stepBy(shiftKey ? 10 : 1),
      ArrowLeft: ({ shiftKey }) => this.stepBy(shiftKey ? -10 : -1),
      Home: () => { this.playing = false; this.goTo(0); },
      End: () => { this.playing = false; this.goTo(1); },
    }, "select, #tagged");
  }
}

// A time to a ten-thousandth of the film, or as fine as it needs.
function timeText(time) {
  const digits = Math.max(0, 4 - Math.ceil(Math.log10(player.end - player.start)));
  return digits > 9 ? short(time, 6) : time.toFixed(digits);
}

const player = new Player();
const [first] = content.films, endings = content.films.filter(({ ending }) => ending);
find("title").textContent = first.title;
find("subtitle").textContent = player.several ? "" : first.subtitle;
find("ending").textContent =
  endings.map(({ subtitle, ending }) => (player.several ? `${subtitle}: ${ending}` : ending)).join(" ");
find("ending").hidden = !endings.length;
showLegend(first.colours);
find("container").hidden = !content.films.some(({ free }) => free);
document.querySelector("main").classList.toggle("several", player.several);
player.listen();
player.setPace(content.pace);
player.readLink();
