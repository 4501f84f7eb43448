// Drawing: the mechanism, the trail of S, and touches.

// Colours of figures on white, and what stands for them on black.
const ON_BLACK = {
  "#0072B2": "#4FB0E8", "#D55E00": "#FF8B45", "#009E73": "#35C79B", "#CC79A7": "#E3A0C6",
  "#E69F00": "#F5BC42", "#9A9A9A": "#A6ADB6", "#A9A9A9": "#8E959E", "#C9C9C9": "#5E656E",
  "#777777": "#9AA1AA", "#222222": "#E4E7EB",
};
const { ink: INK, pale: PALE, touch: TOUCH } = LOOK;

class Pen {
  constructor(canvas) {
    this.canvas = canvas;
    this.context = canvas.getContext("2d");
    this.dark = false;
  }

  // Take the size of the page, in its pixels, and clear all.
  begin(dark) {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    const fine = window.devicePixelRatio || 1;
    const [w, h] = [Math.round(width * fine), Math.round(height * fine)];
    if (this.canvas.width !== w || this.canvas.height !== h) {
      this.canvas.width = w;
      this.canvas.height = h;
    }
    Object.assign(this, { width, height, dark });
    this.context.setTransform(fine, 0, 0, fine, 0, 0);
    this.context.clearRect(0, 0, width, height);
    this.context.lineCap = this.context.lineJoin = "round";
    this.thick = Math.min(Math.max(width / LOOK.wide, LOOK.thinnest), LOOK.broadest);
  }

  colour(name) {
    return this.dark ? ON_BLACK[name] || name : name;
  }

  get paper() {
    return this.dark ? "#14171C" : "#FFFFFF";
  }

  // A line through places in pixels, [x, y] each.
  line(places, colour, width, alpha = 1, closed = false) {
    const c = this.context;
    c.beginPath();
    for (const [x, y] of places) c.lineTo(x, y);
    if (closed) c.closePath();
    c.globalAlpha = alpha;
    c.strokeStyle = this.colour(colour);
    c.lineWidth = width * this.thick;
    c.stroke();
    c.globalAlpha = 1;
  }

  fill(places, colour, alpha = 1) {
    const c = this.context;
    c.beginPath();
    for (const [x, y] of places) c.lineTo(x, y);
    c.globalAlpha = alpha;
    c.fillStyle = this.colour(colour);
    c.fill();
    c.globalAlpha = 1;
  }

  dot([x, y], radius, colour, edge = null, alpha = 1) {
    const c = this.context;
    c.globalAlpha = alpha;
    c.beginPath();
    c.arc(x, y, radius * this.thick, 0, 2 * Math.PI);
    c.fillStyle = this.colour(colour);
    c.fill();
    if (edge !== null) {
      c.strokeStyle = this.colour(edge);
      c.lineWidth = 1.6 * this.thick;
      c.stroke();
    }
    c.globalAlpha = 1;
  }

  font(size, bold) {
    return `${bold ? "600 " : ""}${size}px system-ui, sans-serif`;
  }

  // How wide words are, pixels.
  widthOf(text, size, bold) {
    this.context.font = this.font(size, bold);
    return this.context.measureText(text).width;
  }

  // Words with a rim of the paper's colour, so that lines behind them do not disturb.
  words(text, x, y, { colour = INK, size = 12, align = "left", bold = false, alpha = 1 } = {}) {
    const c = this.context;
    c.globalAlpha = alpha;
    c.font = this.font(size, bold);
    c.textAlign = align;
    c.textBaseline = "middle";
    c.lineWidth = 3.5;
    c.strokeStyle = this.paper;
    c.strokeText(text, x, y);
    c.fillStyle = this.colour(colour);
    c.fillText(text, x, y);
    c.globalAlpha = 1;
  }
}

// How metres become pixels: the box of the film in the middle, `zoom` times as large around
// `centre` (m), if there is one.
function viewOf(pen, box, zoom, centre) {
  const [left, low, right, high] = box;
  const fit = Math.min(pen.width / (right - left), pen.height / (high - low));
  const scale = fit * zoom;
  const [cx, cy] = centre || [(left + right) / 2, (low + high) / 2];
  const put = ([x, y]) => [pen.width / 2 + scale * (x - cx), pen.height / 2 - scale * (y - cy)];
  const back = ([x, y]) => [cx + (x - pen.width / 2) / scale, cy - (y - pen.height / 2) / scale];
  return { scale, put, back };
}

function drawTake(pen, view, take, rank) {
  // Of two takes the first is a broad pale band, on which the second is seen.
  const [wide, pale] = rank < 0 ? [1, 1] : [LOOK.band, [LOOK.thin, 1]][rank];
  const [halo, mist] = LOOK.halo;
  for (const zoom of take.zooms) if (zoom.guide) drawChannel(pen, view, take, zoom);
  for (const line of take.lines) {
    if (!take.exists(line)) continue;
    let places = [];
    for (let i = 0; i < line.count; i++) {
      places.push(view.put(take.at(line.part(i), line.x(i), line.y(i))));
    }
    const alpha = pale * (LOOK.paleness[line.kind] || 1);
    if (line.kind === "spring") places = coil(places);
    if (line.kind === "ring") pen.fill(places, line.colour, 0.12 * pale);
    if (line.kind === "bar") pen.line(places, line.colour, halo * wide, mist * pale);
    pen.context.lineCap = line.kind === "guide" ? "butt" : "round";
    pen.line(places, line.colour, LOOK.widths[line.kind] * wide, alpha);
    if (line.kind === "link" && rank !== 0) drawNodes(pen, places, line.colour);
    if (line.kind === "bar" && line.count === 1) pen.dot(places[0], 5 * wide, line.colour);
  }
  for (const mark of take.data.marks) if (take.exists(mark)) drawMark(pen, view, take, mark);
}

function drawChannel(pen, view, take, { view: { part, x, y }, guide }) {
  const corner = (a, b) => view.put(take.at(part, x + a, y + b));
  const [l, c] = [guide.length, guide.clearance];
  pen.fill([corner(0, c), corner(l, c), corner(l, -c), corner(0, -c)], "#A9A9A9", 0.16);
}

function drawNodes(pen, places, colour) {
  const [first, second] = places;
  const apart = Math.hypot(second[0] - first[0], second[1] - first[1]);
  if (apart > 7) for (const place of places) pen.dot(place, 2.3, colour);
}

function coil([first, second]) {
  const [dx, dy] = [second[0] - first[0], second[1] - first[1]];
  const places = [first];
  for (let k = 0; k < 12; k++) {
    const along = 0.2 + (0.6 * k) / 11;
    const across = k % 2 ? -0.06 : 0.06;
    places.push([first[0] + along * dx - across * dy, first[1] + along * dy + across * dx]);
  }
  return [...places, second];
}

function drawMark(pen, view, take, mark) {
  const [x, y] = view.put(take.at(mark.part, mark.x, mark.y));
  const u = pen.thick;
  if (mark.kind === "revolute, on the ground") {
    const [w, h] = [7.5 * u, 11 * u];
    pen.line([[x - 1.5 * w, y + h], [x + 1.5 * w, y + h]], INK, 1.6);
    pen.fill([[x, y], [x - w, y + h], [x + w, y + h]], pen.paper);
    pen.line([[x, y], [x - w, y + h], [x + w, y + h]], INK, 1.6, 1, true);
    pen.dot([x, y], 3.6, pen.paper, INK);
  } else if (mark.kind === "weld, to the ground") {
    for (let k = -2; k <= 2; k++) pen.line([[x - 6 * u, y + 5 * u * k], [x, y + 5 * u * (k - 1)]], INK, 1.2);
    pen.line([[x, y - 14 * u], [x, y + 10 * u]], INK, 2.4);
  } else if (mark.kind.startsWith("weld") || mark.kind === "prismatic") {
    const s = (mark.kind === "prismatic" ? 5 : 3.2) * u;
    const square = [[x - s, y - s], [x + s, y - s], [x + s, y + s], [x - s, y + s]];
    pen.fill(square, mark.kind === "prismatic" ? pen.paper : INK);
    pen.line(square, INK, 1.6, 1, true);
  } else {
    pen.dot([x, y], mark.kind === "in a slot" ? 4.2 : 3.4, pen.paper, INK);
  }
}

// The whole path of S pale, and what it went last dark.
function drawTrail(pen, view, take, t, seconds, colour) {
  const whole = [];
  for (let i = 0; i < take.time.length; i++) {
    whole.push(view.put([take.trail[2 * i], take.trail[2 * i + 1]]));
  }
  pen.line(whole, PALE, 0.9, 0.35);
  const { part, x, y } = take.data.points.S;
  const begin = lastUpTo(take.time, t - seconds);
  let last = view.put(take.at(part, x, y));
  pen.context.lineCap = "butt"; // pale pieces must not lie on each other
  for (let i = take.index; i >= begin && i >= 0; i--) {
    const fresh = 1 - (t - take.time[i]) / seconds;
    if (fresh > 0) pen.line([last, whole[i]], colour, 1 + 1.6 * fresh, 0.15 + 0.75 * fresh);
    last = whole[i];
  }
  pen.context.lineCap = "round";
}

function drawPoints(pen, view, take) {
  const told = [];
  for (const [name, { part, x, y }] of Object.entries(take.data.points)) {
    const place = view.put(take.at(part, x, y));
    if (name === "S") pen.dot(place, 4.4, INK, pen.paper);
    const beside = told.find(([, other]) => Math.hypot(other[0] - place[0], other[1] - place[1]) < 14);
    if (beside) beside[0] += `, ${name}`;
    else told.push([name, place]);
    if (name === "O") {
      const [X, Y] = place;
      pen.line([[X - 4, Y], [X + 4, Y]], INK, 1);
      pen.line([[X, Y - 4], [X, Y + 4]], INK, 1);
    }
  }
  for (const [name, [x, y]] of told) pen.words(name, x, y - 14 * pen.thick, { align: "center", size: 12 });
}

// What touches now, or did a moment ago, of one contact or joint.
function touchesOf(own, player) {
  const { t, largest } = player;
  const now = player.secondsAt(t);
  const found = [];
  for (let k = 0; k < own.begin.length && own.begin[k] <= t; k++) {
    if (t - own.end[k] > LOOK.glow * player.speed) continue; // the film is nowhere faster
    const age = own.end[k] < t ? (now - player.secondsAt(own.end[k])) / LOOK.glow : -1;
    if (age >= 1) continue;
    const force = own.strength[k];
    const strength = Math.abs(force) / (force < 0 ? largest.impulse : largest.force) || 0;
    found.push({ k, force, strength, fresh: 1 - Math.max(age, 0), touching: age < 0 });
  }
  return found;
}

// Spots of a picture, in pixels, that numbers keep off: lines, marks, names of points.
function spotsOf(pen, view, take) {
  const below = (down) => ({ part, x, y }) => {
    const [X, Y] = view.put(take.at(part, x, y));
    return [X, Y + down * pen.thick];
  };
  const names = Object.values(take.data.points).map(below(-LOOK.nameUp));
  const spots = [...names, ...LOOK.markUp.flatMap((up) => take.data.marks.map(below(-up)))];
  const corners = take.zooms.filter((zoom) => zoom.guide).map(({ view: { part, x, y }, guide }) =>
    [1, -1].map((side) => [0, guide.length].map((a) => view.put(take.at(part, x + a, y + side * guide.clearance)))));
  const lines = take.lines.map((line) => {
    return Array.from({ length: line.count }, (_, i) => view.put(take.at(line.part(i), line.x(i), line.y(i))));
  });
  for (const line of [...lines, ...corners.flat()]) {
    for (let i = 0; i + 1 < line.length; i++) {
      const [[x, y], [X, Y]] = [line[i], line[i + 1]];
      const count = Math.ceil(Math.hypot(X - x, Y - y) / LOOK.spot);
      for (let k = 0; k <= count; k++) spots.push([x + ((X - x) * k) / count, y + ((Y - y) * k) / count]);
    }
  }
  return spots;
}

// Where beside a glow of a radius a number of a width hides the fewest spots: its middle.
// Names of points are above: numbers are below, of two runs those of the second alone.
function besideGlow(pen, [x, y], width, radius, way, spots) {
  const height = 18; // of letters, and a little room
  let [least, best] = [Infinity, null];
  for (const [farther, down] of LOOK.below.entries()) {
    for (const side of [1, -1, 0]) {
      const lower = down + (side ? 0 : radius);
      const middle = [x + side * (radius + LOOK.beside * pen.thick + width / 2), y + way * lower];
      const inside = middle[0] - width / 2 > 0 && middle[0] + width / 2 < pen.width;
      const hides = ([X, Y]) => Math.abs(X - middle[0]) < width / 2 && Math.abs(Y - middle[1]) < height / 2;
      const hidden = spots.filter(hides).length + farther + (inside ? 0 : spots.length);
      if (hidden < least) [least, best] = [hidden, middle];
    }
  }
  return best;
}

function drawTouches(pen, view, take, player, rank, touching = take.touching) {
  let spots = null;
  for (const own of touching) {
    const shown = touchesOf(own, player);
    // Of a burst of touches one is told in numbers.
    const most = Math.max(...shown.map((one) => one.strength * one.fresh));
    for (const one of shown) {
      const place = view.put(take.spot(own, one.k), take.endedAt(own, one.k));
      const radius = (5 + 17 * Math.sqrt(one.strength)) * pen.thick;
      drawGlow(pen, place, radius, one.fresh);
      const matters = own.places === null || one.strength > LOOK.labelled;
      if (!matters || one.force === 0 || one.strength * one.fresh < most) continue;
      const now = one.touching ? `${round(forceNow(take, own, one.k))} ${own.unit}` : `0 ${own.unit}, was ${round(one.force)} ${own.unit}`;
      const text = one.force < 0 ? `${round(-one.force)} ${own.unit} s` : now;
      const width = pen.widthOf(text, 13, true);
      spots = spots || spotsOf(pen, view, take);
      const way = rank === 0 && player.takes.length > 1 ? -1 : 1;
      const [x, y] = besideGlow(pen, place, width, radius, way, spots);
      pen.words(text, x, y, { colour: TOUCH, bold: true, size: 13, alpha: one.fresh, align: "center" });
      // Another number keeps off this one.
      for (let k = 0; k <= width; k += LOOK.spot) {
        for (const up of [-7, 0, 7]) spots.push([x - width / 2 + k, y + up]);
      }
    }
  }
}

function drawGlow(pen, [x, y], radius, fresh) {
  const c = pen.context;
  const glow = c.createRadialGradient(x, y, 0, x, y, radius);
  glow.addColorStop(0, `rgba(255, 120, 30, ${0.85 * fresh})`);
  glow.addColorStop(1, "rgba(255, 60, 20, 0)");
  c.fillStyle = glow;
  c.fillRect(x - radius, y - radius, 2 * radius, 2 * radius);
  c.beginPath();
  c.arc(x, y, radius * (1.25 - 0.6 * fresh), 0, 2 * Math.PI);
  c.globalAlpha = 0.8 * fresh;
  c.strokeStyle = TOUCH;
  c.lineWidth = 1.5 * pen.thick;
  c.stroke();
  c.globalAlpha = 1;
}

function forceNow(take, own, k) {
  const pair = own.which[k];
  const found = take.pressing(own).find(([one]) => own.places === null || one === pair);
  return found ? found[1] : 0;
}

function round(value) {
  if (value === 0) return "0";
  return value >= 1000 ? value.toFixed(0) : value.toPrecision(3);
}

// A length to read sizes by, in the corner at the lower left.
function drawScale(pen, view, unit) {
  const wanted = (0.16 * pen.width) / view.scale;
  const power = 10 ** Math.floor(Math.log10(wanted));
  const length = [5, 2, 1].map((step) => step * power).find((one) => one <= wanted) || power;
  const [x, y, w] = [12, pen.height - 12, length * view.scale];
  pen.line([[x, y - 4], [x, y], [x + w, y], [x + w, y - 4]], PALE, 1.2);
  const told = Number((length * unit.factor).toPrecision(3));
  pen.words(`${told} ${unit.name}`, x + w / 2, y - 10, { size: 11, colour: PALE, align: "center" });
}
