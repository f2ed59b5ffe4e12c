// A scatter plot of two columns: the designs within the limits by name, their front in these two, what
// limits reject, and who wants which.

const MOST_SHAPES = 1000 // beyond that points are a density
const MOST_NAMES = 20
const FEW_NAMES = 8 // of designs that no other dominates, which may cover lines
const MOST_OBSTACLES = 300 // points from which names keep away
// The columns across and up.
const plotColumns = () => [0, 1].map((k) => columnOf(state.plot[k]) ?? data.numeric[k] ?? data.numeric[0])

// The shares of the scale of a column, the k-th, that are shown without a zoom: those of the designs within the
// limits and of what is marked, with limits near them.
function windowOf(column, k) {
  const {values} = column
  const [inside, share] = [0, Infinity].map((out) => shareOn(scaleOf(column), out))
  const rows = joined(shownRows, Int32Array.from(marked))
  let [from, until] = endsOf(values, rows).map(inside)
  if (!(from <= until)) [from, until] = [0, 1]
  const room = [0.12, 0.2][k] * (until - from) || 0.5
  const [least, most] = numericLimit(column).map((end) => (end === null ? NaN : share(end)))
  return [min(from - room, least > from - 4 * room ? least - room : 1),
    max(until + room, most < until + 4 * room ? most + room : 0)]
}

// Where the values of two columns are, in a frame that is as large as its numbers leave it.
//   columns, scales            those across and up, and what is shown of them
//   numbers                    at the axes
//   left, right, top, bottom   of the frame
//   x, y, u, v                 where a value is across and up, and where a row is
//   isKnown, isInside          whether a row has both values, and these are shown
//   known                      the rows shown that have both
function planeOf(g, columns, scales, {width, height}) {
  const top = 22
  const right = width - 12
  const bottom = height - 40
  const numbers = scales.map((scale, k) => tickTexts(scale, max(2, k ? bottom / 45 : right / 80)))
  const left = ceil(max(24, ...numbers[1].map(({text}) => g.measureText(text).width + 10)))
  const x = placing(scales[0], left, right, 0)
  const y = placing(scales[1], bottom, top, 0)
  const [xs, ys] = columns.map(({values}) => values)
  const u = (row) => x(xs[row])
  const v = (row) => y(ys[row])
  const isKnown = (row) => isNumber(u(row) + v(row))
  return {
    columns, scales, numbers, left, right, top, bottom, x, y, u, v, isKnown,
    isInside: (row) => scales.every(({low, high}, k) => columns[k].values[row] >= low && columns[k].values[row] <= high),
    known: picked(shownRows, isKnown),
  }
}

function drawFrame(g, {columns, numbers, left, right, top, bottom, x, y}) {
  const [across, up] = numbers
  for (const {value, text} of across) drawText(g, text, x(value), bottom + 14, "center")
  for (const {value, text} of up) drawText(g, text, left - 6, y(value), "right")
  const [name, nameUp] = columns.map((column) => [column.label, isObjective(column) && betterText(column)].filter(Boolean).join(", "))
  drawText(g, name, right + 12, bottom + 32, "right")
  drawText(g, nameUp, 0, 7, "left")
  drawLine(g, INK.grid, left, top, left, bottom)
  drawLine(g, INK.grid, left, bottom, right, bottom)
}

// Points as squares of a density.
const countPoints = ({u, v}) => (counts, line, rows, step) => {
  const ratio = devicePixelRatio
  const half = round((data.total > 5000 ? 1 : 1.5) * ratio)
  const width = 2 * half + 1
  for (const row of rows) {
    const first = round(v(row) * ratio - half) * line + round(u(row) * ratio - half)
    for (let at = first; at < first + width * line; at += line) {
      counts[at] += step
      counts[at + width] -= step
    }
  }
}

// The designs within the limits that are best in two columns.
function frontOfTwo(columns) {
  if (!columns.every(isObjective)) return []
  const [across, up] = columns.map((column) => data.objectives.indexOf(column))
  const ys = data.F[up]
  let least = Infinity
  const front = []
  for (const row of data.orders[across] ??= argsort(data.F[across], data.designs)) {
    if (!ranking.pareto[row] || ys[row] >= least) continue
    front.push(row)
    least = ys[row]
  }
  return front
}

// Between two designs there is none: the front goes by the worse values of both. Returns boxes along it.
function drawFront(g, {u, v}, front) {
  g.beginPath()
  const lines = []
  let x0, y0
  for (const row of front) {
    const x1 = u(row)
    const y1 = v(row)
    if (hypot(x1 - x0, y1 - y0) < 0.5) continue // a step that nobody sees
    g.lineTo(x1, y0 ?? y1)
    g.lineTo(x1, y1)
    if (y0 !== undefined) lines.push(boxOf(x0, y0, x1, y0), boxOf(x1, y0, x1, y1))
    x0 = x1
    y0 = y1
  }
  g.strokeStyle = LOOKS.other.colour
  g.lineWidth = 1
  g.stroke()
  return lines
}

// What limits reject is hatched. Returns the boxes.
function drawLimits(g, {columns, scales, left, right, top, bottom, x, y}) {
  return columns.flatMap((column, k) => numericLimit(column).flatMap((end, side) => {
    if (end === null || end < scales[k].low || end > scales[k].high) return []
    const place = (k ? y : x)(end)
    const edge = (k ? [bottom, top] : [left, right])[side]
    const box = k ? boxOf(left, place, right, edge) : boxOf(place, top, edge, bottom)
    drawHatch(g, box)
    drawLine(g, INK.text, ...(k ? [left, place, right, place] : [place, top, place, bottom]), 2)
    return box
  }))
}

// Returns the rows that limits reject and that are drawn.
function drawPoints(g, {u, v, known, isKnown, isInside}) {
  const rejected = data.n > MOST_SHAPES ? [] : picked(data.designs, (row) => !kept.mask[row] && isInside(row))
  for (const row of rejected) drawShape(g, LOOKS.rejected, u(row), v(row))
  if (shownRows.length <= MOST_SHAPES) for (const row of known) {
    const look = LOOKS[ranking.pareto[row] ? "other" : "dominated"]
    drawShape(g, {...look, size: shownRows.length > 100 ? 2 : look.size}, u(row), v(row))
  }
  for (const {row, look} of marks) if (isKnown(row)) drawShape(g, LOOKS[look], u(row), v(row))
  return rejected
}

// Points beyond the window are at its edge.
function explainMarks({columns, known, isInside}, front, rejected) {
  const beyond = known.length - picked(known, isInside).length
  const undrawn = data.n - known.length - rejected.length
  const reasons = [kept.count > shownRows.length && "dominated", kept.count + rejected.length < data.n && "beyond a limit",
    shownRows.length > known.length && "without a value"]
  const hasDominated = shownRows.length > ranking.front.length
  const isHatched = columns.some(limitOf)
  const {colour} = LOOKS.other
  const isDensity = shownRows.length > MOST_SHAPES
  legend("key", [
    ...legendOfMarks(),
    isDensity ? [swatch("area", colour), `designs${DENSITY}`] : [icon(LOOKS.other), "dominated by no other", true],
    hasDominated && !isDensity && [icon(LOOKS.dominated), "dominated"],
    front.length > 1 && [swatch("step", colour), "best trade-offs of the two"],
    (isHatched || rejected.length) && [[isHatched && swatch("hatch", INK.text), rejected.length && icon(LOOKS.rejected)], "beyond a limit"],
    undrawn && [[], `${counted(undrawn, "design")} not drawn: ${listed(reasons.filter(Boolean), "or")}`],
    beyond && [[], `${exact(beyond)} at the edge, outside of the axes`],
  ])
}

// Names of what is marked, of what people want and of steps from what is proposed, which may cover lines and, with
// a line of their own, points; and of all where they are few: then these may cover lines, else nothing. Returns
// their boxes.
function drawNames(g, plane, front, rejected, {lines, hatched}) {
  const {u, v, known, isInside} = plane
  const holders = Map.groupBy(latest(state.positions), ({chosen}) => rowOf(chosen))
  holders.delete(-1)
  const wanted = [...marked.toReversed(), ...picked([...holders.keys()], (row) => kept.mask[row]), ...rowsOf(verdict?.steps ?? [])]
  const further = shownRows.length <= MOST_NAMES ? [...front, ...shownRows] : []
  const rows = unique([...wanted, ...further]).filter(isInside)
  const visible = joined(known, rejected)
  const others = visible.length <= MOST_OBSTACLES ? visible : []
  // With the pixels around it that names of others keep clear.
  const pointOf = (row) => ({row, u: u(row), v: v(row), x: u(row) - 26, y: v(row) - 10, width: 52, height: 20})
  const isFew = ranking.front.length <= FEW_NAMES
  const names = rows.map((row) => ({
    point: pointOf(row),
    radius: LOOKS[marks.findLast((mark) => mark.row === row)?.look ?? look(row)].size,
    font: row === verdict?.row ? `650 ${FONT}` : FONT,
    texts: unique([[called(row), ...namesOf(holders.get(row) ?? [])].join(" · "), called(row)]),
    most: wanted.includes(row) ? UNPLACED : isFew ? 2 : 1,
    hatched: kept.mask[row] ? hatched : [],
  }))
  const room = {...plane, points: unique([...rows, ...others]).map(pointOf), lines, right: plane.right + 12, top: plane.top - 8}
  const boxes = placedNames(g, names, room, isFew ? 6 : 1)
  for (const {row, font, words, x, y, tie} of boxes) {
    g.font = font
    if (tie.length) drawLine(g, INK.muted, tie[0].x, tie[0].y, tie.at(-1).x, tie.at(-1).y)
    const colour = row === verdict?.row ? INK.accent : wanted.includes(row) ? INK.text : INK.muted
    words.forEach((line, k) => drawText(g, line, x, y + 14 * k + 7, "left", colour))
  }
  g.font = FONT
  return boxes
}

const scatter = (() => {
  const section = $("scatter-plot")
  const area = section.querySelector(".plot")
  let whole // for each column, what is shown without a zoom
  let zoom = 1
  let centre = [0, 0] // what was proposed or looked at, as shares of the scales
  let plane
  let boxes = [] // of names
  const selects = [...section.querySelectorAll("select")] // across, up
  selects.forEach((select, k) => {
    select.append(...data.numeric.map(({label}) => make("option", label)))
    select.onchange = () => {
      zoom = 1
      const plot = namesOf(plotColumns())
      const {name} = data.numeric[select.selectedIndex]
      change({plot: plot.includes(name) ? plot.toReversed() : plot.with(k, name)}) // no column against itself
    }
  })
  const {size, clean, fit} = layers(area, 2)
  fit()
  whenResized(area, () => {
    fit()
    draw()
  })

  function zoomBy(factor) {
    zoom = max(1, zoom * factor)
    centre = plotColumns().map((column) => shareOn(scaleOf(column))(column.values[verdict?.row]) || 0)
    draw()
  }

  function draw() {
    const columns = plotColumns()
    selects.forEach((select, k) => { select.selectedIndex = data.numeric.indexOf(columns[k]) })
    renew("relation", columns.every(isObjective) ? "trade off" : "are related")
    area.ariaLabel = `${columns[1].label} against ${columns[0].label}`
    if (!size.width) return
    const g = clean(0)
    if (!whole || !dragging) whole = columns.map(windowOf) // the window changes when a hand rests
    const scales = columns.map((column, k) => {
      const scale = scaleOf(column)
      const [low, high] = whole[k].map((end) => valueAt(scale, centre[k] + (end - centre[k]) / zoom))
      return {...scale, low, high}
    })
    plane = planeOf(g, columns, scales, size)
    if (shownRows.length > MOST_SHAPES) drawDensity(g, JSON.stringify([scales, size, plane.left, state.plot]), shownRows, [0.5, 2000], countPoints(plane))
    drawFrame(g, plane) // a density covers all before
    const front = frontOfTwo(columns)
    const lines = drawFront(g, plane, front)
    const hatched = drawLimits(g, plane)
    const rejected = drawPoints(g, plane)
    explainMarks(plane, front, rejected)
    boxes = drawNames(g, plane, front, rejected, {lines, hatched})
  }

  function mark(row) {
    const g = clean(1)
    if (row >= 0 && plane.isInside(row)) drawShape(g, {shape: "ring", size: 10, colour: INK.accent}, plane.u(row), plane.v(row))
  }

  function rowAt(x, y) {
    return boxes.find((box) => !isFree({x, y, width: 0, height: 0}, [box]))?.row
      ?? nearestRow(9, (row) => hypot(plane.u(row) - x, plane.v(row) - y))
  }

  listenTo(area, rowAt)
  onClicks({nearer: () => zoomBy(1.6), farther: () => zoomBy(1 / 1.6)})
  return {draw, mark, spot: (row) => [plane.u(row), plane.v(row)], get names() { return boxes }}
})()
