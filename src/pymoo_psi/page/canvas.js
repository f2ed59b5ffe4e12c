// Drawing on canvas: layers, texts, densities, drags and pictures to copy.

const FONT = `12px ${getComputedStyle(document.body).fontFamily}`

// Canvases on top of each other that fill their parent as it was when `fit` was called last.
function layers(parent, count) {
  const canvases = Array.from({length: count}, () => make("canvas", {ariaHidden: true}))
  parent.append(...canvases)
  const size = {width: 0, height: 0}
  const fit = () => {
    const {clientWidth, clientHeight} = parent
    if (clientWidth === size.width && clientHeight === size.height) return
    size.width = clientWidth
    size.height = clientHeight
    for (const canvas of canvases) {
      canvas.width = round(clientWidth * devicePixelRatio)
      canvas.height = round(clientHeight * devicePixelRatio)
      // Once: a font makes the browser style the whole page.
      Object.assign(canvas.getContext("2d"), {font: FONT, lineJoin: "round"})
    }
  }
  const clean = (k) => {
    const g = canvases[k].getContext("2d")
    g.setTransform(devicePixelRatio, 0, 0, devicePixelRatio, 0, 0)
    g.clearRect(0, 0, size.width, size.height)
    return g
  }
  return {size, clean, fit}
}

// Draw anew when the size of an element changes.
function whenResized(element, redraw) {
  new ResizeObserver(() => { if (verdict !== undefined) redraw() }).observe(element)
}

function drawLine(g, colour, x0, y0, x1, y1, lineWidth = 1) {
  g.strokeStyle = colour
  g.lineWidth = lineWidth
  g.beginPath()
  g.moveTo(x0, y0)
  g.lineTo(x1, y1)
  g.stroke()
}

function drawText(g, text, x, y, textAlign, colour = INK.muted) {
  Object.assign(g, {textAlign, textBaseline: "middle", lineWidth: 5, strokeStyle: INK.panel, fillStyle: colour})
  g.strokeText(text, x, y) // a halo, legible above lines
  g.fillText(text, x, y)
}

// What a limit rejects: one path, as single lines take the browser much longer.
const boxOf = (x0, y0, x1, y1) => ({x: min(x0, x1), y: min(y0, y1), width: abs(x1 - x0), height: abs(y1 - y0)})
function drawHatch(g, {x, y, width, height}) {
  g.beginPath()
  for (let at = 6 - height; at < width; at += 6) {
    const from = max(0, at) // where a line enters and leaves the box
    const to = min(width, at + height)
    g.moveTo(x + from, y + height + at - from)
    g.lineTo(x + to, y + height + at - to)
  }
  g.strokeStyle = INK.context
  g.lineWidth = 1
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

// Many marks as a density: the more of them cover a pixel, the darker it is, and one alone can be
// seen. The pixels are counted here, as thousands of strokes would take the browser fifty times as
// long. The former density on the same axes is mended by the rows that come and go.
//   axes    a text that says where marks are
//   count(counts, line, rows, step) adds a step where a mark begins in a line of pixels, from the left,
//   and takes it away behind its end; line is the numbers of a line, one more than pixels
const DARKEST = 1000 // marks at a pixel
function drawDensity(g, axes, rows, [least, alpha], count) {
  const {width, height} = g.canvas
  if (g.density?.axes !== axes) {
    g.density = {axes, rows: [], drawn: new Uint8Array(data.total), counts: new Int32Array((width + 1) * height), image: new ImageData(width, height)}
  }
  const {counts, image, drawn: before, rows: last} = g.density
  const drawn = new Uint8Array(data.total)
  for (const row of rows) drawn[row] = 1
  count(counts, width + 1, picked(rows, (row) => !before[row]), 1)
  count(counts, width + 1, picked(last, (row) => !drawn[row]), -1)
  const [red, green, blue] = [1, 3, 5].map((k) => parseInt(LOOKS.other.colour.slice(k, k + 2), 16))
  const shades = new Uint32Array(DARKEST + 1)
  const step = 1 - min(0.5, alpha / 2 ** ceil(Math.log2(rows.length || 1)))
  for (let k = 1, light = 1 - least; k <= DARKEST; k++, light *= step) {
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
  g.putImageData(image, 0, 0)
  Object.assign(g.density, {rows, drawn})
}

// The drawn row that is nearest by a distance in pixels, at most so far; -1 if there is none.
function nearestRow(most, distance) {
  let best = -1
  for (const row of [...shownRows, ...marked]) {
    const away = distance(row)
    if (!(away <= most)) continue
    best = row
    most = away
  }
  return best
}

// A part of the page as a picture: its canvases, icons, bars and texts where they stand.
function picture(section) {
  section.classList.add("copied") // with its whole legend, without controls
  const box = section.getBoundingClientRect()
  const margin = 12
  const canvas = make("canvas", {width: 2 * (box.width + 2 * margin), height: 2 * (box.height + 2 * margin)})
  const g = canvas.getContext("2d")
  g.fillStyle = INK.panel
  g.fillRect(0, 0, canvas.width, canvas.height)
  g.scale(2, 2)
  g.translate(margin - box.x, margin - box.y)
  for (const part of section.querySelectorAll("canvas, .bar, .bar i, .icon")) {
    const {x, y, width, height} = part.getBoundingClientRect()
    g.fillStyle = getComputedStyle(part).backgroundColor
    if (part.look && width) drawShape(g, part.look, x + width / 2, y + width / 2)
    else if (part.getContext) g.drawImage(part, x, y, width, height)
    else g.fillRect(x, y, width, height)
  }
  g.textBaseline = "middle"
  const draw = (element, text, {x, y, height}, width) => {
    if (!element.checkVisibility({visibilityProperty: true})) return
    const {fontWeight, fontSize, fontFamily, color} = getComputedStyle(element)
    g.font = `${fontWeight} ${fontSize} ${fontFamily}`
    g.fillStyle = color
    g.letterSpacing = "0px"
    if (width) g.letterSpacing = `${(width - g.measureText(text).width) / text.length}px` // digits of one width, as on the page
    g.fillText(text, x, y + height / 2)
  }
  const range = document.createRange()
  const texts = document.createTreeWalker(section, NodeFilter.SHOW_TEXT)
  while (texts.nextNode()) {
    const {currentNode: node} = texts
    for (const {0: word, index} of node.data.matchAll(/\S+/g)) {
      range.setStart(node, index)
      range.setEnd(node, index + word.length)
      const spot = range.getBoundingClientRect()
      draw(node.parentElement, word, spot, spot.width)
    }
  }
  for (const field of section.querySelectorAll("select, input[type=text]")) {
    draw(field, field.selectedOptions?.[0].text ?? ` ${field.value}`, field.getBoundingClientRect())
  }
  section.classList.remove("copied")
  return canvas
}
