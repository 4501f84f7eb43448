// The line below the picture: turns of the crank, touches, the part that was seen; and pointers.

const EDGE = 10; // pixels beside the line
const WORDS = 14; // pixels below the line and its dot: words of 11, and their rim

function drawTimeline(pen, player) {
  const { begin, end, horizon: beyond } = player.data;
  const put = (t) => EDGE + ((pen.width - 2 * EDGE) * (t - begin)) / (end - begin);
  const dot = 5; // of the pen's pixels
  const [top, bottom] = [4, pen.height - WORDS - dot * pen.thick];
  const all = (colour, from, to, alpha, high = top) =>
    pen.fill([[from, high], [to, high], [to, bottom], [from, bottom]], colour, alpha);
  all(PALE, put(begin), put(end), 0.12);
  const [take] = player.takes;
  if (beyond !== null && beyond.from < end) all("#8A63B0", put(Math.max(beyond.from, begin)), put(end), 0.25);
  if (player.slows) for (const [from, to] of player.stretches) all("#0072B2", put(from), put(to), 0.22);
  all("#0072B2", put(begin), put(player.t), 0.18);
  if (take.data.turns) drawTurns(pen, put, take, top, bottom);
  for (const one of player.takes) {
    for (const own of one.touching) {
      const seen = new Map(); // of touches in one pixel the strongest is drawn
      for (let k = 0; k < own.begin.length; k++) {
        const force = own.strength[k];
        const part = Math.sqrt(Math.abs(force) / (force < 0 ? player.largest.impulse : player.largest.force));
        const x = Math.round(put(Math.max(own.begin[k], begin)));
        const last = Math.max(Math.round(put(Math.min(own.end[k], end))), x + 1);
        seen.set(x, [Math.max(part || 0, (seen.get(x) || [0])[0]), last]);
      }
      for (const [x, [part, last]] of seen) {
        all(TOUCH, x, last + 0.5, own.places === null ? 0.9 : 0.5, bottom - (bottom - top) * Math.max(part, 0.15));
      }
    }
  }
  const x = put(player.t);
  pen.line([[x, top - 2], [x, bottom]], INK, 2);
  pen.dot([x, bottom], dot, INK);
  const [look, below] = [{ size: 11, colour: PALE }, pen.height - WORDS / 2];
  pen.words(`${fixed(begin, (end - begin) / 999)} s`, EDGE, below, look);
  pen.words(`${fixed(end, (end - begin) / 999)} s`, pen.width - EDGE, below, { ...look, align: "right" });
}

function drawTurns(pen, put, take, top, bottom) {
  const turn = (i) => Math.floor(Math.abs(take.crank[i] - take.crank[0]) / (2 * Math.PI) + 1e-9);
  for (let i = 1; i < take.time.length; i++) {
    if (turn(i) > turn(i - 1)) pen.line([[put(take.time[i]), top], [put(take.time[i]), bottom]], PALE, 1, 0.5);
  }
}

// What fingers, pens and mice do on the line and on the picture.
class PointerWatch {
  constructor(player) {
    this.player = player;
    this.down = new Map();
    const { line, picture } = player;
    line.addEventListener("pointerdown", (event) => this.seek(event, true));
    line.addEventListener("pointermove", (event) => this.seek(event, false));
    picture.addEventListener("pointerdown", (event) => this.begin(event));
    picture.addEventListener("pointermove", (event) => this.move(event));
    for (const name of ["pointerup", "pointercancel"]) {
      picture.addEventListener(name, (event) => this.end(event));
    }
    picture.addEventListener("wheel", (event) => this.wheel(event), { passive: false });
  }

  seek(event, first) {
    const { player } = this;
    if (first) {
      player.pause();
      player.line.setPointerCapture(event.pointerId);
    }
    if (!player.line.hasPointerCapture(event.pointerId)) return;
    const room = player.line.getBoundingClientRect();
    const part = (event.clientX - room.left - EDGE) / (room.width - 2 * EDGE);
    player.go(player.data.begin + part * (player.data.end - player.data.begin));
  }

  place(event) {
    const room = this.player.picture.getBoundingClientRect();
    return [event.clientX - room.left, event.clientY - room.top];
  }

  begin(event) {
    this.player.picture.setPointerCapture(event.pointerId); // it may be let go beside the picture
    this.down.set(event.pointerId, this.place(event));
    this.moved = this.down.size > 1;
  }

  // One pointer moves a picture that is larger than its frame, two make it larger or smaller.
  move(event) {
    if (!this.down.has(event.pointerId)) return;
    const before = [...this.down.values()];
    const old = this.down.get(event.pointerId);
    const here = this.place(event);
    if (Math.hypot(here[0] - old[0], here[1] - old[1]) < 3 && !this.moved) return;
    this.moved = true;
    this.down.set(event.pointerId, here);
    const after = [...this.down.values()];
    if (this.player.zoom === 1 && after.length === 1) return;
    this.change(middle(before), middle(after), after.length > 1 ? spread(after) / spread(before) : 1);
  }

  change(from, to, factor) {
    const { player } = this;
    const view = player.view();
    const under = view.back(from);
    const zoom = Math.min(Math.max(player.larger * factor, 1), 500);
    const scale = (view.scale * zoom) / player.larger;
    const { width, height } = player.pens[0];
    player.look(zoom, [under[0] - (to[0] - width / 2) / scale, under[1] + (to[1] - height / 2) / scale]);
  }

  end(event) {
    if (!this.down.delete(event.pointerId) || this.down.size > 0) return;
    if (!this.moved && event.type === "pointerup") this.player.toggle();
  }

  // Ctrl and the wheel, or two fingers on a touchpad: the page scrolls by the wheel alone.
  wheel(event) {
    if (!event.ctrlKey) return;
    event.preventDefault();
    const here = this.place(event);
    this.change(here, here, Math.exp(-event.deltaY / 200));
  }
}

function middle(places) {
  return [0, 1].map((i) => places.reduce((sum, place) => sum + place[i], 0) / places.length);
}

function spread([first, second]) {
  return Math.max(Math.hypot(first[0] - second[0], first[1] - second[1]), 1);
}
