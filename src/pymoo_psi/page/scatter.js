// A scatter plot of two columns: the designs within the limits by name, their front in these two, what
// limits reject, and who wants which.

const MOST_SHAPES = 1000 // beyond that points are a density
const MOST_NAMES = 20
const FEW_NAMES = 8 // of designs that no other dominates, which may cover lines
const MOST_OBSTACLES = 300 // points from which names keep away
const SIDES = [[1, 0], [-1, 0], ...[0, 0.25, -0.25, 0.5, -0.5, 0.75, -0.75, 1, -1].flatMap((across) => [[across, -1], [across, 1]])] // of a point, where its name may be
const CLEAR = [26, 10] // pixels beside and above a point that names of others keep: one sees whose a name is
const GAP = 6 // pixels between names
const AWAY = [5, 17, 29, 43, 59] // from the shape of a point, the first without a line
const UNPLACED = 9 // more than all faults of a place
const WIDEST = [0.6, 0.35] // share of the plot that a name may take; with the smaller one it has more lines
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
  let zoom = 1 // about what is proposed or looked at, which stays where it is
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
      const centre = shareOn(scale)(column.values[verdict?.row]) || 0
      const [low, high] = whole[k].map((end) => valueAt(scale, centre + (end - centre) / zoom))
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
    const isHatched = columns.some(limitOf)
    const {colour} = LOOKS.other
    const isDensity = shownRows.length > MOST_SHAPES
    legend("key", [
      ...legendOfMarks(),
      isDensity ? [swatch("area", colour), `designs${DENSITY}`] : [icon(LOOKS.other), "dominated by no other", true],
      state.dominated && !isDensity && [icon(LOOKS.dominated), "dominated"],
      front.length > 1 && [swatch("step", colour), "best trade-offs of the two"],
      (isHatched || rejected.length) && [[isHatched && swatch("hatch", INK.text), rejected.length && icon(LOOKS.rejected)], "beyond a limit"],
      undrawn && [[], `${counted(undrawn, "design")} not drawn: dominated, beyond a limit or without a value`],
      beyond && [[], `${exact(beyond)} at the edge, outside of the axes`],
    ])
  }

  // Names beside their points, or farther away with a line to them, each nearer to its own point than to others:
  // none covers another, a point or a line. Where there is no such place a name is left out; but those that are
  // wanted may cover lines and, with a line of their own, points, or be nearer to others; where designs are
  // few, all may cover lines.
  function drawNames(g, front, rejected) {
    const holders = Map.groupBy(latest(state.positions), ({chosen}) => rowOf(chosen))
    holders.delete(-1)
    const wanted = [...marked.toReversed(), ...picked([...holders.keys()], (row) => left.mask[row]), ...rowsOf(verdict?.steps ?? [])]
    const further = shownRows.length <= MOST_NAMES ? [...front, ...shownRows] : []
    let rows = unique([...wanted, ...further]).filter(isInside)
    const visible = joined(picked(shownRows, isKnown), rejected)
    const others = visible.length <= MOST_OBSTACLES ? visible : []
    const points = unique([...rows, ...others]).map((row) => ({row, x: u(row) - CLEAR[0], y: v(row) - CLEAR[1], width: 2 * CLEAR[0], height: 2 * CLEAR[1]}))
    const isFew = ranking.front.length <= FEW_NAMES
    let taken // by names and their lines
    const faultOf = (place) => {
      const covers = (obstacles, start = 0) => [place, ...place.tie.slice(start)].some((spot) => !isFree(spot, obstacles))
      const away = (row) => hypot(...wayTo(place, row))
      const isOnPoint = covers(points)
      const isStray = points.some(({row}) => away(row) < away(place.row))
      if (covers(taken) || (left.mask[place.row] && !isFree(place, hatched)) || ((isOnPoint || isStray) && !place.tie.length)) return UNPLACED
      return 4 * isStray + 2 * isOnPoint + covers(lines, 3) // near its point a line may be on that of the front
    }
    // The best place of a name with those who want the design, or without them where there is none.
    const nameOf = (row) => {
      g.font = row === verdict?.row ? `650 ${FONT}` : FONT
      const people = namesOf(holders.get(row) ?? [])
      let name = {row, fault: UNPLACED}
      const most = wanted.includes(row) ? UNPLACED : isFew ? 2 : 1
      for (const text of new Set([[called(row), ...people].join(" · "), called(row)])) {
        for (const place of name.tie ? [] : placesOf(g, row, text)) {
          const fault = faultOf(place)
          if (fault < min(most, name.fault)) name = {...place, fault}
          if (!fault) return name
        }
      }
      return name
    }
    // What finds no place, or covers something, comes first in another try.
    let least = Infinity
    for (let tries = isFew ? 6 : 1; tries > 0 && least > 0; tries--) {
      taken = []
      const names = rows.map((row) => {
        const name = nameOf(row)
        if (name.tie) taken.push(name, ...name.tie)
        return name
      }).sort((a, b) => b.fault - a.fault)
      const faults = sum(names.map(({fault}) => fault))
      if (faults < least) [boxes, least] = [names.filter(({tie}) => tie), faults]
      rows = rowsOf(names)
    }
    for (const {row, font, words, x, y, tie} of boxes) {
      g.font = font
      if (tie.length) drawLine(g, INK.muted, tie[0].x, tie[0].y, tie.at(-1).x, tie.at(-1).y)
      const colour = row === verdict?.row ? INK.accent : wanted.includes(row) ? INK.text : INK.muted
      words.forEach((line, k) => drawText(g, line, x, y + 14 * k + 7, "left", colour))
    }
    g.font = FONT
  }

  // Names side by side are not to be read as one.
  function isFree(a, others) {
    return !others.some((b) => a.row !== b.row && a.x < b.x + b.width + GAP && b.x < a.x + a.width + GAP && a.y < b.y + b.height && b.y < a.y + a.height)
  }

  // How far it is across and down from a point to the text of a name.
  function wayTo({x, y, width, height}, row) {
    return [min(max(0, x - u(row)), x + width - u(row)), min(max(0, y + 3 - v(row)), y + height - 3 - v(row))]
  }

  // Where a name may be, beside its point first, then at a distance, with the spots of a line to it.
  function* placesOf(g, row, text) {
    const {size: radius} = LOOKS[marks.findLast((mark) => mark.row === row)?.look ?? look(row)]
    for (const share of WIDEST) {
      const words = wrapped(g, text, (right - LEFT) * share)
      const width = max(...words.map((line) => g.measureText(line).width))
      const height = 14 * words.length
      for (const gap of AWAY) for (const [across, down] of SIDES) {
        const reach = gap + radius
        const box = {row, words, font: g.font, width, height, x: u(row) + across * reach + (across - 1) / 2 * width, y: v(row) + down * (reach + 2) + (down - 1) / 2 * height}
        if (box.x <= LEFT || box.x + width >= size.width || box.y < TOP - 8 || box.y + height >= bottom) continue
        const tie = []
        const [dx, dy] = wayTo(box, row)
        for (let way = 6 / hypot(dx, dy); gap > AWAY[0] && way < 1; way += 0.1) {
          tie.push({row, x: u(row) + way * dx, y: v(row) + way * dy, width: 0, height: 0})
        }
        yield {...box, tie}
      }
    }
  }

  function draw() {
    columns = plotColumns()
    selects.forEach((select, k) => { select.selectedIndex = data.numeric.indexOf(columns[k]) })
    renew("relation", columns.every(isObjective) ? "trade off" : "are related")
    area.ariaLabel = `${columns[1].label} against ${columns[0].label}; the table holds the same designs`
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
