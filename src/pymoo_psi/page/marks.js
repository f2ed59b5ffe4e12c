// How designs look. Shapes tell the same as colours, which page.css has, for light and dark.

const LOOKS = {
  other: {shape: "ring", size: 3.4},
  dominated: {shape: "cross", size: 2},
  rejected: {shape: "dot", size: 2.5},
  proposed: {shape: "dot", size: 6.5},
  prototype: {shape: "plus", size: 5, dashes: [3, 3]},
  chosen: {shape: "diamond", size: 8},
  compared: {shape: "frame", size: 6, dashes: [3, 3]},
  inspected: {shape: "corners", size: 9, dashes: [9, 3]},
}
const INK = {}
function dye() {
  const style = getComputedStyle(document.documentElement)
  const colour = (name) => style.getPropertyValue(`--${name}`).trim()
  for (const [key, look] of entriesOf(LOOKS)) look.colour = colour(`look-${key}`)
  for (const name of ["context", "text", "muted", "accent", "panel", "grid"]) INK[name] = colour(name)
}
dye()
// The outlines of the shapes, in units of their size, stand in the document.
const SHAPES = {}
for (const outline of $("shapes").content.querySelectorAll("path")) {
  SHAPES[outline.dataset.shape] = {outline, path: new Path2D(outline.getAttribute("d")), isOpen: outline.matches(".open")}
}

function drawShape(g, {shape, colour, size}, x, y) {
  const {path, isOpen} = SHAPES[shape]
  g.save()
  g.fillStyle = colour
  g.translate(x, y)
  g.scale(size, size)
  g.strokeStyle = INK.panel // a halo, which tells it from lines below
  g.lineWidth = 4 / size
  if (!isOpen) g.stroke(path)
  g.strokeStyle = colour
  g.lineWidth = 1.6 / size
  isOpen ? g.stroke(path) : g.fill(path)
  g.restore()
}

// A look as a picture for legends and texts, which knows its look.
function icon({shape, colour, size}) {
  const {outline, isOpen} = SHAPES[shape]
  const r = min(size, 6)
  const path = outline.cloneNode()
  for (const [name, value] of entriesOf({transform: `scale(${r})`, "stroke-width": 1.6 / r, [isOpen ? "stroke" : "fill"]: colour})) path.setAttribute(name, value)
  const picture = copyOf("icon")
  picture.append(path)
  picture.look = {shape, colour, size: r}
  return picture
}
const swatch = (shape, colour) => icon({shape, colour, size: 6})
