// A scatter plot of two columns: the designs within the limits by name, their front in these two, what
// limits reject, and who wants which.

const MOST_SHAPES = 1000 // beyond that points are a density
const MOST_NAMES = 20
const FEW_NAMES = 8 // of designs that no other dominates, which may cover lines
const MOST_OBSTACLES = 300 // points from which names keep away
const CLEAR = [26, 10] // pixels beside and above a point that names of others keep
// The columns across and up.
const plotColumns = () => [0, 1].map((k) => columnOf(state.plot[k]) ?? data.numeric[k] ?? data.numeric[0])

const scatter = (() => {
  const section = $("scatter-plot")
  const [TOP, RIGHT, BOTTOM] = [22, 12, 40]
  let LEFT = 40
  let boxes = [] // of names
  let [lines, hatched] = [] // boxes along the front, and of what limits reject: no place for a name
  let columns = []
  let whole // for each column, the shares of its scale that are shown without a zoom
  let [zoom, centre] = [1, [0, 0]] // about what was proposed or looked at, as shares of the scales
  let scales = [] // of what is shown
  let numbers = [] // at the axes
  let [x, y] = [] // where a value is across and up
  let [u, v] = [] // where a row is
  let [isKnown, isInside] = [] // whether it has both values, and these are shown
  const area = section.querySelector(".plot")
  const selects = [...section.querySelectorAll("select")] // across, up
  selects.forEach((select, k) => {
    select.append(...data.numeric.map(({label}) => make("option", label)))
    select.onchange = () => {
      zoom = 1
      change({plot: namesOf(plotColumns()).with(k, data.numeric[select.selectedIndex].name)})
    }
  })
  const {size, clean, fit} = layers(area, 2)
  fit()
  whenResized(area, () => {
    fit()
    draw()
  })
  let [right, bottom] = [] // of the frame
  const boxOf = (x0, y0, x1, y1) => ({x: min(x0, x1), y: min(y0, y1), width: abs(x1 - x0), height: abs(y1 - y0)})

  // What is shown of a column: the designs within the limits and what is marked, with limits near them.
  function windowOf(column, k) {
    const {values} = column
    const [inside, share] = [0, Infinity].map((out) => shareOn(scaleOf(column), out))
    const rows = joined(shownRows, Int32Array.from(marked))
    let [from, until] = [1, -1].map((sign) => inside(endOf(values, sign, rows)))
    if (!(from <= until)) [from, until] = [0, 1]
    const room = [0.12, 0.2][k] * (until - from) || 0.5
    const [least, most] = numericLimit(column).map((end) => (end === null ? NaN : share(end)))
    return [min(from - room, least > from - 4 * room ? least - room : 1),
      max(until + room, most < until + 4 * room ? most + room : 0)]
  }

  // The window changes when a hand rests, not while it drags.
  function lay(g) {
    if (!whole || !dragging) whole = columns.map(windowOf)
    scales = columns.map((column, k) => {
      const scale = scaleOf(column)
      const [low, high] = whole[k].map((end) => valueAt(scale, centre[k] + (end - centre[k]) / zoom))
      return {...scale, low, high}
    })
    right = size.width - RIGHT
    bottom = size.height - BOTTOM
    numbers = scales.map((scale, k) => tickTexts(scale, max(2, k ? bottom / 45 : right / 80)))
    LEFT = ceil(max(24, ...numbers[1].map(({text}) => g.measureText(text).width + 10)))
    x = placing(scales[0], LEFT, right, 0)
    y = placing(scales[1], bottom, TOP, 0)
    const [xs, ys] = columns.map(({values}) => values)
    u = (row) => x(xs[row])
    v = (row) => y(ys[row])
    isKnown = (row) => xs[row] === xs[row] && ys[row] === ys[row]
    isInside = (row) => scales.every(({low, high}, k) => columns[k].values[row] >= low && columns[k].values[row] <= high)
  }

  function zoomBy(factor) {
    zoom = max(1, zoom * factor)
    centre = columns.map((column) => shareOn(scaleOf(column))(column.values[verdict?.row]) || 0)
    draw()
  }

  function drawAxes(g) {
    const [across, up] = numbers
    for (const {value, text} of across) drawText(g, text, x(value), bottom + 14, "center")
    for (const {value, text} of up) drawText(g, text, LEFT - 6, y(value), "right")
    const [name, nameUp] = columns.map((column) => [column.label, isObjective(column) && betterText(column)].filter(Boolean).join(", "))
    drawText(g, name, size.width, bottom + 32, "right")
    drawText(g, nameUp, 0, 7, "left")
    drawLine(g, INK.grid, LEFT, TOP, LEFT, bottom)
    drawLine(g, INK.grid, LEFT, bottom, right, bottom)
  }

  // Points as squares of a density.
  function countPoints(counts, line, rows, step) {
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

  // The designs within the limits that are best in these two.
  function frontOfTwo() {
    if (!columns.every(isObjective)) return []
    const [xs, ys] = columns.map((column) => data.F[data.objectives.indexOf(column)])
    let least = Infinity
    const front = []
    for (const row of argsort(xs, ranking.front)) {
      if (ys[row] >= least) continue
      front.push(row)
      least = ys[row]
    }
    return front
  }

  // Between two designs there is none: the front goes by the worse values of both.
  function drawFront(g, front) {
    g.beginPath()
    front.forEach((row, k) => {
      const [x0, y0, x1, y1] = [front[k - 1] ?? row, row].flatMap((one) => [u(one), v(one)])
      g.lineTo(x1, y0)
      g.lineTo(x1, y1)
      lines.push(boxOf(x0, y0, x1, y0), boxOf(x1, y0, x1, y1))
    })
    Object.assign(g, {strokeStyle: LOOKS.other.colour, lineWidth: 1})
    g.stroke()
  }

  // What limits reject is hatched.
  function drawLimits(g, column, k) {
    const {low, high} = scales[k]
    numericLimit(column).forEach((end, side) => {
      if (end === null || end < low || end > high) return
      const place = (k ? y : x)(end)
      const edge = (k ? [bottom, TOP] : [LEFT, right])[side]
      const box = k ? boxOf(LEFT, place, right, edge) : boxOf(place, TOP, edge, bottom)
      drawHatch(g, box.x, box.y, box.width, box.height)
      drawLine(g, INK.text, ...(k ? [LEFT, place, right, place] : [place, TOP, place, bottom]), 2)
      hatched.push(box)
    })
  }

  function drawPoints(g) {
    const rejected = data.n > MOST_SHAPES ? [] : picked(data.designs, (row) => !left.mask[row] && isInside(row))
    for (const row of rejected) drawShape(g, LOOKS.rejected, u(row), v(row))
    if (shownRows.length <= MOST_SHAPES) for (const row of picked(shownRows, isKnown)) {
      const look = LOOKS[ranking.pareto[row] ? "other" : "dominated"]
      drawShape(g, {...look, size: shownRows.length > 100 ? 2 : look.size}, u(row), v(row))
    }
    for (const {row, look} of marks) if (isKnown(row)) drawShape(g, LOOKS[look], u(row), v(row))
    return rejected
  }

  // Points beyond the window are at its edge.
  function explainMarks(front, rejected) {
    const known = picked(shownRows, isKnown)
    const beyond = known.length - picked(known, isInside).length
    const undrawn = data.n - known.length - rejected.length
    const reasons = [left.count > shownRows.length && "dominated", left.count + rejected.length < data.n && "beyond a limit",
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
  // a line of their own, points; and of all where they are few: then these may cover lines, else nothing.
  function drawNames(g, front, rejected) {
    const holders = Map.groupBy(latest(state.positions), ({chosen}) => rowOf(chosen))
    holders.delete(-1)
    const wanted = [...marked.toReversed(), ...picked([...holders.keys()], (row) => left.mask[row]), ...rowsOf(verdict?.steps ?? [])]
    const further = shownRows.length <= MOST_NAMES ? [...front, ...shownRows] : []
    const rows = unique([...wanted, ...further]).filter(isInside)
    const visible = joined(picked(shownRows, isKnown), rejected)
    const others = visible.length <= MOST_OBSTACLES ? visible : []
    const pointOf = (row) => ({row, u: u(row), v: v(row), x: u(row) - CLEAR[0], y: v(row) - CLEAR[1], width: 2 * CLEAR[0], height: 2 * CLEAR[1]})
    const isFew = ranking.front.length <= FEW_NAMES
    const names = rows.map((row) => ({
      point: pointOf(row),
      radius: LOOKS[marks.findLast((mark) => mark.row === row)?.look ?? look(row)].size,
      font: row === verdict?.row ? `650 ${FONT}` : FONT,
      texts: unique([[called(row), ...namesOf(holders.get(row) ?? [])].join(" · "), called(row)]),
      most: wanted.includes(row) ? UNPLACED : isFew ? 2 : 1,
      hatched: left.mask[row] ? hatched : [],
    }))
    const room = {points: unique([...rows, ...others]).map(pointOf), lines, left: LEFT, right: size.width, top: TOP - 8, bottom}
    boxes = placedNames(g, names, room, isFew ? 6 : 1)
    for (const {row, font, words, x, y, tie} of boxes) {
      g.font = font
      if (tie.length) drawLine(g, INK.muted, tie[0].x, tie[0].y, tie.at(-1).x, tie.at(-1).y)
      const colour = row === verdict?.row ? INK.accent : wanted.includes(row) ? INK.text : INK.muted
      words.forEach((line, k) => drawText(g, line, x, y + 14 * k + 7, "left", colour))
    }
    g.font = FONT
  }

  function draw() {
    columns = plotColumns()
    selects.forEach((select, k) => { select.selectedIndex = data.numeric.indexOf(columns[k]) })
    renew("relation", columns.every(isObjective) ? "trade off" : "are related")
    area.ariaLabel = `${columns[1].label} against ${columns[0].label}`
    if (!size.width) return
    const g = clean(0)
    lay(g)
    if (shownRows.length > MOST_SHAPES) drawDensity(g, JSON.stringify([scales, size, LEFT, state.plot]), shownRows, [0.5, 2000], countPoints)
    drawAxes(g) // a density covers all before
    ;[lines, hatched] = [[], []]
    const front = frontOfTwo()
    drawFront(g, front)
    columns.forEach((column, k) => drawLimits(g, column, k))
    const rejected = drawPoints(g)
    explainMarks(front, rejected)
    drawNames(g, front, rejected)
  }

  function mark(row) {
    const g = clean(1)
    if (row >= 0 && isInside(row)) drawShape(g, {shape: "ring", size: 10, colour: INK.accent}, u(row), v(row))
  }

  function rowAt(x, y) {
    return boxes.find((box) => !isFree({x, y, width: 0, height: 0}, [box]))?.row
      ?? nearestRow(9, (row) => hypot(u(row) - x, v(row) - y))
  }

  listenTo(area, rowAt)
  onClicks({nearer: () => zoomBy(1.6), farther: () => zoomBy(1 / 1.6)})
  return {draw, mark, spot: (row) => [u(row), v(row)], get names() { return boxes }}
})()
