// A scatter plot of two columns: the designs within the limits by name, their front in these two, what
// limits reject, and who wants which. A drag sets the limits of both, those of a box.

const MOST_SHAPES = 1000 // beyond that points are a density
const MOST_NAMES = 20
function scatter(section, key, columns) {
  const [TOP, RIGHT, BOTTOM] = [10, 12, 24]
  let LEFT = 40
  let [boxes, drawn, windows] = [[], {}, null]
  let view // the shares of the window that are shown
  const former = new Map() // densities
  const area = make("div.plot", {role: "img"})
  const select = (k) => {
    const element = make("select", {ariaLabel: `${key}, ${k ? "up" : "across"}`}, data.columns.map((column) =>
      make("option", {value: column.field, selected: column === columns[k]}, column.label)))
    element.onchange = () => {
      columns[k] = data.columns.find((column) => column.field === element.value)
      setAxes()
      if (isFirst) change({plot: columns.map(({name}) => name)})
      draw(true)
    }
    return element
  }
  const isFirst = plots.length === 0
  const selects = [0, 1].map(select)
  const hint = make("p.hint")
  const zooms = [["+", "Zoom in", 1.6], ["−", "Zoom out", 1 / 1.6]].map(([text, label, factor]) =>
    button(text, () => zoomBy(factor), {ariaLabel: `${label}: ${key}`, title: `${label}; Ctrl and the wheel do the same`}))
  section.append(make("div.heading", make("h2", "How ", selects[1], " and ", selects[0], " trade off"),
    make("div.buttons", zooms, button("Copy", () => copyPicture(section, `${data.file}-plot`), {title: "Copy as a picture"}))), hint, area)
  const {size, clean} = layers(area, 3, () => draw(true))
  const frame = () => [size.width - LEFT - RIGHT, size.height - TOP - BOTTOM]
  const sharesAt = (u, v) => [(u - LEFT) / frame()[0], 1 - (v - TOP) / frame()[1]]

  function setAxes() {
    selects.forEach((element, k) => { element.value = columns[k].field })
    view = [[0, 1], [0, 1]]
    windows = null
    area.ariaLabel = `${columns[1].label} against ${columns[0].label}; the table holds the same designs`
    const better = columns.filter(isObjective).map(({name, maximize}) => `${maximize ? "more" : "less"} ${name}`)
    renew(hint, ["", `Better: ${better[0]}.`, `Better: ${better.join(" and ")}. The line is their front.`][better.length])
  }

  // What is shown: the designs within the limits and what is marked, with the limits near them. It
  // changes when a hand rests, not while it drags.
  function wholeWindow() {
    return columns.map((column) => {
      const values = valuesOf(ranking, column)
      const {log, ...ends} = scaleOf(column)
      const rows = joined(shownRows, Int32Array.from(marked))
      let [low, high] = [max(ends.low, endOf(values, 1, rows)), min(ends.high, endOf(values, -1, rows))]
      if (!(low <= high)) [low, high] = [ends.low, ends.high]
      const isLog = log && low > 0
      const [to, back] = isLog ? [Math.log, Math.exp] : [Number, Number]
      const room = 0.08 * (to(high) - to(low)) || abs(to(high)) * 0.03 || 1
      const [least, most] = (column.texts ? [] : limitOf(column) ?? []).map((end) => (end === null ? NaN : to(end)))
      let [a, b] = [to(low) - room, to(high) + room]
      if (least > a - 3 * room && least < b) a = min(a, least - room)
      if (most < b + 3 * room && most > a) b = max(b, most + room)
      return {low: back(a), high: back(b), log: isLog}
    })
  }
  function spansOf() {
    if (!windows || !dragging) windows = wholeWindow()
    return windows.map((scale, k) => ({...scale, low: valueAt(scale, view[k][0]), high: valueAt(scale, view[k][1])}))
  }
  // What is at the spot stays there.
  function zoomBy(factor, spot = verdict && spotsOf()(verdict.row)) {
    const shares = spot ? sharesAt(...spot) : [0.5, 0.5]
    view = view.map(([from, to], k) => {
      const length = min(1, max(1e-4, (to - from) / factor))
      const start = min(1 - length, max(0, from + shares[k] * (to - from - length)))
      return [start, start + length]
    })
    draw(true)
  }

  let spans = []
  function spotsOf() {
    const [w, h] = frame()
    const [across, up] = spans.map((scale) => shareOn(scale, 0))
    const [xs, ys] = columns.map((column) => valuesOf(ranking, column))
    const at = (row) => [at.u(row), at.v(row)]
    at.u = (row) => LEFT + across(xs[row]) * w
    at.v = (row) => TOP + (1 - up(ys[row])) * h
    return at
  }
  const isKnown = ([u, v]) => u === u && v === v
  const isInside = (row) => columns.every((column, k) => {
    const value = valuesOf(ranking, column)[row]
    return value >= spans[k].low && value <= spans[k].high
  })

  function drawAxes() {
    const g = clean(0)
    former.clear()
    const [x, y] = columns
    const [across, up] = spans
    const ty = tickTexts(up, max(2, (size.height - TOP - BOTTOM) / (y.texts ? 15 : 45)), y.texts)
    LEFT = ceil(max(24, ...ty.texts.map((text) => g.measureText(text).width + 10)))
    const [w, h] = frame()
    const tx = tickTexts(across, max(2, w / (x.texts ? 120 : 80)), x.texts)
    const [px, py] = [shareOn(across), shareOn(up)]
    tx.values.forEach((value, k) => drawText(g, tx.texts[k], LEFT + px(value) * w, TOP + h + 7, "center", INK.muted, "top"))
    ty.values.forEach((value, k) => drawText(g, ty.texts[k], LEFT - 6, TOP + (1 - py(value)) * h, "right"))
    if (tx.factor) drawText(g, tx.factor, LEFT + w + RIGHT, TOP + h - 8, "right")
    if (ty.factor) drawText(g, ty.factor, 0, 6, "left")
    drawLine(g, INK.grid, LEFT, TOP, LEFT, TOP + h)
    drawLine(g, INK.grid, LEFT, TOP + h, LEFT + w, TOP + h)
  }

  // Points as squares of a density.
  function countPoints(counts, rows, step) {
    const {u: across, v: up} = spotsOf()
    const line = round(size.width * devicePixelRatio) + 1
    const half = round((data.total > 5000 ? 1 : 1.5) * devicePixelRatio)
    for (let k = 0; k < rows.length; k++) {
      const [u, v] = [across(rows[k]), up(rows[k])]
      if (u !== u || v !== v) continue
      const first = round(v * devicePixelRatio - half) * line + round(u * devicePixelRatio - half)
      for (let i = first; i <= first + 2 * half * line; i += line) {
        counts[i] += step
        counts[i + 2 * half + 1] -= step
      }
    }
  }

  // The designs within the limits that are best in these two, at most one for a pixel across: sorting
  // all of them would take longer than all else.
  function frontOfTwo(at) {
    const [x, y] = columns
    if (!columns.every(isObjective)) return []
    const values = data.F[data.objectives.indexOf(y)]
    const best = new Int32Array(ceil(size.width)).fill(-1)
    for (const row of ranking.front) {
      const u = floor(at.u(row))
      if (best[u] < 0 || values[row] < values[best[u]]) best[u] = row
    }
    let least = Infinity
    return (x.maximize ? best.reverse() : best).filter((row) => row >= 0 && values[row] < least && ((least = values[row]), true))
  }

  function drawLeft() {
    const g = clean(1)
    const at = spotsOf()
    const isFew = shownRows.length <= MOST_SHAPES
    if (!isFew) drawDensity(g, byColour(hues, shownRows), data.total, [0.5, 2000], countPoints, former)
    drawLimits(g)
    g.beginPath()
    frontOfTwo(at).forEach((row, k) => g[k ? "lineTo" : "moveTo"](...at(row)))
    Object.assign(g, {strokeStyle: LOOKS.other.colour, lineWidth: 1})
    g.stroke()
    for (const row of isFew ? shownRows : []) {
      const look = LOOKS[shapeOf(row)]
      const spot = at(row)
      if (isKnown(spot)) drawShape(g, hues?.(row) ?? {...look, size: shownRows.length > 100 ? 2 : look.size}, ...spot)
    }
    for (const {row, look} of marks) if (isKnown(at(row))) drawShape(g, LOOKS[look], ...at(row))
    drawEdges(g, at)
    boxes = drawNames(g, at)
  }
  const shapeOf = (row) => (look(row) === "best" ? "other" : look(row))

  // What limits reject is hatched.
  function drawLimits(g) {
    const [w, h] = frame()
    spans.forEach((scale, k) => {
      const column = columns[k]
      ;((column.texts ? null : limitOf(column)) ?? []).forEach((end, side) => {
        const share = end === null ? NaN : shareOn(scale)(end)
        if (!(share >= 0 && share <= 1)) return
        const [from, to] = side ? [share, 1] : [0, share]
        const box = k ? [LEFT, TOP + (1 - to) * h, w, (to - from) * h] : [LEFT + from * w, TOP, (to - from) * w, h]
        drawHatch(g, ...box)
        const [u, v] = [LEFT + share * w, TOP + (1 - share) * h]
        k ? drawLine(g, INK.text, LEFT, v, LEFT + w, v, 2) : drawLine(g, INK.text, u, TOP, u, TOP + h, 2)
      })
    })
  }

  // Points beyond the window are at its edge: it is said how many these are, and how many have no value.
  function drawEdges(g, at) {
    const [w, h] = frame()
    let [missing, beyond] = [0, 0]
    for (const row of shownRows) {
      if (!isKnown(at(row))) missing++
      else if (!isInside(row)) beyond++
    }
    const words = [[beyond, "beyond the edge"], [missing, "without a value"]].filter(([count]) => count)
    drawText(g, words.map(([count, word]) => `${exact(count)} ${word}`).join(", "), LEFT + w, TOP + h - 9, "right", INK.accent)
    drawn = {points: shownRows.length - missing, missing, beyond}
  }

  // Names beside their points, where they cover neither one another nor a point that has a name. A
  // line leads to one that is farther off; one without room is left out.
  function drawNames(g, at) {
    const people = new Map()
    for (const {name, chosen} of latest(state.positions)) people.set(chosen, [...people.get(chosen) ?? [], name])
    const rows = new Set([...marked].reverse())
    for (const row of shownRows.length <= MOST_NAMES ? shownRows : []) rows.add(row)
    for (const name of people.keys()) if (rowOf(name) >= 0 && left.mask[rowOf(name)]) rows.add(rowOf(name))
    const spots = new Map([...rows].filter((row) => isInside(row)).map((row) => [row, at(row)]))
    const [w, h] = frame()
    const taken = [...spots].map(([row, [u, v]]) => ({row, x: u - 5, y: v - 5, width: 10, height: 10}))
    const hits = (a) => taken.some((b) => a.row !== b.row && a.x < b.x + b.width && b.x < a.x + a.width && a.y < b.y + b.height && b.y < a.y + a.height)
    const found = []
    for (const [row, [u, v]] of spots) {
      g.font = fontOf(row)
      const lines = wrapped(g, [called(row), ...people.get(called(row)) ?? []].join(" · "), w * 0.6)
      const width = max(...lines.map((line) => g.measureText(line).width))
      const height = 14 * lines.length
      const [left, up] = [-4 - width, -height - 3]
      const places = [7, 18, 30, 46, 64, 84, 110].flatMap((r) => [[4, up - r], [left, r - 4], [r, -height / 2], [-r - width, -height / 2],
        [left, up - r], [4, r - 4], [-width / 2, up - r], [-width / 2, r]].map(([dx, dy]) => ({row, lines, isFar: r > 18, x: u + dx, y: v + dy, width, height})))
      const box = places.find((box) => box.x > LEFT + 2 && box.x + width < LEFT + w + RIGHT && box.y >= 0 && box.y + height < TOP + h && !hits(box))
      if (!box) continue
      taken.push(box)
      found.push(box)
      if (box.isFar) drawLine(g, INK.field, u, v, min(max(u, box.x), box.x + width), min(max(v, box.y), box.y + height))
    }
    for (const {row, lines, x, y} of found) {
      g.font = fontOf(row)
      const colour = row === verdict?.row ? INK.accent : marked.includes(row) ? INK.text : INK.muted
      lines.forEach((line, k) => drawText(g, line, x, y + 14 * k + 7, "left", colour))
    }
    g.font = FONT
    return found
  }
  const fontOf = (row) => (row === verdict?.row ? `600 ${FONT}` : FONT)

  function markRow(row) {
    const g = clean(2)
    if (row >= 0 && isInside(row)) drawShape(g, {shape: "ring", size: 10, colour: INK.accent}, ...spotsOf()(row))
  }

  let formerWindows = ""
  function draw(all) {
    if (isFirst && state.plot.length === 2 && String(state.plot) !== String(columns.map(({name}) => name))) {
      columns.splice(0, 2, ...state.plot.map((name) => data.by.get(name)))
      setAxes()
    }
    if (!size.width) return
    spans = spansOf()
    const ends = JSON.stringify(spans)
    if (all || ends !== formerWindows) drawAxes()
    formerWindows = ends
    drawLeft()
  }

  function rowAt(u, v) {
    const at = spotsOf()
    const name = boxes.find((box) => u >= box.x && u <= box.x + box.width && v >= box.y && v <= box.y + box.height)
    return name ? name.row : nearestRow(9, (row) => {
      const [a, b] = at(row)
      return hypot(a - u, b - v)
    })
  }

  // What is dragged along one axis sets no limit of the other.
  const limits = (u, v, a, b) => {
    const [from, to] = [sharesAt(u, v), sharesAt(a, b)]
    const ways = [a - u, b - v]
    return columns.flatMap((column, k) => column.texts || isGeometric(column) || abs(ways[k]) <= 4 ? []
      : [[column, between(column, spans[k], from[k], to[k])]])
  }
  listenTo(area, rowAt, limits)
  area.addEventListener("wheel", (event) => {
    if (!event.ctrlKey && !event.metaKey) return
    event.preventDefault()
    zoomBy(event.deltaY < 0 ? 1.25 : 0.8, [event.offsetX, event.offsetY])
  }, {passive: false})
  setAxes()
  plots.push({draw, mark: markRow, spot: (row) => spotsOf()(row),
    get names() { return boxes }, get inView() { return size.inView }, get drawn() { return drawn }})
}
