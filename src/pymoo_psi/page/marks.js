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
const HUES = [["#D55E00", "down"], ["#00795A", "half"], ["#B07800", "hexagon"], ["#7F3C8D", "bar"],
  ["#C4568F", "column"], ["#5F6B00", "glass"], ["#8C4A2F", "star"], ["#0E8080", "arrow"]]
  .map(([colour, shape]) => ({colour, shape, size: 4}))

// Outlines of the shapes, in units of their size, for canvas and SVG.
const star = [...Array(10).keys()].map((k) => {
  const [radius, angle] = [k % 2 ? 0.45 : 1, (k * Math.PI) / 5]
  return `${radius * Math.sin(angle)} ${-radius * Math.cos(angle)}`
})
const CIRCLE = "M-1 0A1 1 0 1 1 1 0A1 1 0 1 1-1 0"
const OUTLINES = {
  dot: CIRCLE,
  ring: CIRCLE,
  frame: "M-1-1H1V1H-1Z",
  corners: "M-1-.4V-1H-.4M.4-1H1V-.4M1 .4V1H.4M-.4 1H-1V.4",
  cross: "M-1-1L1 1M1-1L-1 1",
  plus: "M0-1V1M-1 0H1",
  diamond: "M0-1.1L1 0L0 1.1L-1 0Z",
  star: `M${star.join("L")}Z`,
  down: "M0 1L-.95-.8H.95Z",
  hexagon: "M-1 0L-.5-.9H.5L1 0L.5.9H-.5Z",
  bar: "M-1.2-.5H1.2V.5H-1.2Z",
  column: "M-.5-1.2H.5V1.2H-.5Z",
  glass: "M-1-1H1L-1 1H1Z",
  half: "M-1 .5A1 1 0 0 1 1 .5Z",
  arrow: "M1 0L-.8-1L-.3 0L-.8 1Z",
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

// A shape as a picture for legends and texts, made once and copied.
const icons = new Map()
function icon(key) { // the key is one of LOOKS, or a category
  if (!icons.has(key)) {
    const {shape, size, colour = `var(--look-${key})`} = LOOKS[key] ? {...LOOKS[key], colour: undefined} : key
    const r = min(size, 6)
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
