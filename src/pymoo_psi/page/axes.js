// What is drawn on the axes of the rows: all designs as ticks, what limits reject, the range of the
// per cent as the thick part, the designs within the limits as lines from row to row, and marks.
//
// There are three layers: the axes with all designs, what is left with its marks, and the design under
// the pointer. The first is drawn anew when an axis changes, the second at every step of a slider.

const MOST_LINES = 150 // beyond that lines are a density
const MOST_TICKS = 1000
const INSET = 6 // of an axis, half a handle
const axes = (() => {
  const plot = make("div.plot")
  $("rows-area").append(plot)
  let [columns, places] = [[], []]
  const former = new Map() // densities
  const formerTicks = new Map()
  const {size, clean, fit} = layers(plot, 3, () => draw(true))

  // Where the axes are; asking for it makes the browser lay out the page.
  function measure() {
    columns = columnsShown ??= shownColumns()
    if (!columns.length) return
    // The axes below are as wide as those of objectives.
    $("further").style.setProperty("--columns", getComputedStyle($("objectives")).gridTemplateColumns)
    const area = $("rows-area").getBoundingClientRect()
    const boxes = columns.map((column) => controls.get(column).axis.getBoundingClientRect())
    places = boxes.map((box) => (box.top + box.bottom) / 2 - area.top)
    Object.assign(plot.style, {left: `${boxes[0].left - area.left}px`, width: `${boxes[0].width}px`, height: `${area.height}px`})
    fit()
  }

  function placed(column) {
    const share = shareOn(scaleOf(column))
    const length = size.width - 2 * INSET
    return isTurned(column) ? (value) => INSET + (1 - share(value)) * length : (value) => INSET + share(value) * length
  }
  // Rows that stand one above the other at a distance, on a narrow screen, have no lines.
  const isJoined = (j) => j + 1 < columns.length && places[j + 1] - places[j] < 110

  // Single lines, drawn by the browser.
  function lines(g, rows, style) {
    const at = columns.map((column) => [valuesOf(ranking, column), placed(column)])
    for (const row of rows) {
      Object.assign(g, style)
      g.beginPath()
      at.forEach(([values, xOf], j) => {
        if (!isJoined(j)) return
        const [next, nextOf] = at[j + 1]
        if (values[row] !== values[row] || next[row] !== next[row]) return
        g.moveTo(xOf(values[row]), places[j])
        g.lineTo(nextOf(next[row]), places[j + 1])
      })
      g.stroke()
    }
    g.globalAlpha = 1
  }

  function countLines(counts, rows, step) {
    const line = round(size.width * devicePixelRatio) + 1
    for (let j = 0; j + 1 < columns.length; j++) {
      if (!isJoined(j)) continue
      const [y0, y1] = [places[j], places[j + 1]].map((y) => round(y * devicePixelRatio))
      const [[upper, from], [lower, to]] = [j, j + 1].map((k) => [valuesOf(ranking, columns[k]), placed(columns[k])])
      for (let i = 0; i < rows.length; i++) {
        const row = rows[i]
        if (upper[row] !== upper[row] || lower[row] !== lower[row]) continue
        // Half a pixel on, so that cutting the fraction off rounds.
        let x = from(upper[row]) * devicePixelRatio + 0.5
        const slope = (to(lower[row]) * devicePixelRatio + 0.5 - x) / (y1 - y0)
        let at = x | 0
        for (let y = y0; y < y1; y++) {
          x += slope
          const next = x | 0
          counts[y * line + (at < next ? at : next)] += step
          counts[y * line + (at < next ? next : at) + 1] -= step
          at = next
        }
      }
    }
  }

  // Every design is a tick on every axis.
  function countTicks(counts, rows, step) {
    const line = round(size.width * devicePixelRatio) + 1
    const [half, thick] = [4 * devicePixelRatio, max(1, round(1.4 * devicePixelRatio))]
    columns.forEach((column, j) => {
      const [values, xOf] = [valuesOf(ranking, column), placed(column)]
      const [y0, y1] = [-half, half].map((d) => round(places[j] * devicePixelRatio + d))
      for (let k = 0; k < rows.length; k++) {
        const x = round(xOf(values[rows[k]]) * devicePixelRatio)
        if (x !== x) continue
        for (let y = y0; y < y1; y++) {
          counts[y * line + x] += step
          counts[y * line + x + thick] -= step
        }
      }
    })
  }

  function drawAxes() {
    const g = clean(0)
    formerTicks.clear()
    drawDensity(g, [[INK.context, data.designs]], data.total, [data.n > MOST_TICKS ? 0.3 : 0.9, 500], countTicks, formerTicks)
    g.setLineDash([3, 3])
    for (const y of places) drawLine(g, INK.context, INSET, y, size.width - INSET, y)
    g.setLineDash([])
  }

  function drawLeft() {
    const g = clean(1)
    const rows = shownRows
    if (rows.length > MOST_LINES) drawDensity(g, byColour(hues, rows), data.total, [0.2, 120], countLines, former)
    else for (const [colour, some] of byColour(hues, rows)) lines(g, some, {strokeStyle: colour, globalAlpha: rows.length > 40 ? 0.5 : 0.75, lineWidth: 1})
    columns.forEach((column, j) => drawAxis(g, column, places[j], rows))
    for (const {row, look} of marks) {
      if (look === "inspected") g.setLineDash([9, 3])
      if (look === "pinned" || look === "prototype") g.setLineDash([3, 3])
      lines(g, [row], {strokeStyle: LOOKS[look].colour, lineWidth: row === verdict?.row ? 2.6 : 1.6})
      g.setLineDash([])
    }
    columns.forEach((column, j) => drawMarks(g, column, places[j]))
  }

  // What is rejected, the range of the per cent, and the ticks of what is left where these are few.
  function drawAxis(g, column, y, rows) {
    const [xOf, values] = [placed(column), valuesOf(ranking, column)]
    const limit = limitOf(column) ?? [null, null]
    limit.forEach((end, k) => {
      if (end === null) return
      const [x, edge] = [xOf(end), isTurned(column) === Boolean(k) ? 0 : size.width]
      drawHatch(g, min(x, edge), y - 18, abs(x - edge), 36)
      drawLine(g, INK.text, x, y - 19, x, y + 19, 3)
    })
    if (isObjective(column) && ranking.count) {
      const j = data.objectives.indexOf(column)
      const ends = [ranking.ideal[j], ranking.nadir[j]].map(xOf)
      drawLine(g, INK.muted, ends[0], y, ends[1], y, 2)
    }
    if (rows.length <= MOST_LINES) for (const row of rows) {
      const x = xOf(values[row])
      drawLine(g, LOOKS.other.colour, x, y - 5, x, y + 5, 1.5)
    }
  }

  // The marks on an axis, and below it the ends of the per cent, where they cover no mark.
  function drawMarks(g, column, y) {
    const [xOf, values] = [placed(column), valuesOf(ranking, column)]
    const scale = scaleOf(column)
    const ends = isObjective(column) && ranking.count
      ? [ranking.nadir, ranking.ideal].map((point) => point[data.objectives.indexOf(column)])
      : isTurned(column) ? [scale.high, scale.low] : [scale.low, scale.high]
    const [a, b] = ends.map((end) => valueText(column, end))
    const [from, to] = ends.map(xOf)
    const [first, second] = [g.measureText(a).width, g.measureText(b).width]
    const room = max(0, min(from, to - second - first - 8))
    drawText(g, a, min(room, size.width - first - second - 8), y + 18, "left")
    if (a !== b) drawText(g, b, max(min(room, size.width - first - second - 8) + first + 8, min(to - second, size.width - second)), y + 18, "left")
    let [below, above] = [0, 0]
    for (const row of shownRows) {
      if (values[row] < scale.low) below++
      else if (values[row] > scale.high) above++
    }
    const [left, right] = isTurned(column) ? [above, below] : [below, above]
    if (left) drawText(g, `◂ ${left}`, 0, y - 14, "left", INK.accent)
    if (right) drawText(g, `${right} ▸`, size.width, y - 14, "right", INK.accent)
    const error = errorOf(column)
    for (const {row, look} of marks) {
      const value = values[row]
      if (value !== value) continue
      if (error) {
        const [low, high] = [-1, 1].map((sign) => xOf(value + sign * error.values[row]))
        drawLine(g, LOOKS[look].colour, low, y, high, y, 4)
      }
      drawShape(g, LOOKS[look], xOf(value), y)
    }
  }

  function draw(all) {
    if (all || !columnsShown) {
      measure()
      former.clear()
      if (size.width && columns.length) drawAxes()
    }
    if (!size.width || !columns.length) return void (clean(0), clean(1))
    drawLeft()
    mark(hoveredRow)
  }

  function mark(row) {
    const g = clean(2)
    if (row >= 0) lines(g, [row], {strokeStyle: INK.text, lineWidth: 2.5})
  }

  // The row whose line or tick passes nearest to a point, within a few pixels.
  function rowAt(x, y) {
    const at = columns.map((column) => [valuesOf(ranking, column), placed(column)])
    const j = max(0, places.findLastIndex((place) => place <= y))
    if (abs(places[j] - y) < 9 || !isJoined(j)) return nearestRow(7, (row) => abs(at[j][1](at[j][0][row]) - x))
    const share = (y - places[j]) / (places[j + 1] - places[j])
    return nearestRow(7, (row) => {
      const [a, b] = [at[j], at[j + 1]].map(([values, xOf]) => xOf(values[row]))
      return abs(a + (b - a) * share - x)
    })
  }

  // A drag along an axis sets its limits; a click inspects.
  function listen(column) {
    const {axis} = controls.get(column)
    const place = (x, y) => [x, y + places[columns.indexOf(column)] - axis.clientHeight / 2]
    const shareAt = (x) => {
      const share = min(1, max(0, (x - INSET) / (size.width - 2 * INSET)))
      return isTurned(column) ? 1 - share : share
    }
    listenTo(axis, (x, y) => rowAt(...place(x, y)), (x, _, u) => [[column, between(column, scaleOf(column), shareAt(x), shareAt(u))]])
  }
  for (const {column, axis} of controls.values()) if (axis) listen(column)
  new ResizeObserver(() => {
    columnsShown = null
    if (verdict !== undefined) draw(true)
  }).observe($("rows-area"))
  return {draw, mark, get inView() { return size.inView }, get drawn() { return shownRows.length },
    spot: (row, name) => { const column = data.by.get(name); return [placed(column)(column.values[row]), places[columns.indexOf(column)]] }}
})()
