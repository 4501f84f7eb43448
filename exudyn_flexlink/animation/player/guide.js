// The link in a guide with clearance, seen from the guide and drawn larger across than along.

function drawGuide(pen, takes, own, largest, t) {
  const [margin, top] = [12, 20];
  const whole = (1 + 2 * LOOK.beside) * own.length;
  const across = (pen.height - top) / (2 * LOOK.room * own.clearance);
  const along = Math.min((pen.width - 2 * margin) / whole, across);
  const middle = top + (pen.height - top) / 2;
  const left = (pen.width - along * whole) / 2;
  const put = ([x, y]) => [left + along * (x + LOOK.beside * own.length), middle - across * y];
  const c = own.clearance;
  pen.fill([put([0, c]), put([own.length, c]), put([own.length, -c]), put([0, -c])], "#A9A9A9", 0.14);
  for (const y of [c, -c]) pen.line([put([0, y]), put([own.length, y])], PALE, 3);
  pen.context.setLineDash([2, 5]);
  pen.line([put([0, 0]), put([own.length, 0])], PALE, 0.8);
  pen.context.setLineDash([]);
  pen.context.save();
  pen.context.beginPath();
  pen.context.rect(0, top - 4, pen.width, pen.height);
  pen.context.clip();
  takes.forEach((take, rank) => {
    const guide = take.guides.find((one) => one.name === own.name);
    if (guide) drawLink(pen, put, take, guide, takes.length > 1 ? rank : -1, largest);
  });
  pen.context.restore();
  const ratio = across / along;
  const larger = ratio > 1.05 ? `, ${ratio.toPrecision(2)} times larger across` : "";
  const where = takes.length > 1 ? "" : ` – ${stateOf(takes[0], own, t)}`;
  pen.words(`in ${own.name}${larger}${where}`, margin, 10, { size: 12, colour: PALE });
}

function drawLink(pen, put, take, guide, rank, largest) {
  const { link } = guide;
  const places = [];
  for (let i = 0; i < link.count; i++) {
    places.push(put(take.from(guide.guide, take.at(link.part(i), link.x(i), link.y(i)))));
  }
  const colour = take.data.colour || "#0072B2";
  pen.line(places, colour, rank === 0 ? 6 : 2.4, rank === 0 ? 0.4 : 1);
  if (rank !== 0) for (const place of places) pen.dot(place, 2.6, colour);
  const own = take.touching.find((one) => one.name === guide.name);
  for (const [pair, force] of take.pressing(own)) {
    const at = take.at(own.places.part(pair), own.places.x(pair), own.places.y(pair));
    const [x, y] = put(take.from(guide.guide, at));
    const [least, more] = LOOK.arrow;
    const length = (least + more * Math.sqrt(force / largest.force)) * pen.thick;
    const way = guide.sides[pair] > 0 ? -1 : 1; // the upper wall presses down, from above
    pen.line([[x, y + way * length], [x, y]], TOUCH, 2.2);
    pen.fill([[x, y], [x - 4, y + way * 7], [x + 4, y + way * 7]], TOUCH);
    const right = x < pen.width - 70;
    pen.words(`${round(force)} N`, right ? x + 7 : x - 7, y + way * length, {
      colour: TOUCH, size: 12, bold: true, align: right ? "left" : "right",
    });
  }
}

function stateOf(take, guide, t) {
  const own = take.touching.find((one) => one.name === guide.name);
  const sides = [];
  for (let k = 0; k < own.begin.length && own.begin[k] <= t; k++) {
    if (own.end[k] > t) sides.push(guide.sides[own.which[k]]);
  }
  if (sides.length === 0) return "free";
  if (sides.length === 1) return "one point";
  return new Set(sides).size > 1 ? "two points, opposite sides" : "two points, same side";
}
