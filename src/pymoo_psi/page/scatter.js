// A scatter plot of two columns: the designs within the limits by name, their front in these two, what
// limits reject, and who wants which. A drag sets the limits of both, those of a box.

const MOST_SHAPES = 1000 // beyond that points are a density
const MOST_NAMES = 20
const MOST_OBSTACLES = 300 // points from which names keep away
const SIDES = [[1, 0], [-1, 0], ...[0, 0.25, -0.25, 0.5, -0.5, 0.75, -0.75, 1, -1].flatMap((across) => [[across, -1], [across, 1]])] // of a point, where its name may be
const AWAY = [8, 20, 32, 46, 62] // from the point, the first without a line
// The columns of both plots, across and up.
const plotColumns = () => data.plot.map((name, k) => data.by.get(state.plot[k]) ?? data.by.get(name))

function scatter(section, place, name) {
  section.append(copyOf("scatter"))
  const [TOP, RIGHT, BOTTOM] = [22, 12, 40]
  let LEFT = 40
  let [boxes, drawn] = [[], {}] // of names, and what is drawn
  let lines = [] // small boxes along the front, and what limits reject: no place for a name
  let columns = []
  let [whole, view] = [] // the window, and the shares of it that are shown
  let scales = [] // of what is shown
  let [u, v] = [] // where a row is
  let [isKnown, isInside] = [] // whether it has both values, and these are shown
  const former = new Map() // densities
  const area = section.querySelector(".plot")
  const hint = section.querySelector(".hint")
  const selects = [...section.querySelectorAll("select")] // across, up
  selects.forEach((select, k) => {
    select.append(...data.columns.map((column) => make("option", {value: column.field}, column.label)))
    select.onchange = () => change({plot: plotColumns().map(({name}, j) => j === place + k ? data.columns[select.selectedIndex].name : name)})
  })
  const [nearer, farther, copy] = section.querySelectorAll("button")
  const controls = [...selects, nearer, farther]
  for (const [k, text] of ["across", "up", "zoom in", "zoom out"].entries()) controls[k].ariaLabel = `${name}, ${text}`
  nearer.onclick = () => zoomBy(1.6)
  farther.onclick = () => zoomBy(1 / 1.6)
  copy.onclick = () => copyPicture(section, `${data.file}-plot`)
  const {size, clean} = layers(area, 3, () => draw(true))
  const frame = () => [size.width - LEFT - RIGHT, size.height - TOP - BOTTOM]

  function setAxes() {
    selects.forEach((select, k) => { select.value = columns[k].field })
    view = [[0, 1], [0, 1]]
    whole = null
    area.ariaLabel = `${columns[1].label} against ${columns[0].label}; the table holds the same designs`
  }

  // What is shown of a column: the designs within the limits and what is marked, with limits near them.
  function windowOf(column) {
    const values = valuesOf(ranking, column)
    const ends = scaleOf(column)
    const rows = joined(shownRows, Int32Array.from(marked))
    let [low, high] = [max(ends.low, endOf(values, 1, rows)), min(ends.high, endOf(values, -1, rows))]
    if (!(low <= high)) [low, high] = [ends.low, ends.high]
    const log = ends.log && low > 0
    const [to, back] = log ? [Math.log, Math.exp] : [Number, Number]
    const room = (column === columns[1] ? 0.2 : 0.12) * (to(high) - to(low)) || abs(to(high)) * 0.03 || 1
    const [least, most] = numericLimit(column).map((end) => (end === null ? NaN : to(end)))
    let [from, until] = [to(low) - room, to(high) + room]
    if (least > from - 3 * room && least < until) from = min(from, least - room)
    if (most < until + 3 * room && most > from) until = max(until, most + room)
    return {low: back(from), high: back(until), log}
  }

  // The window changes when a hand rests, not while it drags.
  function lay() {
    if (!whole || !dragging) whole = columns.map(windowOf)
    scales = whole.map((scale, k) => ({...scale, low: valueAt(scale, view[k][0]), high: valueAt(scale, view[k][1])}))
    const [w, h] = frame()
    const [x, y] = [placing(scales[0], LEFT, LEFT + w, 0), placing(scales[1], TOP + h, TOP, 0)]
    const [xs, ys] = columns.map((column) => valuesOf(ranking, column))
    const [a, b] = scales
    u = (row) => x(xs[row])
    v = (row) => y(ys[row])
    isKnown = (row) => xs[row] === xs[row] && ys[row] === ys[row]
    isInside = (row) => xs[row] >= a.low && xs[row] <= a.high && ys[row] >= b.low && ys[row] <= b.high
  }
  const sharesAt = (x, y) => [(x - LEFT) / frame()[0], 1 - (y - TOP) / frame()[1]]

  // What is at the spot stays there.
  function zoomBy(factor, spot = verdict ? [u(verdict.row), v(verdict.row)] : [size.width / 2, size.height / 2]) {
    const shares = sharesAt(...spot)
    view = view.map(([from, to], k) => {
      const length = min(1, max(1e-4, (to - from) / factor))
      const start = min(1 - length, max(0, from + shares[k] * (to - from - length)))
      return [start, start + length]
    })
    draw(true)
  }

  function drawAxes() {
    const g = clean(0)
    former.clear()
    const [x, y] = columns
    const up = tickTexts(scales[1], max(2, frame()[1] / (y.texts ? 15 : 45)), y.texts)
    LEFT = ceil(max(24, ...up.texts.map((text) => g.measureText(text).width + 10)))
    const [w, h] = frame()
    const across = tickTexts(scales[0], max(2, w / (x.texts ? 120 : 80)), x.texts)
    const [toU, toV] = [placing(scales[0], LEFT, LEFT + w), placing(scales[1], TOP + h, TOP)]
    across.values.forEach((value, k) => drawText(g, across.texts[k], toU(value), TOP + h + 7, "center", INK.muted, "top"))
    up.values.forEach((value, k) => drawText(g, up.texts[k], LEFT - 6, toV(value), "right"))
    drawText(g, `${x.label} ${across.factor}`, LEFT + w + RIGHT, TOP + h + 32, "right")
    drawText(g, `${y.label} ${up.factor}`, 0, 7, "left")
    drawLine(g, INK.grid, LEFT, TOP, LEFT, TOP + h)
    drawLine(g, INK.grid, LEFT, TOP + h, LEFT + w, TOP + h)
  }

  // Points as squares of a density.
  function countPoints(counts, line, rows, step) {
    const ratio = devicePixelRatio
    const half = round((data.total > 5000 ? 1 : 1.5) * ratio)
    const width = 2 * half + 1
    for (const row of rows) {
      countBox(counts, line, round(u(row) * ratio - half), round(v(row) * ratio - half), width, width, step)
    }
  }

  // The designs within the limits that are best in these two, at most one for a pixel across: sorting
  // all of them would take longer than all else.
  function frontOfTwo() {
    const [x, y] = columns
    if (!columns.every(isObjective)) return []
    const values = data.F[data.objectives.indexOf(y)]
    const best = new Int32Array(ceil(size.width) + 1).fill(-1)
    for (const row of ranking.front) {
      const pixel = floor(u(row))
      if (best[pixel] < 0 || values[row] < values[best[pixel]]) best[pixel] = row
    }
    let least = Infinity
    const front = []
    for (const row of x.maximize ? best.reverse() : best) {
      if (row < 0 || values[row] >= least) continue
      front.push(row)
      least = values[row]
    }
    return front
  }

  function drawLeft() {
    const g = clean(1)
    const isFew = shownRows.length <= MOST_SHAPES
    if (!isFew) drawDensity(g, byColour(shownRows), data.total, [0.5, 2000], countPoints, former)
    lines = []
    columns.forEach((column, k) => drawLimits(g, column, k))
    const rejected = data.n > MOST_SHAPES ? [] : picked(data.designs, (row) => !left.mask[row] && isInside(row))
    const outside = data.n - left.count - rejected.length
    for (const row of rejected) drawShape(g, {shape: "dot", size: 2.5, colour: INK.field}, u(row), v(row))
    const front = frontOfTwo()
    const words = columns.filter(isObjective).map(({name, maximize}) => [maximize ? "more" : "less", name])
    const isAlike = words.length > 1 && words[0][0] === words[1][0]
    const better = isAlike ? `${upper(words[0][0])} is better in both. ` : words.length && `Better: ${words.map((two) => two.join(" ")).join(" and ")}. `
    renew(hint, better, front.length > 1 && "The line is their front. ", rejected.length && `Grey dots are rejected${outside ? `; ${exact(outside)} more are beyond the axes` : ""}.`)
    // Between two designs there is none: the front goes by the worse values of both.
    const corners = front.flatMap((row, k) => [[u(row), v(front[k - 1] ?? row)], [u(row), v(row)]])
    g.beginPath()
    corners.forEach(([x, y], k) => {
      g.lineTo(x, y)
      const [lastX, lastY] = corners[k - 1] ?? [x, y]
      for (let share = 0; isFew && k && share < 1; share += 0.02) {
        lines.push({x: lastX + share * (x - lastX), y: lastY + share * (y - lastY), width: 0, height: 0})
      }
    })
    Object.assign(g, {strokeStyle: LOOKS.other.colour, lineWidth: 1})
    g.stroke()
    if (isFew) for (const row of picked(shownRows, isKnown)) {
      const ours = LOOKS[ranking.pareto[row] ? "other" : "dominated"]
      drawShape(g, hues?.(row) ?? {...ours, size: shownRows.length > 100 ? 2 : ours.size}, u(row), v(row))
    }
    for (const {row, look} of marks) if (isKnown(row)) drawShape(g, LOOKS[look], u(row), v(row))
    drawEdges(g)
    boxes = drawNames(g, front)
  }

  // What limits reject is hatched.
  function drawLimits(g, column, k) {
    const [w, h] = frame()
    numericLimit(column).forEach((end, side) => {
      const share = shareOn(scales[k])(end)
      if (end === null || !(share >= 0 && share <= 1)) return
      const [from, to] = side ? [share, 1] : [0, share]
      const [x, y] = [LEFT + share * w, TOP + (1 - share) * h]
      const box = k ? {x: LEFT, y: TOP + (1 - to) * h, width: w, height: (to - from) * h} : {x: LEFT + from * w, y: TOP, width: (to - from) * w, height: h}
      drawHatch(g, box.x, box.y, box.width, box.height)
      drawLine(g, INK.text, ...(k ? [LEFT, y, LEFT + w, y] : [x, TOP, x, TOP + h]), 2)
      lines.push(box)
    })
  }

  // Points beyond the window are at its edge: it is said how many these are, and how many have no value.
  function drawEdges(g) {
    const [w, h] = frame()
    let [missing, beyond] = [0, 0]
    for (const row of shownRows) {
      if (!isKnown(row)) missing++
      else if (!isInside(row)) beyond++
    }
    const words = [beyond && `${exact(beyond)} beyond the edge`, missing && `${exact(missing)} without a value`]
    drawText(g, words.filter(Boolean).join(", "), LEFT + w, TOP + h - 9, "right", INK.accent)
    drawn = {points: shownRows.length - missing, missing, beyond}
  }

  // Names beside their points: none covers another, a point or a line, and none is nearer to another
  // point than to its own. Without such a place a name has a short line to its point, or is left out;
  // the marked designs and those one step away have one in any case.
  function drawNames(g, front) {
    const people = Map.groupBy(latest(state.positions), ({chosen}) => rowOf(chosen))
    people.delete(-1)
    const wanted = picked([...[...marked].reverse(), ...verdict?.steps.map(({row}) => row) ?? []], isInside)
    const rows = [...wanted, ...shownRows.length <= MOST_NAMES ? [...front, ...shownRows] : [], ...picked([...people.keys()], (row) => left.mask[row])]
    const places = new Map([...new Set(rows)].filter(isInside).map((row) => {
      g.font = fontOf(row)
      const words = wrapped(g, [called(row), ...(people.get(row) ?? []).map(({name}) => name)].join(" · "), frame()[0] * 0.6)
      return [row, placesOf(row, words, max(...words.map((line) => g.measureText(line).width)))]
    }))
    const all = [...places.keys()]
    let names = namesAt(places, wanted, all)
    const missing = all.filter((row) => !names.some((name) => name.row === row))
    for (const first of [wanted, []]) { // perhaps there is room for all where these come first
      if (names.length === all.length) break
      const others = namesAt(places, wanted, [...new Set([...first, ...missing, ...all])])
      if (others.length > names.length) names = others
    }
    for (const {row, words, x, y, tie} of names) {
      if (tie.length) drawLine(g, INK.muted, tie[0].x, tie[0].y, tie.at(-1).x, tie.at(-1).y)
      g.font = fontOf(row)
      const colour = row === verdict?.row ? INK.accent : wanted.includes(row) ? INK.text : INK.muted
      words.forEach((line, k) => drawText(g, line, x, y + 14 * k + 7, "left", colour))
    }
    g.font = FONT
    return names
  }

  // Names in the order of rows, each at the first of its places that is free.
  function namesAt(places, wanted, rows) {
    const others = shownRows.length <= MOST_OBSTACLES ? picked(shownRows, isInside) : []
    const points = [...new Set([...rows, ...others])].map(squareAround)
    const [names, ties] = [[], []]
    for (const row of rows) {
      const taken = [...points, ...names, ...ties]
      const fits = (one) => one.isTied ? lineTo(one).every((spot) => isFree(spot, taken)) : isNearest(one, points)
      const obstacles = wanted.includes(row) ? [[...taken, ...lines], taken, names] : [[...taken, ...lines]]
      let name
      for (const boxes of obstacles) name ??= places.get(row).find((one) => isFree(one, boxes) && fits(one))
      if (wanted.includes(row)) name ??= places.get(row).find((one) => one.isTied && isFree(one, names))
      if (!name) continue
      names.push({...name, tie: name.isTied ? lineTo(name) : []})
      ties.push(...names.at(-1).tie)
    }
    return names
  }
  const squareAround = (row) => ({row, x: u(row) - 6, y: v(row) - 6, width: 12, height: 12})
  const isFree = (a, boxes) => !boxes.some((b) => a.row !== b.row && a.x < b.x + b.width + 2 && b.x < a.x + a.width + 2 && a.y < b.y + b.height && b.y < a.y + a.height)
  // The nearest place in a box to a point, and how far it is.
  const nearestIn = ({x, y, width, height}, row) => [min(max(u(row), x), x + width), min(max(v(row), y + 3), y + height - 3)]
  const away = (box, row) => {
    const [x, y] = nearestIn(box, row)
    return hypot(x - u(row), y - v(row))
  }
  const isNearest = (box, points) => points.every(({row}) => row === box.row || away(box, row) > away(box, box.row) + 3)
  // The line from a point to a box, as spots.
  const lineTo = (box) => {
    const {row} = box
    const [x, y] = nearestIn(box, row)
    const spots = []
    for (let share = 6 / away(box, row); share < 1; share += 0.1) {
      spots.push({row, x: u(row) + share * (x - u(row)), y: v(row) + share * (y - v(row)), width: 0, height: 0})
    }
    return spots
  }

  // Where a name of a size may be, beside its point first, then at a distance, tied to it by a line.
  function placesOf(row, words, width) {
    const [w, h] = frame()
    const height = 14 * words.length
    const places = []
    for (const reach of AWAY) for (const [across, down] of SIDES) {
      const r = reach * (abs(across) + abs(down) > 1.5 ? 0.75 : 1)
      const box = {row, words, width, height, isTied: reach > AWAY[0], x: u(row) + across * r + (across - 1) / 2 * width, y: v(row) + down * r + (down - 1) / 2 * height}
      if (box.x > LEFT && box.x + width < LEFT + w + RIGHT && box.y >= TOP - 8 && box.y + height < TOP + h) places.push(box)
    }
    return places
  }
  const fontOf = (row) => (row === verdict?.row ? `650 ${FONT}` : FONT)

  function mark(row) {
    const g = clean(2)
    if (row >= 0 && isInside(row)) drawShape(g, {shape: "ring", size: 10, colour: INK.accent}, u(row), v(row))
  }

  let formerEnds = ""
  function draw(all) {
    const next = plotColumns().slice(place, place + 2)
    const isOther = next.some((column, k) => column !== columns[k])
    columns = next
    if (isOther) setAxes()
    if (!size.width) return
    lay()
    const ends = JSON.stringify(scales)
    if (all || isOther || ends !== formerEnds) {
      drawAxes()
      lay()
    }
    formerEnds = ends
    drawLeft()
  }

  function rowAt(x, y) {
    const name = boxes.find((box) => x >= box.x && x <= box.x + box.width && y >= box.y && y <= box.y + box.height)
    return name ? name.row : nearestRow(9, (row) => hypot(u(row) - x, v(row) - y))
  }

  // What is dragged along one axis sets no limit of the other.
  function limits(x, y, x1, y1) {
    const [from, to] = [sharesAt(x, y), sharesAt(x1, y1)]
    const ways = [x1 - x, y1 - y]
    return columns.flatMap((column, k) => column.texts || isGeometric(column) || abs(ways[k]) <= 4 ? []
      : [[column, between(column, scales[k], from[k], to[k])]])
  }
  listenTo(area, rowAt, limits)
  area.addEventListener("wheel", (event) => {
    if (!event.ctrlKey && !event.metaKey) return
    event.preventDefault()
    zoomBy(event.deltaY < 0 ? 1.25 : 0.8, [event.offsetX, event.offsetY])
  }, {passive: false})
  return {draw, mark, spot: (row) => [u(row), v(row)], get names() { return boxes }, get drawn() { return drawn }}
}

plots.push(scatter($("scatter-a"), 0, "First plot"), scatter($("scatter-b"), 2, "Second plot"))
