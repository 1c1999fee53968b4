// The page: what runs, how fast, and what buttons, sliders and keys do.

const content = JSON.parse(find("data").textContent);
for (const scene of content.scenes) {
  scene.config = { ...content.defaults, ...scene.config };
  const { balls } = scene.config;
  if (!balls.list) continue;
  const [keys, ...rows] = balls.list; // without what a ball does not give
  balls.list = rows.map((row) => Object.fromEntries(keys.map((key, k) => [key, row[k]]).filter(([, value]) => value !== null)));
}
const own = content.start && ownStart(content.start, content.scenes[0].config);
const BUDGET = 10; // ms of a frame in which the gas is simulated
const LONGEST = 200000; // collisions of a start that is measured: 20 MB
const CHARTS_EVERY = 50; // ms
const SPEEDS = { time: [0.125, 0.25, 0.5, 1, 2, 4, 8, 16, 64], events: [1, 5, 20, 100, 1000, 10000, 100000] };
const NORMAL = { time: 1, events: 5 };
const CONTINUATIONS = {
  on: phrase`Continue`, slide: phrase`Continue: the ball slides`, tc: phrase`Restart: contacts have a duration`,
};
const FAST = 1.8; // a speed over √(2T/m), at the edge of a bin
const FASTER = phrase`speeds above ${FAST} √(2T/m)`, EXPERT = [FASTER, phrase`momentum`, phrase`angular momentum`]; // numbers
const OPEN = phrase`open the page by itself`, COPY = phrase`use Copy, or open the page by itself`;
const NO_WORKER = phrase`This site forbids scripts in the background, which measure: save the page, and open the file.`;

function copy(text, done) {
  const copied = navigator.clipboard?.writeText(text) ?? Promise.reject();
  copied.then(() => say(done), () => say(phrase`The browser forbids this button to copy here: select the text, and copy it.`));
}

// Saves a file. A frame can forbid it, and only one of the same site says so. advice: what helps there
function save(blob, name, advice = OPEN) {
  const frame = window.frameElement;
  if (frame?.hasAttribute("sandbox") && !frame.sandbox.contains("allow-downloads")) {
    say(phrase`This frame forbids downloads: ${advice}.`);
    return;
  }
  if (window !== window.top) say(phrase`If no file appears, this frame forbids downloads: ${advice}.`);
  const link = element("a", { href: URL.createObjectURL(blob), download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}

// A canvas as a PNG, with the paper behind it.
function saveCanvas(canvas, name) {
  const sheet = element("canvas", { width: canvas.width, height: canvas.height }), pen = sheet.getContext("2d");
  pen.fillStyle = paint("paper");
  pen.fillRect(0, 0, sheet.width, sheet.height);
  pen.drawImage(canvas, 0, 0);
  sheet.toBlob((blob) => save(blob, name));
}

class LivePage extends PlayerPage {
  constructor() {
    super();
    this.charts = new GasCharts(find("charts"));
    this.table = new Table();
    this.controls = new Controls(find("controls"), content.controls, (control, value) => this.changed(control, value));
    this.pace = "time";
    this.speeds = { ...NORMAL };
    this.listen();
  }

  // Begins with what the address names after its #, or with the plain scene, and says why.
  openLink() {
    const text = location.hash.slice(1), { scene, config, view, mistake } = readLink(text, content.scenes);
    this.view = view ?? content.view;
    this.charts.isBrief = this.view === "beginner";
    document.body.classList.toggle("beginner", this.charts.isBrief);
    this.open(scene);
    if (!text) return;
    if (!mistake) this.begin(config);
    const reason = mistake || find("refusal").textContent.replace(/\.$/, "");
    if (!reason) return;
    refuse(phrase`The link has a mistake: ${reason}.`);
    clearTimeout(this.linkTimer); // it stays, to be corrected
  }

  get link() {
    return linkOf(this.scene, this.config, this.view === content.view ? null : this.view);
  }

  // The address follows what runs; some frames forbid this.
  writeLink() {
    try {
      history.replaceState(null, "", `#${this.link}`);
    } catch {}
  }

  copyLink() {
    if (location.protocol === "about:") say(phrase`A link needs the page by itself: save the page, and open its file.`);
    else copy(`${location.href.split("#")[0]}#${this.link}`, phrase`The link to this scene is copied.`);
  }

  // Begins with a scene of the page.
  open(scene) {
    this.scene = scene;
    say("");
    find("length").value = scene.config.collisions ?? "";
    find("title").textContent = scene.title;
    find("about").textContent = scene.about;
    for (const button of find("scenes").children) {
      button.setAttribute("aria-pressed", String(button.value === scene.name));
    }
    this.begin(structuredClone(scene.config));
  }

  // Begins with a config, or says why it cannot.
  begin(config) {
    let gas;
    try {
      gas = new Gas(config, own);
    } catch (error) {
      if (!(error instanceof SceneError)) throw error;
      refuse(refusalOf(error, config));
      if (this.config) this.controls.show(this.config);
      return;
    }
    this.gas = gas;
    this.config = config;
    const { size } = gas.scene.container, speeds = Array.from(gas.radii, (_, ball) => gas.speed(ball));
    const rootMeanSquare = Math.sqrt(speeds.reduce((sum, speed) => sum + speed * speed, 0) / speeds.length) || 1;
    const { wallLaw, masses } = gas.scene, warmest = Math.max(...lawsOfWall(wallLaw).map((law) => law.temperature ?? 0));
    const wall = Math.sqrt((2 * warmest) / masses[0]);
    this.topSpeed = 2 * Math.max(rootMeanSquare, wall);
    this.rate = Math.max(...size) / (Math.max(...speeds) || 1) / CROSSING; // s of the gas in a second
    this.arena = new Arena(find("arena"), gas, { ...viewOf(gas.scene.container), colours: content.colours });
    this.tag(this.scene.path ?? null);
    this.nameSpecies();
    this.charts.show([gas], FIRST_SPAN * CROSSING * this.rate);
    this.controls.show(config);
    find("seed").value = config.seed;
    find("length").placeholder = config.collisions === null ? `${config.time} s` : "";
    refuse("");
    this.end("");
    say("");
    find("measured").textContent = "";
    this.nameSpeeds();
    this.showConfig();
    this.chartsAt = this.fitAt = 0;
    this.refresh();
  }

  // An ending of the gas, with what to do next.
  end(text, button = "") {
    find("ending").hidden = !text;
    find("ending-text").textContent = text;
    find("continue").hidden = !button;
    find("continue").textContent = button;
  }

  changed(control, value) {
    const config = structuredClone(this.config);
    control.write(config, value, this.scene.config);
    const isFree = this.config.container.mass !== null, mustRestart = control.choices && (isFree || this.gas.scene.slides);
    const runs = this.gas.collisions > 0 && !this.gas.stop && !mustRestart;
    if (!control.live || !runs) {
      this.begin(config);
      return;
    }
    this.config = config;
    this.gas.setLaws(config);
    say(phrase`The gas goes on with this. Restart begins with it.`);
    refuse("");
    this.controls.show(config);
    this.showConfig();
    this.refresh();
  }

  play(wanted = !this.playing) {
    this.playing = wanted && !this.gas.stop;
    this.last = null;
    say("");
    this.refresh();
  }

  step() {
    this.playing = false;
    this.gas.advance(Infinity, 1);
    if (this.gas.stop) this.ended();
    this.refresh();
  }

  // Goes back to the collision before.
  stepBack() {
    const { gas } = this;
    if (!gas.canGoBack) return;
    this.playing = false;
    gas.goTo(gas.collisions - 1);
    if (gas.time < gas.watch?.from.time) gas.watch = null;
    this.end("");
    this.refresh();
  }

  // Simulates as far as the time since the last frame asks, or as it can.
  advance(passed) {
    const { gas, speed } = this, deadline = Date.now() + BUDGET, { time, collisions } = gas;
    let inTime, done;
    if (this.pace === "time") {
      inTime = gas.advance(time + passed * speed * this.rate, Infinity, deadline);
      done = (gas.time - time) / (speed * this.rate);
    } else {
      this.owed = Math.min((this.owed ?? 0) + passed * speed, speed);
      const whole = Math.floor(this.owed);
      if (whole) gas.advance(Infinity, whole, deadline);
      const all = gas.collisions - collisions;
      inTime = all >= whole || Boolean(gas.stop);
      this.owed = inTime ? this.owed - whole : 0;
      done = all / speed;
    }
    gas.followSlide();
    if (gas.stop) this.ended();
    return inTime ? passed : done;
  }

  // The repeat has ended: says why, and how to continue. Of the program's sentence, the part after the last
  // semicolon is for users of the program.
  ended() {
    this.playing = false;
    const message = this.gas.stop.message.replace(/; [^;]*$/, ""), way = this.gas.continuation;
    this.end(sentenceOf(message), way ? CONTINUATIONS[way] : "");
  }

  continue() {
    const { gas } = this, way = gas.continuation;
    if (way === "tc") this.begin({ ...this.config, collapse: { tc: TC } });
    else {
      // Where nothing can collide, only time goes on.
      if (gas.stop.reason === NOTHING_LEFT) document.querySelector("input[name=pace][value=time]").click();
      gas.continueWith(way);
      this.end("");
      this.showConfig();
    }
    this.play(true);
  }

  // The speed of the menu, which for real time depends on the gas.
  get speed() {
    const chosen = this.speeds[this.pace];
    return chosen === "real" ? 1 / this.rate : chosen;
  }

  flashes() {
    const { gas, rate } = this, byTime = this.pace === "time";
    return this.flashesOf(gas, ({ time, step }) => (byTime ? (gas.time - time) / rate : gas.collisions - step));
  }

  draw(now) {
    const { gas } = this, fast = this.relative ? 2 * gas.meanSpeed() || 1 : this.topSpeed;
    this.arena.draw(gas.time, this.flashes(), fast);
    find("fast").textContent = phrase`${short(fast, 2)} m/s and faster`;
    find("now").textContent = `t = ${this.timeText(gas.time)} s`;
    find("count").textContent = collisionsText(gas.collisions);
    find("play").setAttribute("aria-label", this.playing ? phrase`Pause` : phrase`Play`);
    find("play").disabled = find("forth").disabled = Boolean(gas.stop);
    find("back").disabled = !gas.canGoBack;
    document.body.classList.toggle("playing", this.playing);
    this.showWatch();
    if (this.playing && now - this.chartsAt < CHARTS_EVERY) return;
    this.chartsAt = now;
    if (!this.playing || now - this.fitAt > FIT_EVERY) {
      this.charts.fit();
      this.fitAt = now;
      this.showNumbers();
      this.showHashes();
    }
    this.charts.draw();
  }

  // Numbers that the charts do not show.
  showNumbers() {
    const { gas } = this, means = gas.means(), [across, up] = gas.simulation.momentum();
    const { wallEvents, pairEvents } = gas.simulation, rate = (value) => (means ? `${short(value)} /s` : "–");
    const numbers = {
      [phrase`balls`]: String(gas.number),
      [phrase`packing`]: short(packingOf(gas.scene)),
      [phrase`collisions at the wall`]: `${wallEvents.toLocaleString("en")}, ${rate(means?.wallRate)}`,
      [phrase`between balls`]: `${pairEvents.toLocaleString("en")}, ${rate(means?.pairRate)}`,
      [phrase`mean temperature`]: means ? `${short(means.temperature)} J` : "–",
      "PV/NT": means && Number.isFinite(means.ratio) ? short(means.ratio) : "–",
      [FASTER]: `${short(100 * gas.shareAbove(FAST))} %`,
      [phrase`momentum`]: `(${small(across, gas)}, ${small(up, gas)}) kg m/s`,
      [phrase`angular momentum`]: `${short(gas.simulation.angularMomentum())} kg m²/s`,
    };
    if (gas.scene.surface) numbers[phrase`temperature of rotation`] = `${short((2 * gas.simulation.spinEnergy()) / gas.number)} J`;
    const { container } = gas.scene;
    if (!hasWalls(container)) delete numbers[phrase`collisions at the wall`];
    // Each image of a ball has another one.
    if (repeatsAlong(0, container) || repeatsAlong(1, container)) delete numbers[phrase`angular momentum`];
    if (this.view === "beginner") for (const name of EXPERT) delete numbers[name];
    find("numbers").replaceChildren(...Object.entries(numbers).map(([name, value]) => {
      const group = element("div");
      group.append(element("dt", { textContent: name }), element("dd", { textContent: value }));
      return group;
    }));
  }

  showConfig() {
    clearTimeout(this.linkTimer);
    this.linkTimer = setTimeout(() => this.writeLink(), LINK_AFTER);
    find("yaml").textContent = yamlOf(this.gas.program, content.defaults);
    find("exactness").textContent = this.gas.changed
      ? [
        phrase`A slider was moved while the gas ran, or it continued after its end, so no config describes this run.`,
        phrase`Restart: then the config below does.`,
      ].join(" ")
      : phrase`This config describes what runs now. The program gives the same collisions to the last bit.`;
    find("exactness").classList.toggle("warning", this.gas.changed);
    this.hashed = null;
    this.showHashes();
  }

  showHashes() {
    const { gas, config } = this, shown = gas.changed ? [] : gas.hashes, most = shown[shown.length - 1]?.[0];
    if (this.hashed === most) return;
    this.hashed = most;
    const longer = most > (config.collisions ?? Infinity) ? ` -o collisions=${most}` : "";
    find("run").textContent = `snooker run gas.yaml${longer}`;
    const rows = shown.flatMap(([count, hash]) => [
      element("dt", { textContent: count.toLocaleString("en") }), element("dd", { textContent: hash }),
    ]);
    const none = gas.changed ? phrase`no config describes this run` : phrase`they appear after 1,000 collisions, or at the end`;
    if (!rows.length) rows.push(element("dt", { textContent: phrase`none` }), element("dd", { textContent: none }));
    find("hashes").replaceChildren(...rows);
  }

  // The menu says what each speed is at this pace.
  nameSpeeds() {
    const byStep = this.pace === "events", speeds = SPEEDS[this.pace];
    const names = speeds.map((speed) => {
      if (!byStep) return phrase`${fraction(speed)} (${short(speed * this.rate, 2)} s per second)`;
      return speed === 1 ? phrase`1 collision per second` : phrase`${grouped(speed)} collisions per second`;
    });
    find("speed").replaceChildren(...names.map((name, k) => new Option(name, String(speeds[k]))));
    if (!byStep) {
      find("speed").append(new Option(phrase`real time`, "real"));
      find("speed").lastChild.dataset.aside = "true";
    }
    find("speed").value = String(this.speeds[this.pace]);
  }

  setPace(pace) {
    this.pace = pace;
    this.nameSpeeds();
    this.refresh();
  }

  // Shows the path of a ball, or none for null.
  tag(ball) {
    this.gas.tag(ball);
    find("tagged").value = ball ?? "";
    find("tagged").max = this.gas.number - 1;
    this.refresh();
  }

  // The same, as a user asks for it.
  choose(ball) {
    this.tag(ball);
    say(ball === null ? phrase`No path is shown.` : phrase`The path of ball ${ball} is shown.`);
  }

  // Offers colours by species, if balls differ, and has the legend name them.
  nameSpecies() {
    const all = speciesIn(this.gas.scene), areFew = all.length > 1 && all.length <= SPECIES.length;
    const menu = find("colours"), chosen = menu.value;
    this.coloursOfSpecies = [];
    find("species").replaceChildren(...(areFew ? all : []).map(({ radius, mass, balls }, k) => {
      const dot = element("i"), entry = element("span"), number = balls.length;
      dot.style.background = SPECIES[k];
      const sizes = `${brief(radius)} m, ${brief(mass)} kg`;
      entry.append(dot, number === 1 ? phrase`1 ball of ${sizes}` : phrase`${number} balls of ${sizes}`);
      for (const ball of balls) this.coloursOfSpecies[ball] = SPECIES[k];
      return entry;
    }));
    if (areFew) menu.append(this.bySpecies);
    else this.bySpecies.remove();
    menu.value = areFew || chosen !== "species" ? chosen : "fixed";
    this.colour();
  }

  // Colours by speed or by species.
  colour() {
    const bySpecies = find("colours").value === "species";
    this.arena.colours = bySpecies ? this.coloursOfSpecies : null;
    find("speeds").hidden = bySpecies;
    find("species").hidden = !bySpecies;
    find("arena").setAttribute("aria-label", bySpecies
      ? phrase`Balls in their container, coloured by species` : phrase`Balls in their container, coloured by speed`);
    this.refresh();
  }

  // Starts or stops the stopwatch.
  pressWatch() {
    const { gas } = this, text = find("watch-end").value, duration = text === "" ? Infinity : Number(text);
    if (gas.watched?.isOver === false) gas.stopWatch();
    else if (duration > 0) gas.startWatch(duration);
    else say(phrase`Give a time above 0 s for the stopwatch, or none.`);
    this.refresh();
  }

  showWatch() {
    const { watched } = this.gas, button = find("watch"), text = watched ? this.countedBy(watched) : "";
    const name = watched?.isOver === false ? phrase`Stop stopwatch` : phrase`Start stopwatch`;
    if (watched?.isOver && button.textContent !== name) say(phrase`The stopwatch stops: ${text}.`);
    button.textContent = name;
    find("watched").textContent = text;
  }

  countedBy({ time, wallEvents, pairEvents }) {
    const between = phrase`between balls ${grouped(pairEvents)}`, wall = phrase`at the wall ${grouped(wallEvents)}`;
    const counts = hasWalls(this.gas.scene.container) ? `${wall}, ${between}` : between;
    return phrase`${this.timeText(time)} s; collisions ${counts}`;
  }

  // A time so fine that a step from one collision to the next is seen: while a ball crosses the container, each
  // collides some times.
  timeText(time) {
    return decimal(time, Math.ceil(Math.log10((100 + 10 * this.gas.number) / this.rate)));
  }

  restart() {
    this.begin(this.config);
  }

  // Simulates the config with several starts in a worker, which a user can end.
  measure() {
    const { starts, length } = this.asked();
    if (!starts) return;
    const config = structuredClone(this.config);
    if (length) Object.assign(config, { collisions: length, time: config.collisions === null ? null : config.time });
    const [engine] = find("script").textContent.split("/* The page"), source = `${engine}\n(${worker})();`;
    const results = [], end = (text) => this.endMeasurement(text);
    this.workerUrl = URL.createObjectURL(new Blob([source], { type: "text/javascript" }));
    try {
      this.worker = new Worker(this.workerUrl);
    } catch {
      end(NO_WORKER);
      return;
    }
    this.measuring(true);
    this.worker.onmessage = ({ data }) => {
      if (data.error) {
        end(refusalOf(data.error, config));
        return;
      }
      results.push(data);
      find("progress").value = results.length / starts;
      find("measured").textContent = phrase`${results.length} of ${starts} starts`;
      if (results.length < starts) return;
      const row = tableRow(config, results, startingScene(config, 0, own));
      this.table.add(row);
      const needed = phrase`The means need ${row.short} collisions between balls in a start, so that speeds mix.`;
      end(phrase`${starts} starts measured.` + (row.short ? ` ${needed} ${phrase`Give more collisions.`}` : ""));
    };
    this.worker.onerror = (event) => end(event.message ? phrase`The measurement failed: ${event.message}.` : NO_WORKER);
    this.worker.postMessage({ config, starts, own, compiled: modules });
  }

  // How many starts and collisions are asked for; none, with a sentence, where they do not fit.
  asked() {
    const starts = Number(find("starts").value), text = find("length").value, length = Number(text);
    const whole = Number.isInteger(starts) && starts >= 5 && starts <= 500;
    const inRange = Number.isInteger(length) && length >= 10 && length <= LONGEST;
    const refusal = find("measured");
    if (!whole) refusal.textContent = phrase`Give 5 to 500 starts.`;
    else if (!(text === "" ? this.config.collisions === null : inRange)) {
      refusal.textContent = phrase`Give 10 to ${grouped(LONGEST)} collisions.`;
    } else if (this.config.balls.list && this.gas.scene.wallKey === null) {
      refusal.textContent = phrase`All starts are the same, because each ball has a given velocity. Choose another scene.`;
    } else return { starts, length };
    return {};
  }

  measuring(busy) {
    find("measure").disabled = busy;
    find("cancel").hidden = find("progress").hidden = !busy;
    find("progress").value = 0;
  }

  endMeasurement(text) {
    this.worker?.terminate();
    URL.revokeObjectURL(this.workerUrl);
    this.measuring(false);
    find("measured").textContent = text;
  }

  listen() {
    for (const scene of content.scenes) {
      const { name: value, title: textContent, about: title } = scene;
      const button = element("button", { type: "button", className: "text", value, textContent, title });
      button.onclick = () => { this.play(false); this.open(scene); };
      find("scenes").append(button);
    }
    showLegend(content.colours);
    this.bySpecies = new Option(phrase`species`, "species");
    find("colours").addEventListener("change", () => this.colour());
    const explained = {
      restart: phrase`Begins again with the config below.`,
      seed: phrase`Seed of the random start: the same seed gives the same collisions.`,
      starts: phrase`How many random starts are simulated: more give smaller errors.`,
      length: phrase`After how many collisions each of them ends.`,
      speed: phrase`How much time, or how many collisions, pass in a second.`,
      forth: phrase`Goes to the next collision.`, back: phrase`Goes back to the collision before.`,
      play: phrase`Starts or pauses the gas.`,
      measure: phrase`Simulates the scene from several starts and adds a row to the table.`,
      cancel: phrase`Ends the measurement.`,
      again: phrase`Begins the means, the rates and the histogram of speeds again, for example when a gas is steady.`,
      "charts-image": phrase`Saves the charts as a picture.`, "plot-image": phrase`Saves the plot as a picture.`,
      "copy-link": phrase`Copies a link to this scene, as it is set now.`,
      "copy-config": phrase`Copies the config.`, "save-config": phrase`Saves the config as a file for snooker run.`,
      "copy-table": phrase`Copies the table for a spreadsheet.`, "save-table": phrase`Saves the table with all digits.`,
      "clear-table": phrase`Removes all rows.`,
      "plot-x": phrase`What the plot has on its horizontal axis.`, "plot-y": phrase`What the plot has on its vertical axis.`,
      continue: phrase`Continues from the places and velocities now.`,
      tagged: phrase`Number of the ball whose path is drawn; empty for none.`,
      watch: phrase`Counts time and collisions of the gas.`, "watch-end": phrase`Time of the gas after which the stopwatch stops.`,
    };
    for (const [name, sentence] of Object.entries(explained)) find(name).title = sentence;
    for (const kind of ["focusin", "mouseover"]) {
      document.addEventListener(kind, ({ target }) => {
        const sentence = target.closest?.("[title]")?.title;
        if (sentence) find("hint").textContent = sentence;
      });
    }
    find("forth").onclick = () => this.step();
    find("back").onclick = () => this.stepBack();
    find("restart").onclick = () => this.restart();
    find("continue").onclick = () => this.continue();
    find("seed").onchange = () => {
      const seed = typedValue(SEED, find("seed").value);
      if (!Number.isNaN(seed)) this.begin({ ...this.config, seed });
      find("seed").value = this.config.seed;
    };
    find("again").onclick = () => { this.gas.forgetMeans(); this.redraw(); };
    find("charts-image").onclick = () => saveCanvas(find("charts"), "charts.png");
    find("measure").onclick = () => this.measure();
    find("cancel").onclick = () => this.endMeasurement(phrase`Cancelled.`);
    find("copy-link").onclick = () => this.copyLink();
    window.addEventListener("hashchange", () => { this.play(false); this.openLink(); });
    find("copy-config").onclick = () => copy(find("yaml").textContent, phrase`The config is copied.`);
    find("save-config").onclick = () => save(new Blob([find("yaml").textContent], { type: "text/yaml" }), "gas.yaml", COPY);
    find("speed").onchange = () => {
      const { value } = find("speed");
      this.speeds[this.pace] = value === "real" ? value : Number(value);
      this.refresh();
    };
    find("arena").onclick = (event) => {
      const ball = this.arena.ballAt(event.offsetX, event.offsetY);
      if (ball === null) {
        this.play();
        say(this.playing ? phrase`The gas runs.` : phrase`The gas pauses.`);
      } else this.choose(ball === this.gas.tagged ? null : ball);
    };
    find("tagged").onchange = () => {
      const text = find("tagged").value, ball = Number(text), { number } = this.gas;
      if (text === "" || (Number.isInteger(ball) && ball >= 0 && ball < number)) this.choose(text === "" ? null : ball);
      else say(phrase`There is no ball ${text}: give a number from 0 to ${number - 1}.`);
      find("tagged").value = this.gas.tagged ?? "";
    };
    find("watch").onclick = () => this.pressWatch();
    const phone = window.matchMedia("(max-width: 44rem)"), fold = () => { find("sliders").open = !phone.matches; };
    phone.addEventListener("change", fold);
    fold();
    followScreen(() => this.redraw());
    this.listenToAll({
      ArrowRight: () => this.step(),
      ArrowLeft: () => this.stepBack(),
      r: () => this.restart(),
    }, "select, input, pre, .scroll, button.text");
  }

  redraw() {
    this.chartsAt = 0;
    this.table.draw();
    this.refresh();
  }
}

// What a worker does: measures one start after the other, and reports each.
function worker() {
  onmessage = ({ data: { config, starts, own, compiled } }) => {
    Object.assign(modules, compiled);
    try {
      for (let repeat = 0; repeat < starts; repeat++) postMessage(measureRepeat(config, repeat, own));
    } catch (error) {
      if (!(error instanceof SceneError)) throw error;
      postMessage({ error: { message: error.message, helps: error.helps } });
    }
  };
}

// A component of the momentum; zero where it is only rounding.
function small(value, { scene, meter }) {
  const mass = scene.masses.reduce((sum, m) => sum + m, 0);
  return Math.abs(value) < 1e-9 * Math.sqrt(2 * mass * meter.energy) ? "0" : short(value);
}

const fraction = (speed) => ({ 0.125: "⅛", 0.25: "¼", 0.5: "½" })[speed] ?? String(speed);

let live = null;

function start() {
  live = new LivePage();
  live.openLink();
}

const started = compileModules(JSON.parse(find("modules").textContent)).then(start, () => refuse(FORBIDDEN));
