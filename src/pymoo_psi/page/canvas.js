// Drawing on canvas: layers, texts, densities, drags and pictures to copy.

const FONT = `12px ${getComputedStyle(document.body).fontFamily}`

// Canvases on top of each other that fill their parent; redraw is called when its size changes.
function layers(parent, count, redraw) {
  const canvases = Array.from({length: count}, () => make("canvas", {ariaHidden: true}))
  parent.append(...canvases)
  const size = {width: 0, height: 0}
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
    if (verdict !== undefined) redraw()
  }
  const clean = (k) => {
    const g = canvases[k].getContext("2d")
    g.setTransform(devicePixelRatio, 0, 0, devicePixelRatio, 0, 0)
    g.clearRect(0, 0, size.width, size.height)
    g.globalAlpha = 1
    return g
  }
  new ResizeObserver(fit).observe(parent)
  fit()
  return {size, clean, fit}
}

function drawLine(g, colour, x0, y0, x1, y1, lineWidth = 1) {
  Object.assign(g, {strokeStyle: colour, lineWidth})
  g.beginPath()
  g.moveTo(x0, y0)
  g.lineTo(x1, y1)
  g.stroke()
}

function drawText(g, text, x, y, textAlign, colour = INK.muted, textBaseline = "middle") {
  Object.assign(g, {textAlign, textBaseline, lineWidth: 5, strokeStyle: INK.panel, fillStyle: colour})
  g.strokeText(text, x, y) // a halo, legible above lines
  g.fillText(text, x, y)
}

// What a limit rejects: one path, as single lines take the browser much longer.
function drawHatch(g, x, y, width, height) {
  g.beginPath()
  for (let at = 6 - height; at < width; at += 6) {
    const [from, to] = [max(0, at), min(width, at + height)] // where a line enters and leaves the box
    g.moveTo(x + from, y + height + at - from)
    g.lineTo(x + to, y + height + at - to)
  }
  Object.assign(g, {strokeStyle: INK.context, lineWidth: 1})
  g.stroke()
}

// A text in lines that are at most so wide; a longer word is a line.
function wrapped(g, text, width) {
  const lines = []
  for (const word of text.split(" ")) {
    const longer = lines.length ? `${lines.at(-1)} ${word}` : word
    if (lines.length && g.measureText(longer).width <= width) lines[lines.length - 1] = longer
    else lines.push(word)
  }
  return lines
}

// The rows by the colour in which they are drawn.
const byColour = (rows) => hues ? [...Map.groupBy(rows, (row) => hues(row).colour)] : [[LOOKS.other.colour, rows]]

// Many marks as a density: the more of them cover a pixel, the darker it is, and one alone can be
// seen. The pixels are counted here, as thousands of strokes would take the browser fifty times as
// long. Former counts on the same axes, by colour, are mended by the rows that come and go.
//   count(counts, line, rows, step) adds a step where a mark begins in a line of pixels, from the left,
//   and takes it away behind its end; line is the numbers of a line, one more than pixels
const DARKEST = 1000 // marks at a pixel
function drawDensity(g, groups, total, [least, alpha], count, former) {
  const {width, height} = g.canvas
  if (!width || !height) return
  const many = 2 ** ceil(Math.log2(sum(groups.map(([, rows]) => rows.length)) || 1))
  for (const [colour, rows] of groups) {
    const last = former.get(colour) ?? {rows: [], drawn: new Uint8Array(total), counts: new Int32Array((width + 1) * height), image: new ImageData(width, height)}
    const {counts, image} = last
    const drawn = new Uint8Array(total)
    for (const row of rows) drawn[row] = 1
    count(counts, width + 1, picked(rows, (row) => !last.drawn[row]), 1)
    count(counts, width + 1, picked(last.rows, (row) => !drawn[row]), -1)
    const [red, green, blue] = [1, 3, 5].map((k) => parseInt(colour.slice(k, k + 2), 16))
    const shades = new Uint32Array(DARKEST + 1)
    for (let k = 1, light = 1 - least; k <= DARKEST; k++, light *= 1 - min(0.5, alpha / many)) {
      shades[k] = (round(255 * (1 - light)) << 24) | (blue << 16) | (green << 8) | red
    }
    const pixels = new Uint32Array(image.data.buffer)
    for (let y = 0, from = 0, at = 0; y < height; y++, from++) {
      let marks = 0
      for (const end = at + width; at < end; at++) {
        marks += counts[from++]
        pixels[at] = shades[marks < DARKEST ? marks : DARKEST]
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

// A box of a mark.
function countBox(counts, line, left, top, width, height, step) {
  const first = top * line + left
  for (let at = first; at < first + height * line; at += line) {
    counts[at] += step
    counts[at + width] -= step
  }
}

// A drag on an element: down(x, y, event) returns {move(x, y), up(x, y, moved)}, or null where nothing
// is to be dragged. Places are those of the start, as what a drag changes may move the element itself.
function onDrag(element, down) {
  element.onpointerdown = (event) => {
    if (event.button !== 0) return
    const box = element.getBoundingClientRect()
    const at = (e) => [e.clientX - box.left, e.clientY - box.top]
    const job = down(...at(event), event)
    if (!job) return
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

// The limit that a drag from one share of an axis to another sets. It is open at the ends of the axis,
// and near the best value of an objective, as no hand means to reject only the best designs.
const NEAR_BEST = 0.1
const between = (column, scale, from, to) => [min(from, to), max(from, to)].map((share, k) => {
  const inside = (at) => (k ? 1 - at : at)
  const isBetter = isObjective(column) && column.maximize === Boolean(k)
  const isOpen = inside(share) <= (isBetter ? inside(shareOn(scale)(column.range[k])) + NEAR_BEST : 0)
  return isOpen ? null : readable(column, valueAt(scale, share))
})

// The drawn row that is nearest by a distance in pixels, at most so far; -1 if there is none.
function nearestRow(most, distance) {
  let [best, least] = [-1, most]
  for (const row of [...shownRows, ...marked]) {
    const away = distance(row)
    if (away <= least) [best, least] = [row, away]
  }
  return best
}

// A part of the page as a picture: its canvases, bars and texts where they stand.
function picture(section) {
  const box = section.getBoundingClientRect()
  const scale = 2
  const canvas = make("canvas", {width: scale * box.width, height: scale * box.height})
  const g = canvas.getContext("2d")
  g.setTransform(scale, 0, 0, scale, -scale * box.left, -scale * box.top)
  g.fillStyle = INK.panel
  g.fillRect(box.left, box.top, box.width, box.height)
  for (const part of section.querySelectorAll("canvas, .bar, .bar i")) {
    const {left, top, width, height} = part.getBoundingClientRect()
    g.fillStyle = getComputedStyle(part).backgroundColor
    part.width ? g.drawImage(part, left, top, width, height) : g.fillRect(left, top, width, height)
  }
  const draw = (element, text, {left, top, bottom}) => {
    if (!element.checkVisibility() || element.closest("button, option, details, .unseen, .other:not(.on)")) return
    const {fontWeight, fontSize, fontFamily, color} = getComputedStyle(element)
    Object.assign(g, {font: `${fontWeight} ${fontSize} ${fontFamily}`, fillStyle: color, textBaseline: "middle"})
    g.fillText(text, left, (top + bottom) / 2)
  }
  const range = document.createRange()
  const texts = document.createTreeWalker(section, NodeFilter.SHOW_TEXT)
  while (texts.nextNode()) {
    const {currentNode: node} = texts
    for (const {0: word, index} of node.data.matchAll(/\S+/g)) {
      range.setStart(node, index)
      range.setEnd(node, index + word.length)
      draw(node.parentElement, word, range.getBoundingClientRect())
    }
  }
  for (const field of section.querySelectorAll("select, input[type=text]")) {
    draw(field, field.selectedOptions?.[0].text ?? ` ${field.value}`, field.getBoundingClientRect())
  }
  return canvas
}
