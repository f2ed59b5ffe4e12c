// The decision page: controls, keys, and what a server and tests may ask of it.

function reset() {
  for (const input of document.querySelectorAll("input:invalid")) showText(input, input.defaultValue)
  inspected = -1
  change(initial.state)
}
onClicks({undo: () => goTo(at - 1), redo: () => goTo(at + 1), reset, skip: () => $("verdict").focus(), "copy-rows": () => copyPicture("rows", "objectives"), "copy-plot": () => copyPicture("scatter-plot", "plot")})
$("fixed").onchange = () => change({fixed: $("fixed").checked})
$("reason").oninput = () => { state = edited({reason: $("reason").value}) }
$("reason").onchange = commit

function redraw() {
  dye()
  formerEnds = undefined
  update()
}
const paper = (on) => () => {
  document.documentElement.classList.toggle("paper", on)
  $("record-foot").textContent = `${data.origin ? `From ${data.origin}. ` : ""}${$("count").textContent}. Printed ${new Date().toLocaleDateString(undefined, {dateStyle: "long"})}.`
  redraw()
}
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw)
addEventListener("beforeprint", paper(true))
addEventListener("afterprint", paper(false))
addEventListener("hashchange", addressed)
addEventListener("keydown", (event) => {
  const {target, key, ctrlKey, metaKey, shiftKey} = event
  const ids = {z: shiftKey ? "redo" : "undo", y: "redo"}
  const id = (ctrlKey || metaKey) && ids[key.toLowerCase()]
  // What is being typed the browser undoes; after that it would go on in another field.
  const isTyping = target.matches("textarea, input[type=text], input[type=search]") && target.value !== target.defaultValue
  if (!id || isTyping) return
  event.preventDefault()
  $(id).click()
})

// Designs that came since. The charts keep their scales unless they must change.
function grow(more) {
  addDesigns(more)
  ranking = null // of fewer designs, whose values may be in other groups of equal ones
  filtered = null
  update()
}

saved = JSON.stringify(state)
past[++at] = saved
say(initial.remarks)
document.documentElement.classList.toggle("many", data.objectives.length > 6) // so that a print has one page
addressed()
inPieces(prepare())

const page = {
  data, grow,
  state: () => state,
  set: (next) => { change(checked(next).state); update() },
  get ranking() { return ranking },
  get settled() { return !waiting && !pending },
}
window.decisionPage = page
// Once the typeface is there, in which texts are measured.
Promise.allSettled([FONT, `650 ${FONT}`].map((font) => document.fonts.load(font))).then(() => {
  redraw()
  page.ready = performance.now()
  document.body.dataset.ready = "yes"
})
