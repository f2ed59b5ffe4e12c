// What is drawn on the axes of the rows: all designs as ticks, what limits reject, the range of the
// per cent as the thick part, the designs within the limits as lines from row to row, and marks.
//
// There are three layers: the axes with all designs, what is left with its marks, and the design under
// the pointer. The first is drawn anew when an axis changes, the second at every step of a slider.

const MOST_LINES = 150 // beyond that lines are a density
const MOST_TICKS = 1000
const INSET = 9 // of an axis, as large as a mark
const axes = (() => {
  const plot = make("div.plot")
  $("rows-area").append(plot)
  let shown = [] // the axes, top down
  let heights = []
  let lanes = [] // {column, y, values, x}: what is drawn on each, with the place of a value
  let gaps = [] // neighbouring lanes, which lines join
  const {size, clean, fit} = layers(plot, 3)
  const edgesOf = (column) => isTurned(column) ? [size.width - INSET, INSET] : [INSET, size.width - INSET]

  // Where the axes are; asking for it makes the browser lay out the page.
  function measure() {
    shown = [...document.querySelectorAll(".axis")].filter((axis) => axis.checkVisibility())
    if (!shown.length) return
    // The axes below are as wide as those of objectives.
    $("further").style.setProperty("--columns", getComputedStyle($("objectives")).gridTemplateColumns)
    const area = $("rows-area").getBoundingClientRect()
    const boxes = shown.map((axis) => axis.getBoundingClientRect())
    heights = boxes.map((box) => round((box.top + box.bottom) / 2 - area.top)) // so that lines are equally sharp
    Object.assign(plot.style, {left: `${boxes[0].left - area.left}px`, width: `${boxes[0].width}px`, height: `${area.height}px`})
    fit()
  }

  function lay() {
    lanes = shown.map(({column}, j) => (
      {column, y: heights[j], values: column.values, x: placing(scaleOf(column), ...edgesOf(column))}))
    // Rows that stand one above the other at a distance, on a narrow screen, have no lines.
    gaps = lanes.slice(1).map((lane, j) => [lanes[j], lane]).filter(([upper, lower]) => lower.y - upper.y < 80)
  }

  // Single lines, drawn by the browser.
  function lines(g, rows, style) {
    Object.assign(g, style)
    for (const row of rows) {
      g.beginPath()
      for (const [upper, lower] of gaps) {
        const [from, to] = [upper, lower].map(({values, x}) => x(values[row]))
        if (from !== from || to !== to) continue
        g.moveTo(from, upper.y)
        g.lineTo(to, lower.y)
      }
      g.stroke()
    }
    g.globalAlpha = 1
  }

  function countLines(counts, line, rows, step) {
    const ratio = devicePixelRatio // asking for it takes long
    for (const [upper, lower] of gaps) {
      const [y0, y1] = [upper.y, lower.y].map((y) => round(y * ratio))
      for (const row of rows) {
        // Half a pixel on, so that cutting the fraction off rounds.
        let x = upper.x(upper.values[row]) * ratio + 0.5
        const slope = (lower.x(lower.values[row]) * ratio + 0.5 - x) / (y1 - y0)
        if (slope !== slope) continue
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

  function drawAxes() {
    const g = clean(0)
    for (const {values, x, y} of data.n > MOST_TICKS ? [] : lanes) {
      for (const row of data.designs) drawLine(g, INK.context, x(values[row]), y - 4, x(values[row]), y + 4, 1.4)
    }
    g.setLineDash([3, 3])
    for (const {y} of lanes) drawLine(g, INK.context, INSET, y, size.width - INSET, y)
    g.setLineDash([])
  }

  function drawLeft() {
    const g = clean(1)
    const isFew = shownRows.length <= MOST_LINES
    const {colour} = LOOKS.other
    if (!isFew) drawDensity(g, JSON.stringify([size, lanes.map(({column, y}) => [column.name, y, scaleOf(column)])]), shownRows, [0.2, 120], countLines)
    else lines(g, shownRows, {strokeStyle: colour, globalAlpha: 0.5, lineWidth: 1})
    for (const lane of lanes) drawRange(g, lane, isFew || !gaps.length ? shownRows : [])
    for (const {row, look} of marks) {
      g.setLineDash(LOOKS[look].dashes ?? [])
      lines(g, [row], {strokeStyle: LOOKS[look].colour, lineWidth: row === verdict?.row ? 2.6 : 1.6})
    }
    g.setLineDash([])
    for (const lane of lanes) {
      drawBeyond(g, lane)
      drawMarks(g, lane)
    }
    explainLeft(isFew)
  }

  function explainLeft(isFew) {
    const {colour} = LOOKS.other
    const text = `${exact(shownRows.length)} designs${state.dominated ? within() : " that no other dominates"}`
    legend("foot", shownRows.length < 2 ? [] : [
      ...legendOfMarks(),
      isFew || !gaps.length ? [swatch("tick", colour), text] : [swatch("area", colour), `${text}${DENSITY}`],
      shownRows.length < data.n && data.n <= MOST_TICKS && [swatch("tick", INK.context), "other designs"],
      lanes.some(({column}) => limitOf(column)) && [swatch("hatch", INK.text), "beyond a limit"],
      [swatch("span", INK.muted), state.fixed ? "the fixed range: 100 %" : "their worst to best value, 100 % to 0 % behind"],
    ])
  }

  // What is rejected, the range of the per cent, and ticks of designs.
  function drawRange(g, {column, values, x, y}, rows) {
    numericLimit(column).forEach((end, k) => {
      if (end === null) return
      const place = x(end)
      const edge = isTurned(column) === Boolean(k) ? 0 : size.width
      drawHatch(g, boxOf(place, y - 12, edge, y + 12))
      drawLine(g, INK.text, place, y - 12, place, y + 12, 3)
    })
    const j = data.objectives.indexOf(column)
    if (j >= 0 && ranking.count) drawLine(g, INK.muted, x(ranking.nadir[j]), y, x(ranking.ideal[j]), y, 2)
    // Where there are no lines these are all the designs: no more than pixels are drawn.
    const places = new Set(Array.from(rows, (row) => round(2 * x(values[row])) / 2))
    for (const place of places) drawLine(g, LOOKS.other.colour, place, y - 5, place, y + 5, 1.5)
  }

  // How many designs lie beyond the ends of an axis.
  function drawBeyond(g, {column, values, y}) {
    const {low, high} = scaleOf(column)
    let below = 0
    let above = 0
    for (const row of shownRows) {
      if (values[row] < low) below++
      else if (values[row] > high) above++
    }
    const [left, right] = isTurned(column) ? [above, below] : [below, above]
    if (left) drawText(g, `◂ ${left}`, 0, y - 14, "left", INK.accent)
    if (right) drawText(g, `${right} ▸`, size.width, y - 14, "right", INK.accent)
  }

  function drawMarks(g, {column, values, x, y}) {
    const error = errorOf(column)
    for (const {row, look} of marks) {
      const value = values[row]
      if (value !== value) continue
      const [low, high] = [-1, 1].map((sign) => x(value + sign * error?.values[row]))
      if (error) drawLine(g, LOOKS[look].colour, low, y, high, y, 4)
      drawShape(g, LOOKS[look], x(value), y)
    }
  }

  function draw(all) {
    if (all) measure()
    if (!size.width || !shown.length) return void (clean(0), clean(1))
    lay()
    if (all) drawAxes()
    drawLeft()
    mark(hoveredRow)
  }

  function mark(row) {
    const g = clean(2)
    if (row >= 0) lines(g, [row], {strokeStyle: INK.text, lineWidth: 2.5})
  }

  // The row whose line or tick passes nearest to a point, within a few pixels.
  function rowAt(u, v) {
    const gap = gaps.find(([upper, lower]) => v > upper.y + 9 && v < lower.y)
    const lane = lanes.findLast(({y}) => y <= v + 9) ?? lanes[0]
    const [upper, lower] = gap ?? [lane, lane]
    const share = gap ? (v - upper.y) / (lower.y - upper.y) : 0
    return nearestRow(7, (row) => {
      const [from, to] = [upper, lower].map(({values, x}) => x(values[row]))
      return abs(from + (to - from) * share - u)
    })
  }

  for (const axis of document.querySelectorAll(".axis")) {
    listenTo(axis, (x, y) => rowAt(x, y + heights[shown.indexOf(axis)] - axis.clientHeight / 2))
  }
  whenResized($("rows-area"), () => draw(true))
  return {draw, mark}
})()
