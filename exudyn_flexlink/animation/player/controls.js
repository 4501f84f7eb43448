// The player: what is on the page, what the reader does, and the clock.

const STEPS = [1, 2, 5];
const FOLLOWED = 5; // times larger, where the picture follows S
const ICONS = {
  first: "M5 5v14M19 5l-10 7 10 7z",
  back: "M15 5l-9 7 9 7zM19 5v14",
  play: "M7 4l13 8-13 8z",
  pause: "M8 5v14M16 5v14",
  next: "M9 5l9 7-9 7zM5 5v14",
};

class Player {
  constructor(root, data) {
    this.root = root;
    this.data = data;
    this.takes = data.takes.map((take) => new Take(take));
    this.t = data.begin;
    this.speed = data.speed;
    this.playing = false;
    this.repeats = true;
    this.follows = false;
    this.slows = data.slow.length > 0;
    this.stretches = this.slows ? data.slow : data.strikes;
    this.zoom = 1;
    this.centre = null;
    this.visible = true;
    this.printing = false;
    this.largest = largestOf(this.takes);
    this.build();
    this.listen();
    this.draw();
    if (data.at_once && !matchMedia("(prefers-reduced-motion: reduce)").matches) this.play();
  }

  build() {
    const { root, data } = this;
    const box = make(root, "div", "frame");
    this.told = make(box, "div", "told");
    this.stage = make(box, "div", "stage");
    this.picture = make(this.stage, "canvas", "picture");
    const [left, low, right, high] = data.box;
    this.picture.style.aspectRatio = `${right - left} / ${Math.min(high - low, right - left)}`;
    this.picture.setAttribute("role", "img");
    this.picture.setAttribute("aria-label", `Animation: ${data.title}`);
    this.whole = button(this.stage, "whole", "whole view", () => this.look(1, null));
    this.pens = [new Pen(this.picture)];
    const names = this.takes.flatMap((take) => take.zooms.map((zoom) => zoom.name));
    const room = make(box, "div", "zooms");
    this.zooms = [...new Set(names)].map((name) => ({ pen: new Pen(make(room, "canvas", "zoom")), name }));
    this.line = make(box, "canvas", "line");
    this.line.tabIndex = 0;
    for (const [name, value] of [["role", "slider"], ["aria-label", "time"],
      ["aria-valuemin", data.begin], ["aria-valuemax", data.end]]) this.line.setAttribute(name, value);
    this.pens.push(new Pen(this.line));
    this.addControls(make(box, "div", "controls"));
    box.style.setProperty("--zooms", this.zooms.length);
    this.swatches = [];
    if (this.takes.length > 1) this.addNames(box);
  }

  addControls(bar) {
    const keys = make(bar, "div", "keys");
    icon(keys, "first", "to the beginning (Home)", () => this.go(this.data.begin));
    icon(keys, "back", "one step back (left arrow)", () => this.step(-1));
    this.playKey = icon(keys, "play", "play (space)", () => this.toggle());
    this.playKey.classList.add("flexlink-main");
    icon(keys, "next", "one step on (right arrow)", () => this.step(1));
    const pace = make(bar, "div", "keys");
    button(pace, "less", "\u2212", () => this.change(-1), "slower (minus)");
    this.pace = make(pace, "output", "pace");
    button(pace, "more", "+", () => this.change(1), "faster (plus)");
    const more = make(bar, "div", "keys");
    this.flags = {};
    if (this.stretches.length) this.flag(more, "slows", "slow at strikes", "slow motion at strikes (s)");
    this.flag(more, "follows", "follow S", "follow S, larger (f)");
    this.flag(more, "repeats", "repeat", "begin again at the end (r)");
  }

  addNames(box) {
    const names = make(box, "div", "names");
    for (const take of this.takes) {
      const name = make(names, "span", "name");
      this.swatches.push(make(name, "i", "swatch"));
      name.append(take.data.name);
    }
  }

  flag(bar, name, words, about) {
    this.flags[name] = button(bar, "flag", words, () => this.switch(name), about);
    this.flags[name].setAttribute("aria-pressed", this[name]);
  }

  switch(name) {
    if (name === "follows") {
      this.look(1, null, !this.follows);
    } else {
      this.set(name, !this[name]);
      this.draw();
    }
  }

  set(name, on) {
    this[name] = on;
    this.flags[name].setAttribute("aria-pressed", on);
  }

  listen() {
    const keys = this.data.at_once ? document : this.root;
    keys.addEventListener("keydown", (event) => this.press(event));
    this.picture.tabIndex = 0;
    new PointerWatch(this);
    const redraw = () => this.draw();
    new ResizeObserver(redraw).observe(this.root);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => requestAnimationFrame(redraw));
    new MutationObserver(redraw).observe(document.documentElement, { attributes: true, subtree: false });
    if (document.body) new MutationObserver(redraw).observe(document.body, { attributes: true });
    new IntersectionObserver(([seen]) => { this.visible = seen.isIntersecting; }).observe(this.root);
    for (const [name, printing] of [["beforeprint", true], ["afterprint", false]]) {
      window.addEventListener(name, () => { this.printing = printing; this.draw(); });
    }
  }

  press(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const times = event.shiftKey ? 10 : 1;
    const actions = {
      " ": () => this.toggle(), k: () => this.toggle(),
      ArrowLeft: () => this.step(-times), ArrowRight: () => this.step(times),
      Home: () => this.go(this.data.begin), End: () => this.go(this.data.end),
      "+": () => this.change(1), "=": () => this.change(1), "-": () => this.change(-1),
      s: () => this.flags.slows && this.switch("slows"),
      f: () => this.switch("follows"), r: () => this.switch("repeats"),
    };
    const onButton = event.target instanceof HTMLButtonElement;
    if (!(event.key in actions) || (onButton && event.key === " ")) return;
    event.preventDefault();
    actions[event.key]();
  }

  toggle() {
    if (this.playing) this.pause();
    else this.play();
  }

  play() {
    if (this.t >= this.data.end) this.t = this.data.begin;
    this.setPlaying(true);
    this.last = null;
    requestAnimationFrame((now) => this.tick(now));
  }

  pause() {
    this.setPlaying(false);
  }

  setPlaying(playing) {
    this.playing = playing;
    this.playKey.querySelector("path").setAttribute("d", playing ? ICONS.pause : ICONS.play);
    this.playKey.setAttribute("aria-label", playing ? "pause (space)" : "play (space)");
    this.playKey.title = this.playKey.getAttribute("aria-label");
  }

  tick(now) {
    if (!this.playing || !this.root.isConnected) return;
    // After a pause of the page, such as another tab, time goes on from where it was.
    const passed = this.last === null ? 0 : Math.min((now - this.last) / 1000, 0.1);
    this.last = now;
    if (this.visible) {
      this.t += passed * this.paceAt(this.t);
      if (this.t >= this.data.end) {
        this.t = this.repeats ? this.data.begin : this.data.end;
        if (!this.repeats) this.pause();
      }
      this.draw();
    }
    requestAnimationFrame((later) => this.tick(later));
  }

  // Seconds of the run in a second of the film.
  paceAt(t) {
    const own = this.slows ? this.stretches.find(([begin, end]) => begin <= t && t < end) : null;
    return own ? Math.min(this.speed, (own[1] - own[0]) / this.data.slow_seconds) : this.speed;
  }

  // When in the film, s from its begin, an instant of the run is seen.
  secondsAt(t) {
    const { begin, slow_seconds: lasts } = this.data;
    let seconds = (t - begin) / this.speed;
    for (const [from, to] of this.slows ? this.stretches : []) {
      const slow = Math.min(this.speed, (to - from) / lasts);
      const inside = Math.min(Math.max(t - from, 0), to - from);
      seconds += inside / slow - inside / this.speed;
    }
    return seconds;
  }

  step(count) {
    this.pause();
    this.go(this.t + (count * this.paceAt(this.t)) / 25);
  }

  go(t) {
    this.t = Math.min(Math.max(t, this.data.begin), this.data.end);
    this.draw();
  }

  // To the next speed of 1, 2 or 5 times a power of ten.
  change(way) {
    const power = 10 ** Math.floor(Math.log10(this.speed) + 1e-9);
    const known = [0.5, ...STEPS, 10].map((step) => Number((step * power).toPrecision(1)));
    const next = way > 0 ? known.find((one) => one > 1.01 * this.speed)
      : known.reverse().find((one) => one < 0.99 * this.speed);
    this.speed = Math.min(Math.max(next, 1e-7), 1e3);
    this.draw();
  }

  // A reader who looks elsewhere follows S no longer.
  look(zoom, centre, follows = false) {
    this.zoom = Math.min(Math.max(zoom, 1), 500);
    this.centre = this.zoom > 1 ? centre : null;
    this.set("follows", follows);
    this.draw();
  }

  // How many times larger than the whole view the picture is.
  get larger() {
    return this.follows ? FOLLOWED : this.zoom;
  }

  view() {
    const { part, x, y } = this.takes[0].data.points.S;
    const centre = this.follows ? this.takes[0].at(part, x, y) : this.centre;
    return viewOf(this.pens[0], this.data.box, this.larger, centre);
  }

  draw() {
    const dark = !this.printing && isLight(getComputedStyle(this.root).color);
    const speed = this.paceAt(this.t);
    for (const take of this.takes) take.seek(this.t);
    const [pen, line] = this.pens;
    pen.begin(dark);
    if (pen.width === 0) return;
    const view = this.view();
    const both = this.takes.length > 1;
    this.takes.forEach((take) => {
      drawTrail(pen, view, take, this.t, LOOK.trail * this.speed, take.data.colour || INK);
    });
    this.takes.forEach((take, rank) => drawTake(pen, view, take, both ? rank : -1));
    this.takes.forEach((take, rank) => drawTouches(pen, view, take, this, rank));
    drawPoints(pen, view, this.takes[0]);
    drawScale(pen, view, this.data.unit);
    for (const { pen: own, name } of this.zooms) {
      own.begin(dark);
      drawZoom(own, this, name);
    }
    line.begin(dark);
    drawTimeline(line, this);
    this.swatches.forEach((own, i) => { own.style.background = pen.colour(this.takes[i].data.colour); });
    this.tell(speed);
  }

  tell(speed) {
    const [take] = this.takes;
    const rows = [`t = ${fixed(this.t, speed / 25)} s`];
    const angle = take.crankAngle();
    if (angle !== null) rows.push(`crank ${((angle * 180) / Math.PI).toFixed(1)}°`.replace("-", "\u2212"));
    if (speed < this.speed) rows.push(`slow motion, ${told(speed)} × real time`);
    if (this.takes.length > 1) rows.push(`S apart by ${this.apart()}`);
    const beyond = this.data.horizon;
    if (beyond !== null && this.t >= beyond.from) rows.push(beyond.words.replace("\n", " "));
    if (this.data.doubts) rows.push(this.data.doubts.replace(/e-(\d)/g, "e\u2011$1")); // a number is not broken
    rows.forEach((row, i) => {
      const span = this.told.children[i] || make(this.told, "span", "row");
      if (span.textContent !== row) span.textContent = row;
    });
    while (this.told.children.length > rows.length) this.told.lastChild.remove();
    const pace = `${told(this.speed)} × real time`;
    if (this.pace.textContent !== pace) this.pace.textContent = pace;
    this.line.setAttribute("aria-valuenow", this.t);
    this.line.setAttribute("aria-valuetext", rows.join(", "));
    this.whole.hidden = this.zoom === 1;
    this.picture.classList.toggle("flexlink-larger", this.zoom > 1);
  }

  apart() {
    const [[x, y], [X, Y]] = this.takes.map((take) => {
      const S = take.data.points.S;
      return take.at(S.part, S.x, S.y);
    });
    const { factor, name } = this.data.unit;
    return `${(factor * Math.hypot(X - x, Y - y)).toPrecision(2)} ${name}`;
  }
}

// A number with the digits that a step in it needs.
function fixed(value, step) {
  const digits = Math.ceil(-Math.log10(step));
  return value.toFixed(Math.min(Math.max(digits, 0), 9)).replace("-", "\u2212");
}

function told(speed) {
  return speed >= 1e-4 ? String(Number(speed.toPrecision(2))) : speed.toExponential(0);
}

function largestOf(takes) {
  const every = takes.flatMap((take) => take.touching.flatMap((own) => [...own.strength, ...own.force]));
  const largest = { force: 0, impulse: 0 };
  for (const one of every) {
    if (one < 0) largest.impulse = Math.max(largest.impulse, -one);
    else largest.force = Math.max(largest.force, one);
  }
  return largest;
}

function isLight(colour) {
  const [r, g, b] = colour.match(/[\d.]+/g).map(Number);
  return 0.3 * r + 0.6 * g + 0.1 * b > 128;
}

function make(parent, kind, name) {
  const found = document.createElement(kind);
  found.className = `flexlink-${name}`;
  parent.append(found);
  return found;
}

function button(parent, name, words, act, about = words) {
  const found = make(parent, "button", name);
  found.type = "button";
  found.append(words);
  found.title = about;
  found.setAttribute("aria-label", about);
  found.addEventListener("click", act);
  return found;
}

function icon(parent, name, about, act) {
  const found = button(parent, name, "", act, about);
  found.innerHTML = `<svg viewBox="0 0 24 24" aria-hidden="true"><path d="${ICONS[name]}"/></svg>`;
  return found;
}
