// How designs look. Shapes tell the same as colours, which page.css has, for light and dark.

const LOOKS = {
  other: {shape: "ring", size: 3.4},
  dominated: {shape: "cross", size: 2},
  best: {shape: "dot", size: 6.5},
  prototype: {shape: "plus", size: 5},
  chosen: {shape: "diamond", size: 8},
  pinned: {shape: "frame", size: 6},
  inspected: {shape: "corners", size: 9},
}
const INK = {}
function dye() {
  const style = getComputedStyle(document.documentElement)
  const colour = (name) => style.getPropertyValue(`--${name}`).trim()
  for (const [key, look] of entriesOf(LOOKS)) look.colour = colour(`look-${key}`)
  for (const name of ["context", "text", "muted", "accent", "panel", "grid", "field"]) INK[name] = colour(name)
}
dye()
// Categories have colours and shapes that no other mark has. Neighbours differ in lightness, too.
const HUES = entriesOf({down: "#D55E00", up: "#00795A", hexagon: "#B07800", square: "#7F3C8D", pentagon: "#C4568F", left: "#5F6B00", star: "#8C4A2F", burst: "#0E8080"})
  .map(([shape, colour]) => ({colour, shape, size: 4.5}))

// Outlines of the shapes, in units of their size, for canvas and SVG.
const polygon = (corners, turn = 0, inner = 1) => `M${[...Array(corners).keys()].map((k) => {
  const [angle, radius] = [(turn + 2 * k / corners) * Math.PI, k % 2 ? inner : 1]
  return `${radius * Math.sin(angle)} ${-radius * Math.cos(angle)}`
}).join("L")}Z`
const CIRCLE = polygon(40)
const FRAME = polygon(4, 0.25, 1)
const OUTLINES = {
  dot: CIRCLE, ring: CIRCLE, frame: FRAME, corners: FRAME, square: FRAME, diamond: polygon(4), cross: "M-1-1L1 1M1-1L-1 1", plus: "M0-1V1M-1 0H1",
  up: polygon(3), down: polygon(3, 1), left: polygon(3, 1.5), pentagon: polygon(5), hexagon: polygon(6, 0.5), star: polygon(10, 0, 0.45), burst: polygon(8, 0, 0.4),
}
const PATHS = Object.fromEntries(entriesOf(OUTLINES).map(([key, path]) => [key, new Path2D(path)]))
const isOpen = (shape) => ["cross", "ring", "plus", "frame", "corners"].includes(shape)

function drawShape(g, {shape, colour, size}, x, y) {
  g.save()
  g.fillStyle = colour
  g.translate(x, y)
  g.scale(size, size)
  g.strokeStyle = INK.panel // a halo, which tells it from lines below
  g.lineWidth = 4 / size
  if (!isOpen(shape)) g.stroke(PATHS[shape])
  g.strokeStyle = colour
  g.lineWidth = 1.6 / size
  isOpen(shape) ? g.stroke(PATHS[shape]) : g.fill(PATHS[shape])
  g.restore()
}

// A look as a picture for legends and texts.
function icon({shape, colour, size}) {
  const r = min(size, 6)
  const svg = (name, attributes) => {
    const element = document.createElementNS("http://www.w3.org/2000/svg", name)
    for (const [attribute, value] of entriesOf(attributes)) element.setAttribute(attribute, value)
    return element
  }
  const picture = svg("svg", {class: "icon", viewBox: "0 0 16 16", "aria-hidden": "true"})
  picture.append(svg("path", {d: OUTLINES[shape], transform: `translate(8 8) scale(${r})`, "stroke-width": 1.6 / r,
    fill: isOpen(shape) ? "none" : colour, stroke: isOpen(shape) ? colour : "none"}))
  return picture
}
