// The state of the page and its history. It is one value that nothing changes in place: every control
// makes a new one through change(), and the page is made from it, at most once a frame.

const asWritten = document.documentElement.cloneNode(true) // before anything is shown: what is saved
decode(JSON.parse($("payload").textContent))
const initial = stateOf(data.opens_with)
let {state} = initial
const past = [] // states as text, for undo and redo
let at = -1 // the present one
let saved = "" // the state that a file has
let kept, ranking, verdict, order
const asked = ({limits, fixed}) => JSON.stringify([limits, fixed]) // what they are made from
const made = data.made ?? asked(initial.state) // a saved page opens with others
let filtered = ""
let inspected = -1 // what is looked at, which chooses nothing

// The state with changes: who makes them has said what they are.
function edited(changes) {
  const owners = {...state.owners}
  for (const key of Object.keys(changes)) delete owners[key]
  return {...state, owners, ...changes}
}

// Take a new state; `done` is false while a hand drags: undo goes back to before the drag. Another
// choice ends the inspection, and what the group decided unless it brings a decision of its own.
let dragging = false
function change(changes, done = true) {
  const {chosen, decided} = state
  state = edited(changes)
  if (state.chosen !== chosen) {
    inspected = -1
    if (state.decided === decided) state.decided = null
  }
  dragging = !done
  if (done) commit()
  soon()
}

function commit() {
  const text = JSON.stringify(state)
  if (text === past[at]) return
  past.splice(++at, Infinity, text)
  address()
}

function goTo(step) {
  at = max(0, min(step, past.length - 1))
  state = JSON.parse(past[at])
  address()
  soon()
}

function take({state, remarks}) {
  say(remarks)
  change(state)
}

// The address holds the state unless it is that in which the page opened, so that a link shows it.
function address() {
  const hash = past[at] === past[0] ? location.pathname + location.search : `#${encodeURIComponent(past[at])}`
  try {
    history.replaceState(null, "", hash)
  } catch { /* a document without an address, in a notebook */ }
}
function addressed() {
  if (location.hash.length < 2) return
  try {
    take(checked({...initial.state, ...JSON.parse(decodeURIComponent(location.hash.slice(1)))}))
  } catch {
    say(["The address holds no state of this page."])
  }
}

let waiting = false
let pending = false
function soon() {
  if (waiting) return
  waiting = true
  requestAnimationFrame(() => {
    if (!waiting) return
    lead()
    if (pending) return
    pending = true // once the frame is painted
    requestAnimationFrame(() => setTimeout(() => { if (pending) follow() }, 0))
  })
}

// Everything on the page from the state: first what decides, in the next frame; then the rest.
function update() {
  lead()
  follow()
}

function lead() {
  const keepFocus = focusKept()
  waiting = false
  const filter = asked(state)
  if (filter !== filtered) {
    filtered = filter
    kept = limited(state)
    ranking = ranked(kept.mask, state.fixed ? data.fixed : null, ranking)
    switchLater()
  }
  verdict = verdictOn(ranking, inspected >= 0 ? inspected : chosenRow(), inspected >= 0 ? "against" : "instead")
  markDesigns()
  showRows()
  showVerdict()
  showCharts()
  keepFocus()
}

function follow() {
  const keepFocus = focusKept()
  pending = false
  order = searched($("search").value.trim(), ordered(ranking, state))
  showSteps()
  if (!dragging) showCompare() // below all that a hand on a slider looks at
  showQuestions()
  showShares()
  showPositions()
  showPreference()
  showTable()
  keepFocus()
}

// Run a generator a little at a time, so that the page answers meanwhile, and never while a hand drags:
// where steps take long, it would make them longer.
function inPieces(generator, finish) {
  if (dragging) return setTimeout(inPieces, 250, generator, finish)
  for (const end = performance.now() + 10; performance.now() < end;) {
    const {value, done} = generator.next()
    if (done) return finish?.(value)
  }
  setTimeout(inPieces, 0, generator, finish)
}

// Buttons go or are disabled: who works by keys stays at the first beside the one that was pressed.
function focusKept() {
  const element = document.activeElement
  const place = element?.closest("section .bar, section, .actions")
  return () => {
    // Asking makes the browser lay out the page: where the focus is in no part, nothing is asked.
    const isGone = place && !(element.isConnected && !element.disabled && element.checkVisibility())
    if (isGone) (place.querySelector("button:enabled") ?? $("verdict")).focus({preventScroll: true})
  }
}

// Designs.

const chosenRow = () => rowOf(state.chosen)
const proposedRow = () => ranking.best[0] ?? -1
const isPinned = (row) => state.pins.includes(called(row))
const placed = (row) => placeText(ranking, row)
const limitOf = (column) => entryOf(state.limits, column.name) ?? null

function look(row) {
  if (row >= data.n) return "prototype"
  if (!ranking.pareto[row]) return "dominated"
  return ranking.best.includes(row) ? "proposed" : "other" // places are found after a step is painted
}

// On a scale over decades the digits follow the size of the number, not the range of the column.
const valueText = (column, value) => column.log && isNumber(value) ? short(value) : written(column, value)
function cellText(column, row) {
  const texts = column.cells ??= [] // the same rows are written at every step
  return texts[row] ??= valueText(column, column.values[row])
}

// A click inspects, a button or C chooses. A reason belongs to its choice.
function inspect(row) {
  inspected = row
  soon()
}
function choose(row) {
  if (row < 0) return
  change({chosen: chosenRow() === row ? null : called(row), reason: ""})
  if (state.chosen !== null) update(), $("reason").focus()
}

function pin(row) {
  if (row < 0) return
  const pins = toggled(state.pins, called(row))
  if (pins.length > MOST_PINS) return say([`Five designs are compared. Take one out before ${called(row)}.`])
  change({pins})
}

const rowButton = (text, action, row, properties) => button(text, () => action(row), {ariaLabel: `${text}: ${called(row)}`, ...properties})
const pinButton = (row) => rowButton("Compare", pin, row, {ariaPressed: isPinned(row)})
const chooseButton = (row) => rowButton("Choose", choose, row, {title: "C", className: "small main"})
const inspectButton = (row, kind = "") => make(`button.link${kind}`, {value: row, onclick: () => inspect(row)}, called(row))

// An entry of the state by the name of a column; null takes it out.
function setEntry(key, {name}, value, done) {
  const {[name]: _, ...others} = state[key]
  change({[key]: value === null ? others : {...others, [name]: value}}, done)
}
// The ends of a limit; null is none.
const setLimit = (column, ends, done) => setEntry("limits", column, ends.some(isNumber) ? ends : null, done)

const numericLimit = (column) => (column.texts ? null : limitOf(column)) ?? [null, null]

// A hand gives what can be read: the digits that the column is written with, so that the limit in
// force is the number in its field.
const readable = ({log, notation: {decimals, powers}}, value) => Number(log ? value.toPrecision(4)
  : powers ? value.toExponential(decimals) : value.toFixed(decimals))

// A limit on a column in words.
function limitTexts(column, limit) {
  if (column.texts && limit) return [`${column.name}: ${limit.join(", ") || "none"}`]
  return (limit ?? []).flatMap((end, k) => (end === null ? [] : [limitText(column, k, end)]))
}
function within() {
  const set = entriesOf(state.limits).length
  return set ? ` within the limit${set > 1 ? "s" : ""}` : ""
}
// The limits that a design breaks.
const broke = (row) => [...kept.rejected].flatMap(([name, out]) => (out[row] ? [columnOf(name)] : []))

const errorOf = ({name}) => columnOf(`${name} standard error`)
const isLog = (column) => Boolean(column.log) !== state.turned.includes(column.name)

// The ends of the axis of a column: of all designs but outliers, and of what is marked.
let marked = [] // rows that no axis leaves out
let scales = new Map()
function scaleOf(column) {
  if (scales.has(column)) return scales.get(column)
  let [low, high] = column.texts ? [0, column.texts.length - 1] : column.axis
  for (const row of marked) {
    const value = column.values[row]
    if (isNumber(value)) [low, high] = [min(low, value), max(high, value)]
  }
  if (high - low <= 1e-12 * max(abs(low), abs(high))) high = low // rounding is no distance
  scales.set(column, {low, high, log: !column.texts && low > 0 && isLog(column)})
  return scales.get(column)
}
