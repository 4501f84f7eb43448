// The link in a guide with clearance, as a zoom shows it: between walls, with their forces.

function drawWalls(pen, put, { length, clearance: c }) {
  pen.fill([put([0, c]), put([length, c]), put([length, -c]), put([0, -c])], "#A9A9A9", 0.14);
  for (const y of [c, -c]) pen.line([put([0, y]), put([length, y])], PALE, 3);
  pen.context.setLineDash([2, 5]);
  pen.line([put([0, 0]), put([length, 0])], PALE, 0.8);
  pen.context.setLineDash([]);
}

function drawLink(pen, view, take, { name, guide: { link, sides, length: walls } }, rank, largest) {
  const places = [];
  for (let i = 0; i < link.count; i++) {
    places.push(view.put(take.at(link.part(i), link.x(i), link.y(i))));
  }
  const colour = take.data.colour || "#0072B2";
  pen.line(places, colour, rank === 0 ? 6 : 2.4, rank === 0 ? 0.4 : 1);
  if (rank !== 0) for (const place of places) pen.dot(place, 2.6, colour);
  const own = take.touching.find((one) => one.name === name);
  for (const [pair, force] of take.pressing(own)) {
    const at = take.at(own.places.part(pair), own.places.x(pair), own.places.y(pair));
    const [x, y] = view.put(at);
    const [least, more] = LOOK.arrow;
    const length = (least + more * Math.sqrt(force / largest.force)) * pen.thick;
    const way = sides[pair] > 0 ? -1 : 1; // the upper wall presses down, from above
    pen.line([[x, y + way * length], [x, y]], TOUCH, 2.2);
    pen.fill([[x, y], [x - 4, y + way * 7], [x + 4, y + way * 7]], TOUCH);
    // Between its ends the guide keeps the link away from what is outside the walls.
    const right = take.from(view.frame, at)[0] < walls / 2;
    const off = Math.max(length, LOOK.offWall * pen.thick);
    pen.words(`${round(force)} N`, right ? x + 7 : x - 7, y + way * off, {
      colour: TOUCH, size: 12, bold: true, align: right ? "left" : "right",
    });
  }
}

function stateOf(take, { name, guide }, t) {
  const own = take.touching.find((one) => one.name === name);
  const sides = [];
  for (let k = 0; k < own.begin.length && own.begin[k] <= t; k++) {
    if (own.end[k] > t) sides.push(guide.sides[own.which[k]]);
  }
  if (sides.length === 0) return "free";
  if (sides.length === 1) return "one point";
  return new Set(sides).size > 1 ? "two points, opposite sides" : "two points, same side";
}
