// A zoom below the picture: a guide with clearance, or a face that is struck, drawn larger.

function drawZoom(pen, player, name) {
  const { takes } = player;
  const own = takes.flatMap((take) => take.zooms).find((zoom) => zoom.name === name);
  const { put, scale, ratio } = fitZoom(pen, own);
  if (own.guide) drawWalls(pen, put, own.guide);
  pen.context.save();
  pen.context.beginPath();
  pen.context.rect(0, 16, pen.width, pen.height);
  pen.context.clip();
  takes.forEach((take, rank) => {
    const zoom = take.zooms.find((one) => one.name === name);
    if (!zoom) return;
    const view = { scale, frame: zoom.view, put: (place, i) => put(take.from(zoom.view, place, i)) };
    const which = takes.length > 1 ? rank : -1;
    if (zoom.guide) drawLink(pen, view, take, zoom, which, player.largest);
    else drawStrike(pen, view, take, name, which, player);
  });
  pen.context.restore();
  pen.words(own.words + larger(player, own, scale, ratio) + state(player, own, pen, scale), 12, 10, { size: 12, colour: PALE });
}

// How metres of a zoom become pixels. A guide is larger across than along where there is room, a
// face never, or angles would be wrong.
function fitZoom(pen, { along: [begin, end], across: [low, high], guide }) {
  const [margin, top] = [12, 20];
  const most = (pen.height - top) / (high - low);
  const scale = Math.min((pen.width - 2 * margin) / (end - begin), most);
  const across = guide ? most : scale;
  const put = ([x, y]) => [
    pen.width / 2 + scale * (x - (begin + end) / 2),
    top + (pen.height - top) / 2 - across * (y - (low + high) / 2),
  ];
  return { put, scale, ratio: across / scale };
}

function larger(player, { guide }, scale, ratio) {
  if (guide) return ratio > 1.05 ? `, ${ratio.toPrecision(2)} times larger across` : "";
  const picture = viewOf(player.pens[0], player.data.box, 1, null).scale;
  return `, ${Number((scale / picture).toPrecision(2))} times larger`;
}

function state({ takes, t, data }, own, pen, scale) {
  if (takes.length > 1) return "";
  return own.guide ? ` – ${stateOf(takes[0], own, t)}` : away(takes[0], own, data.unit, [pen.width / 2 / scale, (pen.height - 20) / 2 / scale]);
}

// How far off the point that may strike is, as long as it is outside the zoom on a face.
// `half` of what is shown, along and across, m.
function away(take, { view, along, across, point }, { factor, name }, half) {
  const place = take.from(view, take.at(point.part, point.x, point.y));
  const off = [along, across].map(([low, high], i) => Math.abs(place[i] - (low + high) / 2) - half[i]);
  const size = Math.hypot(...off.map((one) => Math.max(one, 0)));
  return size > 0 ? ` – ${point.name} is ${Number((factor * size).toPrecision(3))} ${name} away` : "";
}

function drawStrike(pen, view, take, name, rank, player) {
  drawTake(pen, view, take, rank);
  drawTouches(pen, view, take, player, rank, take.touching.filter((own) => own.name === name));
  if (rank <= 0) drawPoints(pen, view, take);
}
