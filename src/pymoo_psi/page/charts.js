// Drawing on canvas: parallel coordinates and scatter plots.
//
// A chart has layers. The context (a stable sample of all designs) and the axes are drawn when scales
// or size change, what is left, the marks and limits at every step of a slider, the design under the
// pointer at every move. Charts know rows, columns and scales; what is chosen or limited they get from
// page.js as a model:
//   context, left   rows to draw, those of left that are near; look(row) -> key of LOOKS, named(row) -> what it is called
//   values(column)  the numbers of a column as they are now
//   scale(column)   {low, high, log}, the ends of its axis
//   limit(column)   [low, high] in force, null for none
//   marks           [{row, look}] drawn large above all, with their names; their values are on all axes
//   hues            (row) -> look of a design by its category, or null for those of the places
//   written(column, value), the text of a value
// Every row left is drawn: what lies beyond an axis is at its end, where its number is written.
const Charts = (() => {
  // Shapes tell the same as colours, which page.css has, for light and dark.
  const LOOKS = {
    other: {shape: "dot", size: 3.1},
    dominated: {shape: "cross", size: 2},
    near: {shape: "diamond", size: 4.5},
    best: {shape: "star", size: 8},
    prototype: {shape: "cross", size: 5},
    chosen: {shape: "ring", size: 8.5},
    pinned: {shape: "frame", size: 7.5},
    inspected: {shape: "corners", size: 10},
  }
  const MOST_LINES = 150 // beyond that lines are a density,
  const MOST_SHAPES = 1000 // and points beyond this
  const MOST_NAMES = 20
  const INK = {}
  function dye() {
    const style = getComputedStyle(document.documentElement)
    const colour = (name) => style.getPropertyValue(`--${name}`).trim()
    for (const [key, look] of entriesOf(LOOKS)) look.colour = colour(`look-${key}`)
    for (const name of ["context", "text", "muted", "accent", "panel", "grid", "field"]) INK[name] = colour(name)
  }
  dye()
  // Categories have colours and shapes that no other mark has. Neighbours differ in lightness, too.
  const HUES = [["#D55E00", "down"], ["#00795A", "plus"], ["#B07800", "hexagon"], ["#7F3C8D", "bar"],
    ["#C4568F", "column"], ["#5F6B00", "glass"], ["#8C4A2F", "half"], ["#0E8080", "arrow"]]
    .map(([colour, shape]) => ({colour, shape, size: 4}))
  const FONT = '11px system-ui, "Segoe UI", "DejaVu Sans", sans-serif'

  // Outlines of the shapes, in units of their size, for canvas and SVG.
  const star = [...Array(10).keys()].map((k) => {
    const [radius, angle] = [k % 2 ? 0.45 : 1, (k * Math.PI) / 5]
    return `${radius * Math.sin(angle)} ${-radius * Math.cos(angle)}`
  })
  const OUTLINES = {
    dot: "M-1 0A1 1 0 1 1 1 0A1 1 0 1 1-1 0",
    frame: "M-1-1H1V1H-1Z",
    corners: "M-1-.4V-1H-.4M.4-1H1V-.4M1 .4V1H.4M-.4 1H-1V.4",
    cross: "M-1-1L1 1M1-1L-1 1",
    ring: "M-1 0A1 1 0 1 1 1 0A1 1 0 1 1-1 0",
    diamond: "M0-1.1L1 0L0 1.1L-1 0Z",
    star: `M${star.join("L")}Z`,
    down: "M0 1L-.95-.8H.95Z",
    plus: "M-.35-1H.35V-.35H1V.35H.35V1H-.35V.35H-1V-.35H-.35Z",
    hexagon: "M-1 0L-.5-.9H.5L1 0L.5.9H-.5Z",
    bar: "M-1.2-.5H1.2V.5H-1.2Z",
    column: "M-.5-1.2H.5V1.2H-.5Z",
    glass: "M-1-1H1L-1 1H1Z",
    half: "M-1 .5A1 1 0 0 1 1 .5Z",
    arrow: "M1 0L-.8-1L-.3 0L-.8 1Z",
  }
  const PATHS = Object.fromEntries(entriesOf(OUTLINES).map(([key, path]) => [key, new Path2D(path)]))
  const isOpen = (shape) => ["cross", "ring", "frame", "corners"].includes(shape)

  function shape(g, {shape, colour, size}, x, y) {
    g.fillStyle = g.strokeStyle = colour
    g.save()
    g.translate(x, y)
    g.scale(size, size)
    g.lineWidth = 1.6 / size
    isOpen(shape) ? g.stroke(PATHS[shape]) : g.fill(PATHS[shape])
    g.restore()
  }

  // A shape as a picture for legends and texts, made once and copied.
  const icons = new Map()
  function icon(key) { // the key is one of LOOKS, or a category
    if (!icons.has(key)) {
      const {shape, size, colour = `var(--look-${key})`} = LOOKS[key] ? {...LOOKS[key], colour: undefined} : key
      const r = min(size, 6.5)
      const svg = (name, attributes) => {
        const element = document.createElementNS("http://www.w3.org/2000/svg", name)
        for (const [attribute, value] of entriesOf(attributes)) element.setAttribute(attribute, value)
        return element
      }
      icons.set(key, svg("svg", {class: "icon", viewBox: "0 0 16 16", "aria-hidden": "true"}))
      icons.get(key).append(svg("path", {d: OUTLINES[shape], transform: `translate(8 8) scale(${r})`, "stroke-width": 1.6 / r,
        fill: isOpen(shape) ? "none" : colour, stroke: isOpen(shape) ? colour : "none"}))
    }
    return icons.get(key).cloneNode(true)
  }

  // A name that may go on in a new line behind each underscore or slash, and before a capital within;
  // a unit may not.
  const broken = (text) => text.split(/(?:(?<=[_/])|(?<=[a-z])(?=[A-Z]))(?![^[]*\])/).flatMap((part, k) => (k ? [document.createElement("wbr"), part] : [part]))

  // Scales. A place is the share of the way from the low to the high end; what lies beyond an end
  // is drawn there, or just outside of it.
  function place({low, high, log}, out = 0.03) {
    const [a, b] = log ? [Math.log(low), Math.log(high)] : [low, high]
    const span = b - a || 1
    return (value) => {
      const share = b > a ? ((log ? Math.log(max(value, low * 0.5)) : value) - a) / span : 0.5
      return share < -out ? -out : share > 1 + out ? 1 + out : share
    }
  }

  const valueAt = ({low, high, log}, share) =>
    log ? low * (high / low) ** share : low + (high - low) * share

  // The limit that a drag from one share of an axis to another sets. It is open at the ends of the axis,
  // and near the best value of an objective, as no hand means to reject only the best designs.
  const NEAR = 0.1
  const between = ({role, maximize, range}, scale, from, to) => [min(from, to), max(from, to)].map((share, k) => {
    const inside = (at) => (k ? 1 - at : at)
    const isBetter = role === "objective" && maximize === Boolean(k)
    return inside(share) > (isBetter ? inside(place(scale)(range[k])) + NEAR : 0) ? valueAt(scale, share) : null
  })
  // Distances are measured from the U and N of what is left: they move with the limits.
  const isGeometric = ({role}) => role === "geometric"
  const limitable = (column) => !column.texts && !isGeometric(column)

  // Steps of 1, 2 or 5 times a power of ten; on a log axis over decades powers of ten.
  function ticks({low, high, log}, most) {
    if (!(high > low)) return [low]
    if (log && high / low >= 100) {
      const [first, last] = [ceil(log10(low) - 1e-9), floor(log10(high) + 1e-9)]
      const every = ceil((last - first + 1) / most)
      return Array.from({length: floor((last - first) / every) + 1}, (_, k) => 10 ** (first + k * every))
    }
    const rough = (high - low) / most
    const power = 10 ** floor(log10(rough))
    const step = power * [1, 2, 5, 10].find((factor) => factor * power >= rough * 0.999)
    const first = ceil(low / step - 1e-9)
    const count = floor(high / step + 1e-9) - first
    if (count < 1 && most < 20) return ticks({low, high}, 2 * most) // a single number tells no distance
    // A product of integers and the power, so that 0.3 is not 0.30000000000000004.
    return Array.from({length: count + 1}, (_, k) => Number(((first + k) * step).toPrecision(12)))
  }

  const SUPERSCRIPT = {"-": "⁻", ...Object.fromEntries([..."⁰¹²³⁴⁵⁶⁷⁸⁹"].map((c, k) => [k, c]))}
  const raised = (power) => [...String(power)].map((c) => SUPERSCRIPT[c]).join("")

  // Ticks as texts, and the power of ten by which a name is followed: 1.2 with "×10⁶" reads better
  // in a narrow column than 1200000.
  function tickTexts(scale, most, texts) {
    if (texts) {
      const known = [...texts.keys()].filter((k) => k >= scale.low && k <= scale.high)
      const every = ceil(known.length / most)
      const values = known.filter((_, k) => k % every === 0)
      return {values, texts: values.map((k) => (texts[k].length > 18 ? `${texts[k].slice(0, 17)}…` : texts[k])), factor: ""}
    }
    const values = ticks(scale, most)
    const size = max(abs(scale.low), abs(scale.high))
    const decades = scale.log && scale.high / scale.low >= 100
    const power = size > 0 && (size >= 1e5 || size < 1e-2) && !decades ? 3 * floor(log10(size) / 3) : 0
    const digits = values.length > 1 ? 12 : 6 // all that a tick has; a single one is any number
    const powers = decades && (scale.high >= 1e5 || scale.low < 1e-3)
    const short = (value) => powers ? `10${raised(round(log10(value)))}`
      : Logic.apart(Logic.local(String(Number((value / 10 ** power).toPrecision(digits))))).replace("-", "−")
    return {values, texts: values.map(short), factor: power ? `×10${raised(power)}` : ""}
  }

  // Canvases on top of each other that fill their parent; redraw is called when its size changes.
  function layers(parent, count, redraw) {
    const canvases = Array.from({length: count}, () => document.createElement("canvas"))
    for (const canvas of canvases) canvas.setAttribute("aria-hidden", "true")
    parent.append(...canvases)
    const size = {width: 0, height: 0, inView: true}
    const fit = () => {
      const [width, height] = [parent.clientWidth, parent.clientHeight]
      if (width === size.width && height === size.height) return
      Object.assign(size, {width, height})
      for (const canvas of canvases) {
        canvas.width = round(width * devicePixelRatio)
        canvas.height = round(height * devicePixelRatio)
        // Once: a font makes the browser style the whole page.
        Object.assign(canvas.getContext("2d"), {font: FONT, lineJoin: "round"})
      }
      redraw()
    }
    const clean = (k) => {
      const g = canvases[k].getContext("2d")
      g.setTransform(devicePixelRatio, 0, 0, devicePixelRatio, 0, 0)
      g.clearRect(0, 0, size.width, size.height)
      g.globalAlpha = 1
      return g
    }
    new ResizeObserver(fit).observe(parent)
    new IntersectionObserver(([entry]) => { size.inView = entry.isIntersecting }).observe(parent)
    fit()
    return {size, clean, fit, top: canvases[count - 1]}
  }

  function ruled(g, colour, x0, y0, x1, y1) {
    g.strokeStyle = colour
    g.lineWidth = 1
    g.beginPath()
    g.moveTo(x0, y0)
    g.lineTo(x1, y1)
    g.stroke()
  }

  function written(g, text, x, y, align, baseline = "middle", colour = INK.muted) {
    g.textAlign = align
    g.textBaseline = baseline
    g.lineWidth = 3
    g.strokeStyle = INK.panel // a halo, legible above lines
    g.strokeText(text, x, y)
    g.fillStyle = colour
    g.fillText(text, x, y)
  }

  // A text of which, where it is too long, the end stays: it is what tells names apart.
  function fitted(g, text, width) {
    let most = text.length
    const cut = () => (most < text.length ? `${text.slice(0, max(1, most - 4))}…${text.slice(-3)}` : text)
    while (most > 5 && g.measureText(cut()).width > width) most--
    return cut()
  }

  // How many of some rows lie below an axis, above it, and nowhere, as their value is missing.
  function beyond(column, values, rows, {low, high}) {
    const counts = [0, 0, 0]
    if (column.values) { // most columns have none, which is known once
      column.ends ??= [1, -1].map((sign) => Logic.endOf(values, sign))
      column.isWhole ??= values.every((value) => value === value)
      if (column.isWhole && column.ends[0] >= low && column.ends[1] <= high) return counts
    }
    for (let k = 0; k < rows.length; k++) {
      const value = values[rows[k]]
      if (value < low) counts[0]++
      else if (value > high) counts[1]++
      else if (value !== value) counts[2]++
    }
    return counts
  }

  // The rows whose names are written: those marked, the last first, and all where they are few.
  const namedRows = ({marks, left}) =>
    [...new Set([...marks.map(({row}) => row).reverse(), ...(left.length <= MOST_NAMES ? left : [])])]

  // The rows by the colour in which they are drawn.
  function byColour({hues}, rows) {
    if (!hues) return [[LOOKS.other.colour, rows]]
    const groups = new Map()
    for (const row of rows) {
      const {colour} = hues(row)
      groups.has(colour) ? groups.get(colour).push(row) : groups.set(colour, [row])
    }
    return [...groups]
  }

  // Many marks as a density: the more of them cover a pixel, the darker it is, and one alone can be
  // seen. The pixels are counted here, as thousands of strokes would take the browser fifty times as
  // long. Former counts on the same axes, by colour or of the context, are mended by the rows that
  // come and go.
  //   count(counts, rows, step) adds a step where a mark begins in a column of pixels, from the top,
  //   and takes it away below its end
  const DARKEST = 1000 // marks at a pixel
  function clouds(g, groups, total, [least, alpha], count, former) {
    const {width, height} = g.canvas
    if (!width || !height) return
    const many = 2 ** ceil(Math.log2(Logic.sum(groups.map(([, rows]) => rows.length)) || 1))
    for (const [colour, rows] of groups) {
      const drawn = new Uint8Array(total)
      for (let k = 0; k < rows.length; k++) drawn[rows[k]] = 1
      const context = former.get(INK.context)
      const last = former.get(colour) ?? (context && {...context, image: null, counts: context.counts.slice()})
      const come = last ? Logic.picked(rows, (row) => !last.drawn[row]) : rows
      const go = last ? Logic.picked(last.rows, (row) => !drawn[row]) : []
      const isNew = !last || come.length + go.length >= rows.length
      const counts = isNew ? new Int32Array(width * (height + 1)) : last.counts
      count(counts, isNew ? rows : come, 1)
      if (!isNew) count(counts, go, -1)
      const [red, green, blue] = [1, 3, 5].map((k) => parseInt(colour.slice(k, k + 2), 16))
      const shades = new Uint32Array(DARKEST + 1)
      for (let k = 1, light = 1 - least; k <= DARKEST; k++, light *= 1 - min(0.5, alpha / many)) {
        shades[k] = (round(255 * (1 - light)) << 24) | (blue << 16) | (green << 8) | red
      }
      const image = last?.image ?? new ImageData(width, height)
      const pixels = new Uint32Array(image.data.buffer)
      const marks = new Int32Array(width)
      for (let from = 0; from < pixels.length; from += width) {
        for (let x = 0; x < width; x++) {
          const many = marks[x] += counts[from + x]
          pixels[from + x] = shades[many < DARKEST ? many : DARKEST]
        }
      }
      former.set(colour, {image, counts, rows, drawn})
      if (groups.length === 1) g.putImageData(image, 0, 0)
      else { // above one another
        const canvas = new OffscreenCanvas(width, height)
        canvas.getContext("2d").putImageData(image, 0, 0)
        g.save()
        g.resetTransform()
        g.drawImage(canvas, 0, 0)
        g.restore()
      }
    }
  }

  // A drag on an element: down(x, y) returns {move(x, y), up(x, y, moved)}. Places are those of
  // the start, as what a drag changes may move the element itself.
  function drag(element, down) {
    element.onpointerdown = (event) => {
      if (event.button !== 0) return
      const box = element.getBoundingClientRect()
      const at = (e) => [e.clientX - box.left, e.clientY - box.top]
      const job = down(...at(event))
      let moved = false // a hand that shakes by a pixel does not drag
      const move = (e) => {
        moved ||= hypot(e.clientX - event.clientX, e.clientY - event.clientY) > 4
        if (moved) job.move(...at(e))
      }
      const end = (e) => {
        element.onpointermove = element.onpointerup = element.onpointercancel = null
        job.up(...at(e), moved)
      }
      event.preventDefault()
      element.setPointerCapture(event.pointerId)
      element.onpointermove = move
      element.onpointerup = element.onpointercancel = end
    }
  }

  // The drawn row that is nearest by a distance in pixels, at most so far; -1 if there is none.
  function nearestRow(model, most, distance) {
    let [best, least] = [-1, most]
    for (const row of [...model.left, ...model.marks.map((mark) => mark.row)]) {
      const away = distance(row)
      if (away <= least) [best, least] = [row, away]
    }
    return best
  }

  // Parallel coordinates. A drag along an axis sets its limits. Objectives get better downwards.
  //   on = {limit([[column, [low, high]], …], done), pick(row), hover(row, x, y)}
  function parallel(parent, axes, on) {
    const [TOP, BOTTOM] = [22, 50]
    let RIGHT = 100 // for names
    const heads = document.createElement("div")
    heads.className = "heads"
    const plot = document.createElement("div")
    plot.className = "plot"
    parent.append(heads, plot)
    let [model, marked, context] = [null, -1, null]
    const former = new Map() // densities
    let boxes = [] // the boxes of the names
    const {size, clean, fit, top} = layers(plot, 4, () => model && draw(true))

    const xOf = (j) => ((j + 0.5) * (size.width - RIGHT)) / axes.length
    const nearest = (x) => min(axes.length - 1, max(0, floor((x * axes.length) / (size.width - RIGHT))))
    const height = () => size.height - TOP - BOTTOM
    // The greatest value of an objective to be maximised is at the bottom: down is better.
    const flipped = (column) => column.role === "objective" && column.maximize
    const shareAt = (column, y) => {
      const up = min(1, max(0, (size.height - BOTTOM - y) / height()))
      return flipped(column) ? 1 - up : up
    }
    function placed(column) {
      const share = place(model.scale(column))
      const flip = flipped(column)
      return (value) => {
        const up = flip ? 1 - share(value) : share(value)
        return size.height - BOTTOM - up * height()
      }
    }

    // Every axis needs room for its name and numbers; beyond that the chart scrolls.
    parent.style.minWidth = `${58 * axes.length + RIGHT}px`
    heads.style.paddingRight = `${RIGHT}px`
    for (const {label} of axes) {
      const head = document.createElement("span")
      head.append(...broken(label))
      head.title = label
      heads.append(head)
    }

    // Single lines, drawn by the browser.
    function lines(g, rows, style) {
      const places = axes.map((column) => [model.values(column), placed(column)])
      for (const row of rows) {
        Object.assign(g, style)
        g.beginPath()
        let pen = false
        places.forEach(([values, at], j) => {
          const known = values[row] === values[row]
          if (known) pen ? g.lineTo(xOf(j), at(values[row])) : g.moveTo(xOf(j), at(values[row]))
          pen = known
        })
        g.stroke()
      }
      g.globalAlpha = 1
    }

    // Plain lines: a few as the browser draws them best, many as a density.
    function plain(g, groups, least) {
      const many = Logic.sum(groups.map(([, rows]) => rows.length))
      if (many > MOST_LINES) return clouds(g, groups, model.total, [least, 120], countLines, former)
      for (const [colour, rows] of groups) lines(g, rows, {strokeStyle: colour, globalAlpha: many > 40 ? 0.5 : 0.75, lineWidth: 1})
    }

    function countLines(counts, rows, step) {
      const {width} = top
      for (let j = 0; j + 1 < axes.length; j++) {
        const [x0, x1] = [xOf(j), xOf(j + 1)].map((x) => round(x * devicePixelRatio))
        const [[left, from], [right, to]] = [j, j + 1].map((k) => [model.values(axes[k]), placed(axes[k])])
        for (let i = 0; i < rows.length; i++) {
          const row = rows[i]
          if (left[row] !== left[row] || right[row] !== right[row]) continue
          // Half a pixel up, so that cutting the fraction off rounds.
          let y = from(left[row]) * devicePixelRatio + 0.5
          const slope = (to(right[row]) * devicePixelRatio + 0.5 - y) / (x1 - x0)
          let at = y | 0
          for (let x = x0; x < x1; x++) {
            y += slope
            const next = y | 0
            counts[(at < next ? at : next) * width + x] += step
            counts[((at < next ? next : at) + 1) * width + x] -= step
            at = next
          }
        }
      }
    }

    function drawLeft() {
      const g = clean(1)
      plain(g, byColour(model, model.left), 0.2)
      drawMarks(g)
    }

    // Above all lines, so that the numbers can be read. Each axis has its end values.
    function drawAxes() {
      const g = clean(2)
      const room = (size.width - RIGHT) / axes.length - 8
      axes.forEach((column, j) => {
        const [x, at, scale] = [xOf(j), placed(column), model.scale(column)]
        ruled(g, INK.field, x, TOP, x, size.height - BOTTOM)
        const {values, texts, factor} = tickTexts(scale, column.texts ? 14 : 5, column.texts)
        const ends = [scale.low, scale.high].map(at)
        values.forEach((value, k) => {
          if (!column.texts && ends.some((end) => abs(at(value) - end) < 13)) return
          g.fillStyle = INK.field
          g.fillRect(x - 2, at(value) - 2, 4, 4) // no line: before a number it would be a minus
          written(g, texts[k], x + 6, at(value), "left")
        })
        const low = max(...ends)
        ;[scale.low, scale.high].forEach((value, k) => written(g, fitted(g, model.written(column, value), room), x, ends[k] + (ends[k] === low ? 9 : -9), "center"))
        const feet = [column.role === "objective" ? "↓ better" : "", column.texts ? "" : factor && `ticks ${factor}`].filter(Boolean)
        feet.forEach((text, k) => written(g, text, x, size.height - 26 + 14 * k, "center"))
      })
    }

    // The numbers of designs beyond the axes, and the names at the end of their lines.
    function drawNames(g) {
      const last = axes.at(-1)
      axes.forEach((column, j) => {
        const [at, scale] = [placed(column), model.scale(column)]
        const counts = beyond(column, model.values(column), model.left, scale)
        ;[scale.low, scale.high].forEach((value, k) => {
          const up = at(value) < size.height / 2
          if (counts[k]) written(g, `${up ? "▲" : "▼"}${counts[k]}`, xOf(j) + 6, at(value) + (up ? 5 : -5), "left", "middle", INK.accent)
        })
      })
      const [x, at, values] = [xOf(axes.length - 1), placed(last), model.values(last)]
      const most = floor((size.height - 24) / 14)
      const names = namedRows(model).slice(0, most).filter((row) => values[row] === values[row])
        .map((row) => ({row, y: at(values[row])})).sort((a, b) => a.y - b.y)
      let free = 8
      for (const name of names) free = (name.at = max(name.y, free)) + 14
      free = size.height - 16
      for (const name of names.reverse()) free = (name.at = min(name.at, free)) - 14
      boxes = names.map(({row, y, at}) => {
        const isMark = model.marks.some((mark) => mark.row === row)
        const left = size.width - RIGHT + 2
        const text = fitted(g, model.named(row), RIGHT - 4)
        ruled(g, INK.context, x + 3, y, left - 3, at)
        written(g, text, left, at, "left", "middle", isMark ? INK.text : INK.muted)
        return {row, x: left, y: at - 6, width: g.measureText(text).width, height: 12}
      })
    }

    function drawMarks(g) {
      for (const {row, look} of model.marks) {
        const {colour} = LOOKS[look]
        const width = look === "best" ? 3 : 2
        g.setLineDash({prototype: [6, 4], pinned: [2, 3], inspected: [9, 3]}[look] ?? [])
        lines(g, [row], {strokeStyle: colour, lineWidth: width})
      }
      g.setLineDash([])
      axes.forEach((column, j) => {
        const limit = model.limit(column)
        if (!limit) return
        const {low, high} = model.scale(column)
        const at = placed(column)
        const [a, b] = [at(limit[0] ?? low), at(limit[1] ?? high)]
        g.fillStyle = INK.accent
        g.globalAlpha = 0.28
        g.fillRect(xOf(j) - 6, min(a, b), 12, abs(a - b))
        g.globalAlpha = 1
        for (const [end, y] of [[limit[0], a], [limit[1], b]]) {
          if (end !== null) g.fillRect(xOf(j) - 8, y - 1, 16, 2)
        }
      })
      drawNames(g)
    }

    function draw(all) {
      if (!size.width) return
      if (all) {
        former.clear()
        drawAxes()
      }
      if (all || context !== model.context) plain(clean(0), [[INK.context, context = model.context]], 0.5)
      drawLeft()
      if (marked >= 0) mark(-1)
    }

    function mark(row) {
      marked = row
      const g = clean(3)
      if (row >= 0) lines(g, [row], {strokeStyle: INK.text, lineWidth: 2.5})
    }

    // The row whose line passes nearest to a point, within a few pixels.
    function rowAt(x, y) {
      const name = boxes.find((box) => x >= box.x && abs(y - box.y - 6) < 7)
      if (name) return name.row
      const position = min(axes.length - 1, max(0, (x * axes.length) / (size.width - RIGHT) - 0.5))
      const j = min(floor(position), max(0, axes.length - 2))
      const sides = [axes[j], axes[min(j + 1, axes.length - 1)]].map((c) => [model.values(c), placed(c)])
      return nearestRow(model, 7, (row) => {
        const [a, b] = sides.map(([values, at]) => at(values[row]))
        return abs(a + (b - a) * (position - j) - y)
      })
    }

    drag(top, (x, y) => {
      const j = nearest(x)
      const column = axes[j]
      // On a touch screen a drag scrolls the page: only from the axis itself it is a brush.
      if (abs(x - xOf(j)) > 16 || !limitable(column)) {
        return {move: () => 0, up: (u, v, moved) => !moved && on.pick(rowAt(u, v))}
      }
      const from = shareAt(column, y)
      const to = (v) => between(column, model.scale(column), from, shareAt(column, v))
      return {
        move: (_, v) => on.limit([[column, to(v)]], false),
        // A click on the axis takes its limit away.
        up: (_, v, moved) => on.limit([[column, moved ? to(v) : [null, null]]], true),
      }
    })
    top.addEventListener("pointermove", (event) => { // a brush takes onpointermove
      if (event.buttons || !model) return
      const j = nearest(event.offsetX)
      top.style.cursor = abs(event.offsetX - xOf(j)) <= 16 && limitable(axes[j]) ? "ns-resize" : "default"
      on.hover(rowAt(event.offsetX, event.offsetY), event.clientX, event.clientY)
    })
    top.onpointerleave = () => on.hover(-1)
    return {mark, draw: (next, all) => { model = next; if (all) fit(); draw(all) },
      get names() { return boxes }, get drawn() { return model.left.length }, get inView() { return size.inView }}
  }

  // A scatter plot of two columns. A drag sets the limits of both, those of a box; `on` is as above.
  function scatter(parent, on) {
    const [TOP, RIGHT, BOTTOM] = [8, 14, 40]
    let LEFT = 68
    let [x, y, model, context] = [null, null, null, null]
    let [boxes, drawn] = [[], {}]
    const former = new Map() // densities
    let half // half the side of a square
    const {size, clean, top} = layers(parent, 3, () => model && draw(true))
    const frame = () => [size.width - LEFT - RIGHT, size.height - TOP - BOTTOM]

    // Points on the ends of an axis are drawn whole: a little room around.
    function scales() {
      return [x, y].map((column) => {
        const {low, high, log} = model.scale(column)
        const room = log ? (high / low) ** 0.03 : 0.03 * (high - low) || abs(high) * 0.03 || 1
        return log ? {low: low / room, high: high * room, log} : {low: low - room, high: high + room, log}
      })
    }
    function placed() {
      const [w, h] = frame()
      const [across, up] = scales().map((scale) => place(scale, 0))
      const [xs, ys] = [model.values(x), model.values(y)]
      const at = (row) => [at.u(row), at.v(row)]
      at.u = (row) => LEFT + across(xs[row]) * w
      at.v = (row) => TOP + (1 - up(ys[row])) * h
      return at
    }
    const isKnown = ([u, v]) => u === u && v === v

    function drawContext(all) {
      const g = clean(0)
      const [across, up] = scales()
      const ty = tickTexts(up, max(2, frame()[1] / (y.texts ? 15 : 45)), y.texts)
      LEFT = ceil(max(52, ...ty.texts.map((text) => g.measureText(text).width + 10))) + 16
      const [w, h] = frame()
      if (all) {
        former.clear()
        half = round((model.total > 5000 ? 1 : 1.5) * devicePixelRatio)
      }
      points(g, [[INK.context, context = model.context]]) // below all else
      const tx = tickTexts(across, max(2, w / (x.texts ? 120 : 80)), x.texts)
      const [px, py] = [place(across), place(up)]
      tx.values.forEach((value, k) => {
        const u = LEFT + px(value) * w
        ruled(g, INK.grid, u, TOP, u, TOP + h)
        written(g, tx.texts[k], u, TOP + h + 8, "center", "top")
      })
      ty.values.forEach((value, k) => {
        const v = TOP + (1 - py(value)) * h
        ruled(g, INK.grid, LEFT, v, LEFT + w, v)
        written(g, ty.texts[k], LEFT - 6, v, "right")
      })
      g.strokeStyle = INK.field
      g.lineWidth = 1
      g.strokeRect(LEFT, TOP, w, h)
      const title = ({name, label, role, maximize}, factor, length) => {
        const better = role !== "objective" ? "" : maximize ? " better →" : " ← better"
        const end = `${label.slice(name.length)} ${factor}`.trimEnd() + better // is not cut
        return fitted(g, name, length - g.measureText(end).width) + end
      }
      written(g, title(x, tx.factor, w), LEFT + w / 2, size.height - 8, "center")
      g.translate(9, TOP + h / 2)
      g.rotate(-Math.PI / 2)
      written(g, title(y, ty.factor, h), 0, 0, "center")
    }

    // Points as squares of a density.
    function points(g, groups) {
      const {u: across, v: up} = placed()
      const {width} = g.canvas
      const squares = (counts, rows, step) => {
        for (let k = 0; k < rows.length; k++) {
          const [u, v] = [across(rows[k]), up(rows[k])]
          if (u !== u || v !== v) continue
          const first = round(v * devicePixelRatio - half) * width + round(u * devicePixelRatio - half)
          for (let i = first; i <= first + 2 * half; i++) {
            counts[i] += step
            counts[i + (2 * half + 1) * width] -= step
          }
        }
      }
      clouds(g, groups, model.total, [0.5, 2000], squares, former)
    }

    function drawLeft() {
      const g = clean(1)
      const at = placed()
      const {left, marks} = model
      const few = left.length <= MOST_SHAPES
      if (!few) points(g, byColour(model, left))
      for (const row of few ? left : model.hues ? [] : model.near) {
        const look = model.look(row)
        const spot = at(row)
        const size = look === "other" && left.length > 100 ? {size: 2} : {}
        if (isKnown(spot)) shape(g, model.hues?.(row) ?? {...LOOKS[look], ...size}, ...spot)
      }
      drawLimits(g)
      for (const {row, look} of marks) if (isKnown(at(row))) shape(g, LOOKS[look], ...at(row))
      drawEdges(g)
      boxes = names(g, at)
    }

    // What lies beyond an axis is at its end: how many there are, and how many have no value.
    function drawEdges(g) {
      const [w, h] = frame()
      const [across, up] = [x, y].map((column, k) => beyond(column, model.values(column), model.left, scales()[k]))
      const ends = [[across[0], "◂ beyond", LEFT + 4, TOP + h / 2, "left"], [across[1], "beyond ▸", LEFT + w - 4, TOP + h / 2, "right"],
        [up[1], "beyond ▴", LEFT + w / 2, TOP + 9, "center"], [up[0], "beyond ▾", LEFT + w / 2, TOP + h - 9, "center"]]
      for (const [count, word, u, v, align] of ends) if (count) written(g, `${count} ${word}`, u, v, align, "middle", INK.accent)
      const [xs, ys] = [model.values(x), model.values(y)]
      let missing = 0
      if (across[2] + up[2]) for (const row of model.left) if (xs[row] !== xs[row] || ys[row] !== ys[row]) missing++
      if (missing) written(g, `${missing} without a value`, LEFT + w - 4, TOP + h - 9, "right")
      drawn = {points: model.left.length - missing, missing, beyond: [...across.slice(0, 2), ...up.slice(0, 2)]}
    }

    // Names beside their points, where they cover neither one another nor a point that has a name. A
    // line leads to one that is farther off; one without room is left out.
    function names(g, at) {
      const rows = namedRows(model)
      const spots = new Map(rows.map((row) => [row, at(row)]).filter(([, spot]) => isKnown(spot)))
      const [w, h] = frame()
      const taken = [...spots.values()].map(([u, v]) => ({x: u - 5, y: v - 5, width: 10, height: 10}))
      const hits = (a) => taken.some((b) => a.x < b.x + b.width && b.x < a.x + a.width && a.y < b.y + b.height && b.y < a.y + a.height)
      const found = []
      for (const [row, [u, v]] of spots) {
        const text = fitted(g, model.named(row), 120)
        const width = g.measureText(text).width
        const isMark = model.marks.some((mark) => mark.row === row)
        const places = [10, 18, 30, 46].flatMap((r) => [[r, r, -6], [r, -r - width, -6], [r, -width / 2, -r - 8], [r, -width / 2, r - 4]])
        for (const [r, dx, dy] of places) {
          const box = {row, x: u + dx, y: v + dy, width, height: 12}
          if (box.x < LEFT + 2 || box.x + width > LEFT + w - 2 || box.y < TOP + 1 || box.y + 12 > TOP + h - 1 || hits(box)) continue
          if (r > 18) ruled(g, INK.field, u, v, min(max(u, box.x), box.x + width), min(max(v, box.y), box.y + 12))
          written(g, text, box.x, box.y + 6, "left", "middle", isMark ? INK.text : INK.muted)
          taken.push(box)
          found.push(box)
          break
        }
      }
      return found
    }

    // Lines at the limits in force.
    function drawLimits(g) {
      const [w, h] = frame()
      scales().forEach((scale, k) => {
        for (const end of model.limit([x, y][k]) ?? []) {
          const share = end === null ? -1 : place(scale)(end)
          if (share < 0 || share > 1) continue
          const [u, v] = [LEFT + share * w, TOP + (1 - share) * h]
          k ? ruled(g, INK.accent, LEFT, v, LEFT + w, v) : ruled(g, INK.accent, u, TOP, u, TOP + h)
        }
      })
    }

    function mark(row) {
      const g = clean(2)
      const spot = row >= 0 ? placed()(row) : null
      if (spot && isKnown(spot)) shape(g, {shape: "ring", size: 10, colour: INK.accent}, ...spot)
    }

    function draw(all) {
      if (!size.width || !x) return
      all ||= [x, y].some(isGeometric)
      if (all || context !== model.context) drawContext(all)
      drawLeft()
    }

    function rowAt(u, v) {
      const at = placed()
      const name = boxes.find((box) => u >= box.x && u <= box.x + box.width && v >= box.y && v <= box.y + box.height)
      return name ? name.row : nearestRow(model, 9, (row) => {
        const [a, b] = at(row)
        return hypot(a - u, b - v)
      })
    }

    // What is dragged along one axis sets no limit of the other.
    const limits = (u, v, a, b) => {
      const [[w, h], [across, up]] = [frame(), scales()]
      const sides = [[x, a - u, across, (u - LEFT) / w, (a - LEFT) / w], [y, b - v, up, 1 - (v - TOP) / h, 1 - (b - TOP) / h]]
      return sides.filter(([column, way]) => limitable(column) && abs(way) > 4)
        .map(([column, , ...share]) => [column, between(column, ...share)])
    }
    drag(top, (u, v) => ({
      move: (a, b) => on.limit(limits(u, v, a, b), false),
      up: (a, b, moved) => (moved ? on.limit(limits(u, v, a, b), true) : on.pick(rowAt(a, b))),
    }))
    top.addEventListener("pointermove", (event) => { // a brush takes onpointermove
      if (!event.buttons && model) on.hover(rowAt(event.offsetX, event.offsetY), event.clientX, event.clientY)
    })
    top.onpointerleave = () => on.hover(-1)
    return {
      setAxes: (across, up) => { [x, y] = [across, up] },
      draw: (next, all) => { model = next; draw(all) },
      mark,
      spot: (row) => placed()(row),
      get names() { return boxes },
      get inView() { return size.inView },
      get drawn() { return drawn },
    }
  }

  return {LOOKS, HUES, dye, broken, icon, parallel, scatter, place, valueAt, tickTexts}
})()
