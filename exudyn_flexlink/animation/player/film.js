// What the data say: rows of numbers, and every take of the film at an instant.

// Numbers that are packed as base64: {f4: text}, {f8: text} or {i4: text}, little-endian.
function numbers(row) {
  const types = { f4: Float32Array, f8: Float64Array, i4: Int32Array };
  const [kind] = Object.keys(row);
  const text = atob(row[kind]);
  const bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; i++) bytes[i] = text.charCodeAt(i);
  return new types[kind](bytes.buffer);
}

// Place of the last number of a growing row that is no larger than a value; 0 before the first.
function lastUpTo(row, value) {
  let low = 0;
  let high = row.length - 1;
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (row[middle] <= value) low = middle;
    else high = middle - 1;
  }
  return low;
}

// A line through points of parts: the part and the place of point i.
function readLine(data) {
  const places = numbers(data.places);
  const parts = typeof data.parts === "number" ? null : numbers(data.parts);
  return {
    ...data,
    count: places.length / 2,
    part: (i) => (parts === null ? data.parts : parts[i]),
    x: (i) => places[2 * i],
    y: (i) => places[2 * i + 1],
  };
}

function readTouching(data) {
  const rows = {};
  for (const name of ["begin", "end", "strength", "which", "first", "pair", "force"]) {
    rows[name] = numbers(data[name]);
  }
  return {
    ...data,
    ...rows,
    spots: data.spots === null ? null : numbers(data.spots),
    places: data.places === null ? null : readLine(data.places),
  };
}

// A zoom, seen from `view`; that of a guide with clearance has its walls and the link.
function readZoom(data) {
  return { ...data, guide: data.guide && { ...data.guide, link: readLine(data.guide.link) } };
}

class Take {
  constructor(data) {
    this.data = data;
    this.time = numbers(data.time);
    this.poses = numbers(data.poses);
    this.crank = data.crank === null ? null : numbers(data.crank);
    this.lines = data.lines.map(readLine);
    this.touching = data.touching.map(readTouching);
    this.zooms = data.zooms.map(readZoom);
    // x, y, cos and sin of every part now; the ground, part -1, is the last.
    this.now = new Float64Array(4 * (data.parts + 1));
    this.now[4 * data.parts + 2] = 1;
    this.trail = this.pathOf(data.points.S);
    this.seek(this.time[0]);
  }

  // Go to an instant, s: between two kept ones everything moves along straight lines.
  seek(t) {
    const i = Math.min(lastUpTo(this.time, t), this.time.length - 2);
    const span = this.time[i + 1] - this.time[i];
    this.instant = t;
    this.index = i;
    this.part = Math.min(Math.max((t - this.time[i]) / span, 0), 1);
    const width = 3 * this.data.parts;
    for (let k = 0; k < this.data.parts; k++) {
      const x = this.between(this.poses, width, 3 * k);
      const y = this.between(this.poses, width, 3 * k + 1);
      const angle = this.between(this.poses, width, 3 * k + 2);
      this.now.set([x, y, Math.cos(angle), Math.sin(angle)], 4 * k);
    }
  }

  // Whether a line or a mark is there now: its part may come, or go, with a stage of the run.
  exists({ spans }) {
    const since = (begin) => begin === null || begin <= this.instant;
    const until = (end) => end === null || this.instant < end;
    return spans.some(([begin, end]) => since(begin) && until(end));
  }

  // A number of a table, `width` numbers at every kept instant, now.
  between(table, width, column) {
    const first = table[this.index * width + column];
    return first + this.part * (table[(this.index + 1) * width + column] - first);
  }

  // Where a point of a part is now, m.
  at(part, x, y) {
    const k = 4 * (part < 0 ? this.data.parts : part);
    const [X, Y, c, s] = [this.now[k], this.now[k + 1], this.now[k + 2], this.now[k + 3]];
    return [X + c * x - s * y, Y + s * x + c * y];
  }

  // Seen from a point of a part, in axes turned by `angle`, m: now, or as it was at kept instant i.
  from({ part, x, y, angle }, [X, Y], i = null) {
    const [left, low, turned] = i === null ? this.poseNow(part) : this.poseAt(part, i);
    const [c, s] = [Math.cos(turned), Math.sin(turned)];
    const [dx, dy] = [X - left - c * x + s * y, Y - low - s * x - c * y];
    const [C, S] = [Math.cos(turned + angle), Math.sin(turned + angle)];
    return [C * dx + S * dy, C * dy - S * dx];
  }

  // x, y and angle of a part now, and at kept instant i.
  poseNow(part) {
    const k = 4 * (part < 0 ? this.data.parts : part);
    return [this.now[k], this.now[k + 1], Math.atan2(this.now[k + 3], this.now[k + 2])];
  }

  poseAt(part, i) {
    const k = 3 * (i * this.data.parts + part);
    return part < 0 ? [0, 0, 0] : this.poses.subarray(k, k + 3);
  }

  crankAngle() {
    return this.crank === null ? null : this.between(this.crank, 1, 0);
  }

  // Where a point of a part is at all kept instants, m.
  pathOf({ part, x, y }) {
    const path = new Float64Array(2 * this.time.length);
    for (let i = 0; i < this.time.length; i++) {
      const [X, Y, angle] = this.poseAt(part, i);
      path[2 * i] = X + Math.cos(angle) * x - Math.sin(angle) * y;
      path[2 * i + 1] = Y + Math.sin(angle) * x + Math.cos(angle) * y;
    }
    return path;
  }

  // Where touch number k of something that touches is, or was last, m.
  spot(own, k) {
    if (own.places !== null) {
      const pair = own.which[k];
      return this.at(own.places.part(pair), own.places.x(pair), own.places.y(pair));
    }
    const i = this.endedAt(own, k);
    if (i === null) return [this.between(own.spots, 2, 0), this.between(own.spots, 2, 1)];
    return [own.spots[2 * i], own.spots[2 * i + 1]];
  }

  // Kept instant at which touch number k of a contact was last; null: it is now, or in a joint.
  endedAt(own, k) {
    const ended = own.places === null && own.end[k] < this.time[this.index];
    return ended ? lastUpTo(this.time, own.end[k]) : null;
  }

  // Forces that press now, N: [pair, force] each.
  pressing(own) {
    const i = this.part < 0.5 ? this.index : this.index + 1;
    const found = [];
    for (let k = own.first[i]; k < own.first[i + 1]; k++) found.push([own.pair[k], own.force[k]]);
    return found;
  }
}
