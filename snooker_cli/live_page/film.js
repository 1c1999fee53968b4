// A film: repeats that the page simulates again from their stored starts, beside each other and in step.
// It goes to any moment, and checks that the collisions are those that are stored.

const content = JSON.parse(find("data").textContent);
const LONGEST = 60; // s that a film takes at speed 1 unless the page gives a length
const SLICE = 50; // ms of simulation until the page can draw

// A place in a film. At an even pace it is known by its time; one collision after the other by its
// step: k is just after collision k, and between two the balls move as usual.
class Playhead {
  // times: of the collisions, s
  constructor({ start, end }, times) {
    this.times = times;
    this.knots = [start, ...times];
    if (end > this.knots[times.length]) this.knots.push(end);
    this.start = start;
    this.end = end;
    this.steps = this.knots.length - 1;
    this.goToStep(0);
  }

  // How many collisions there have been at a time; one at that very time is among them.
  count(time) {
    let low = 0, high = this.times.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.times[middle] <= time) low = middle + 1;
      else high = middle;
    }
    return low;
  }

  goToTime(time) {
    this.time = Math.min(Math.max(time, this.start), this.end);
    this.done = this.count(this.time);
    const before = this.knots[this.done], after = this.knots[this.done + 1];
    this.step = this.done + (after > before ? (this.time - before) / (after - before) : 0);
  }

  goToStep(step) {
    this.step = Math.min(Math.max(step, 0), this.steps);
    const whole = Math.floor(this.step);
    this.done = Math.min(whole, this.times.length);
    const before = this.knots[whole], after = this.knots[Math.min(whole + 1, this.steps)];
    this.time = before + (this.step - whole) * (after - before);
  }
}

// One of the films side by side: its gas, its moment, its arena and the text below.
class Screen {
  constructor(film) {
    const figure = element("figure"), canvas = element("canvas");
    this.caption = element("figcaption");
    figure.append(canvas, this.caption);
    find("arenas").append(figure);
    canvas.setAttribute("role", "img");
    canvas.setAttribute("aria-label", `Balls in their container, coloured by speed, ${film.subtitle}`);
    this.film = film;
    this.gas = new Gas({ time: null }, null, storedScene(film.scene));
    const { extent, follow } = film, { colours } = content;
    this.arena = new Arena(canvas, this.gas, { ...viewOf(this.gas.scene.container), extent, follow, colours });
  }

  // Simulates the repeat up to the film, and then the film. report: called with the number of collisions.
  async simulate(report) {
    const { gas, film } = this;
    const upTo = async (collisions) => {
      while (gas.collisions < collisions && !gas.stop) {
        gas.advance(Infinity, collisions - gas.collisions, Date.now() + SLICE);
        report(gas.collisions);
        await new Promise((drawn) => setTimeout(drawn));
      }
    };
    await upTo(film.before);
    gas.times = [];
    gas.forgetMoments();
    gas.series.beginAnew();
    await upTo(film.collisions);
    this.isStored = gas.simulation.eventHash() === film.hash;
    this.playhead = new Playhead(film, gas.times);
    this.show();
  }

  // Lets the gas be at the moment of the playhead.
  show() {
    const { gas, film, playhead } = this;
    gas.goTo(film.before + playhead.done);
    gas.time = playhead.time;
    gas.followSlide();
  }

  get count() {
    const count = (value) => value.toLocaleString("en"), { before, collisions } = this.film;
    return `collision ${count(before + this.playhead.done)} of ${count(collisions)}`;
  }

  // How far the container has moved, m.
  get moved() {
    const { gas, film } = this, [x, y] = gas.place(gas.number, gas.time);
    return Math.hypot(x - film.scene.containerPosition[0], y - film.scene.containerPosition[1]);
  }
}

class FilmPage extends PlayerPage {
  constructor(screens) {
    super();
    this.screens = screens;
    this.playheads = screens.map(({ playhead }) => playhead);
    this.several = screens.length > 1;
    this.charts = new GasCharts(find("charts"));
    this.pace = content.pace;
    this.speed = 1;
    const films = content.films, largest = (value) => Math.max(...films.map(value));
    this.start = films[0].start;
    this.end = largest(({ end }) => end);
    this.steps = Math.max(...this.playheads.map(({ steps }) => steps));
    this.topSpeed = largest(({ topSpeed }) => topSpeed);
    this.charts.show(screens.map(({ gas }) => gas), this.end, this.start);
    // Film time and collisions in a second of playing.
    const span = this.end - this.start, { seconds } = content;
    this.rate = seconds
      ? { time: span / seconds, events: this.steps / seconds }
      : {
        time: Math.max(Math.max(...films[0].scene.container.size) / this.topSpeed / CROSSING, span / LONGEST),
        events: Math.max(5, this.steps / LONGEST),
      };
  }

  // Films that ended earlier stay at their end, so that the others are ahead.
  get time() {
    return Math.max(...this.playheads.map(({ time }) => time));
  }

  get step() {
    return Math.max(...this.playheads.map(({ step }) => step));
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
    return passed;
  }

  goToTime(time) {
    for (const playhead of this.playheads) playhead.goToTime(time);
    this.refresh();
  }

  goToStep(step) {
    for (const playhead of this.playheads) playhead.goToStep(step);
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

  flashes({ playhead, gas, film }) {
    const { rate } = this, byTime = this.pace === "time", since = ({ time, step }) =>
      (byTime ? (playhead.time - time) / rate.time : (playhead.step - (step - film.before)) / rate.events);
    return this.flashesOf(gas, since);
  }

  // Shows the path of a ball, or none for "".
  tag(ball) {
    const number = Number(ball), whole = ball !== "" && Number.isInteger(number) && number >= 0;
    find("tagged").value = String(ball);
    for (const screen of this.screens) {
      screen.show();
      screen.gas.tag(whole && number < screen.gas.number ? number : null);
    }
    const shown = this.screens.some(({ gas }) => gas.tagged !== null);
    const most = Math.max(...this.screens.map(({ gas }) => gas.number)) - 1;
    if (shown) say(`The path of ball ${number} is shown.`);
    else say(ball === "" ? "No path is shown." : `There is no ball ${ball}: give a number from 0 to ${most}.`);
    this.refresh();
  }

  draw(now) {
    for (const screen of this.screens) {
      const { gas, playhead, arena } = screen;
      screen.show();
      const fast = this.relative ? 2 * gas.meanSpeed() || 1 : this.topSpeed;
      arena.draw(playhead.time, this.flashes(screen), fast);
      find("fast").textContent = this.relative && this.several
        ? "twice the mean speed and faster"
        : `${short(fast, 2)} m/s and faster`;
    }
    if (!this.playing || !(now - this.fitAt < FIT_EVERY)) {
      this.charts.fit();
      this.fitAt = now;
    }
    this.charts.draw();
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
      name.style.color = `var(--${GAS_COLOURS[k]})`;
      const early = screen.playhead.time >= screen.film.end && !this.ended;
      screen.arena.canvas.style.opacity = early ? 0.4 : 1;
      const now = `${early ? "ended at " : ""}t = ${timeText(screen.playhead.time)} s, ${screen.count}`;
      screen.caption.replaceChildren(name, now);
    });
    find("scrub").setAttribute("aria-valuetext", find("now").textContent);
    find("play").setAttribute("aria-label", this.playing ? "Pause" : "Play");
    document.body.classList.toggle("playing", this.playing);
    find("ending").style.visibility = this.ended ? "visible" : "hidden";
    find("moved").textContent = this.screens.map(({ moved }) => `${short(moved, 2)} m`).join(", ");
    if (!this.playing) {
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
    const tagged = this.screens.find(({ gas }) => gas.tagged !== null);
    if (tagged) link.set("ball", tagged.gas.tagged);
    const text = String(link) && `#${link}`;
    if (text !== location.hash) history.replaceState(null, "", text || location.pathname + location.search);
  }

  listen() {
    for (const { arena, gas } of this.screens) {
      arena.canvas.onclick = (event) => {
        const ball = arena.ballAt(event.offsetX, event.offsetY);
        if (ball === null) {
          this.play();
          say(this.playing ? "The film plays." : `The film pauses at ${timeText(this.time)} s.`);
        } else this.tag(ball === gas.tagged ? "" : ball);
      };
    }
    find("tagged").max = Math.max(...this.screens.map(({ gas }) => gas.number)) - 1;
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

const timeText = (time) => decimal(time, Math.max(...content.films.map(({ decimals }) => decimals)));

let player = null;

async function start() {
  const { films } = content, [first] = films, several = films.length > 1, endings = films.filter(({ ending }) => ending);
  find("title").textContent = first.title;
  find("subtitle").textContent = several ? "" : first.subtitle;
  find("ending").textContent =
    endings.map(({ subtitle, ending }) => (several ? `${subtitle}: ${ending}` : ending)).join(" ");
  find("ending").hidden = !endings.length;
  showLegend(content.colours);
  find("container").hidden = !films.some(({ scene }) => scene.containerMass !== null);
  document.querySelector("main").classList.toggle("several", several);
  try {
    await compileModules(JSON.parse(find("modules").textContent));
  } catch {
    refuse(FORBIDDEN);
    return;
  }
  const hint = find("said").textContent, screens = films.map((film) => new Screen(film));
  for (const screen of screens) {
    const report = (count) => say(`Simulates collision ${count.toLocaleString("en")} of ${screen.film.collisions.toLocaleString("en")}.`);
    await screen.simulate(report);
  }
  say(hint);
  const others = screens.filter(({ isStored }) => !isStored).map(({ film }) => film.subtitle || film.title);
  if (others.length) {
    refuse(`These are not the stored collisions: another version of snooker recorded ${others.join(" and ")}. A GIF or MP4 shows those.`);
  }
  player = new FilmPage(screens);
  player.listen();
  player.setPace(content.pace);
  player.readLink();
}

const started = start();
