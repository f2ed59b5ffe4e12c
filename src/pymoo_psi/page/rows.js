// A row for each objective: its name, its limit, its axis, what is proposed, the best and what lies
// between, in units and per cent. Variables and further outputs have rows without the last three.
// axes.js draws on the axes.

const STEPS = 1000 // of a slider, finer than a pixel
const FOLDED = 8 // rows that are shown unless more are asked for
const controls = new Map()
let isUnfolded = false

// The axis of an objective to be minimised runs from its greatest value at the left: right is better.
const isTurned = (column) => isObjective(column) && !column.maximize

const betterText = ({maximize}) => (maximize ? "more is better" : "less is better")

// Objectives as the reader has put them in order, without those that are hidden.
function objectivesInOrder() {
  const {rows, hidden} = state
  const names = unique([...rows, ...namesOf(data.objectives)])
  return names.map(columnOf).filter((column) => isObjective(column) && !hidden.includes(column.name))
}

function toggleRow(key, name) {
  change({[key]: toggled(state[key], name)})
}
function moveRow(column, to, done = true) {
  const before = objectivesInOrder()
  const after = before.filter((one) => one !== column).toSpliced(max(0, to), 0, column)
  const isMoved = after.some((one, k) => one !== before[k])
  change(isMoved ? {rows: namesOf(after)} : {}, done)
}

// A row is moved by its grip, dragged or by keys.
function listenToGrip(element, column) {
  const place = () => objectivesInOrder().indexOf(column)
  const step = (by) => () => {
    moveRow(column, place() + by)
    update()
    element.focus()
  }
  onKeys(element, {arrowup: step(-1), arrowdown: step(1)})
  element.onpointerdown = (start) => {
    const from = place()
    const height = controls.get(column).row.offsetHeight
    const stop = new AbortController()
    const drag = ({type, clientY}) => {
      const isDone = type !== "pointermove"
      moveRow(column, from + round((clientY - start.clientY) / height), isDone)
      if (isDone) stop.abort()
    }
    for (const type of ["pointermove", "pointerup", "pointercancel"]) addEventListener(type, drag, {signal: stop.signal})
    start.preventDefault()
  }
}

// A field is for one end of a limit.
function listenToField(input, column, k) {
  numberField(input, `${column.label}, ${k ? "at most" : "at least"}`, (value) => {
    const next = numericLimit(column).with(k, value)
    if (isTwisted(next)) return "The lower limit is above the upper one."
    setLimit(column, next, true)
    return ""
  })
}

// A handle at the end of its axis limits nothing; the one in hand stops at the other.
function listenToThumb(input, column, k) {
  input.ariaLabel = `${column.label}, ${k ? "upper" : "lower"} limit`
  if (isTurned(column)) input.dir = "rtl"
  if (isObjective(column) && k !== worseEnd(column)) input.className = "better" // only keys take it from the end
  const moved = (done) => {
    const limit = numericLimit(column)
    const at = Number(input.value)
    const value = at === k * STEPS ? null : readable(column, valueAt(scaleOf(column), at / STEPS))
    setLimit(column, limit.with(k, isTwisted(limit.with(k, value)) ? limit[1 - k] : value), done)
  }
  input.oninput = () => moved(false)
  input.onchange = () => moved(true)
  input.onpointerup = () => dragging && moved(true) // back where it was, without a change
}

function rowOfColumn(column) {
  const {label, name, field, unit} = column
  const {low, high} = scaleOf(column)
  if (!(high > low) && !isObjective(column)) {
    return make("p.constant", label, `: ${column.values.some(isNumber) ? `${valueText(column, low)} for all designs` : "no values"}`)
  }
  const row = copyOf("row")
  const all = (selector) => [...row.querySelectorAll(selector)]
  const [title, ofUnit] = all(".name b, .name span")
  const [inputs, thumbs, cells] = [".field input", ".axis input", ".value, .best, .share"].map(all)
  const [grip, log, hide] = all("button")
  const [sense, note, axis, fill] = all(".sense, .note, .axis, .bar i")
  title.append(name)
  ofUnit.append(unit && ` [${unit}]`)
  note.id = `note-${field}`
  inputs.forEach((input, k) => {
    listenToField(input, column, k)
    input.setAttribute("aria-describedby", note.id)
  })
  thumbs.forEach((input, k) => listenToThumb(input, column, k))
  if (isObjective(column)) {
    const worse = worseEnd(column)
    if (worse) note.before(inputs[0].parentElement)
    sense.prepend(betterText(column))
    inputs[1 - worse].parentElement.classList.add("other")
    grip.ariaLabel = `Move ${name}`
    listenToGrip(grip, column)
    hide.ariaLabel = `Hide ${name}`
    hide.onclick = () => toggleRow("hidden", name)
  } else title.parentElement.append(note) // below two fields a row would grow under the hand
  if (!isObjective(column) || data.objectives.length === 1) for (const button of [grip, hide]) button.remove()
  axis.column = column
  log.onclick = () => toggleRow("turned", name)
  if (!(low > 0 && high >= 100 * low)) log.remove()
  controls.set(column, {column, row, inputs, thumbs, cells, log, axis, note, fill})
  return row
}

const MOST_BOXES = 200 // names of designs have no boxes: thousands slow every step
function rowOfTexts(column) {
  const known = new Set(column.values.subarray(0, data.n)) // an existing design may have another
  const texts = column.texts.filter((_, k) => known.has(k))
  const onchange = () => {
    const allowed = boxes.filter((box) => box.checked).map((box) => box.value)
    setEntry("limits", column, allowed.length === texts.length ? null : allowed)
  }
  const boxes = texts.length > MOST_BOXES ? [] : texts.map((value) => make("input", {type: "checkbox", value, onchange}))
  const note = make("p.note")
  const row = make("fieldset.row", make("legend", column.label),
    make("div.boxes", boxes.map((box) => make("label", box, box.value || "(missing)")),
      !boxes.length && make("span.hint", `${exact(texts.length)} different texts are too many to tick`)), note)
  controls.set(column, {column, boxes, note, row})
  return row
}

$("objectives").append(...data.objectives.map(rowOfColumn))
for (const group of $("further").children) {
  const columns = data.columns.filter(({role}) => role === group.dataset.role)
  group.hidden = !columns.length
  const table = group.lastElementChild
  for (const column of columns) {
    const row = column.texts ? rowOfTexts(column) : rowOfColumn(column)
    const place = row.role ? table : group // one without numbers is no row of a table
    place.append(row)
  }
}

$("fold").onclick = () => {
  isUnfolded = !isUnfolded
  update()
}

function showRows() {
  const columns = objectivesInOrder()
  const table = $("objectives")
  const rows = columns.slice(0, isUnfolded ? Infinity : FOLDED).map((column) => controls.get(column).row)
  const [heading, ...present] = table.children
  if (rows.length !== present.length || rows.some((row, k) => row !== present[k])) {
    table.replaceChildren(heading, ...rows)
    formerEnds = undefined
  }
  const folded = columns.slice(FOLDED)
  const limited = folded.filter(limitOf).length
  renew("fold", folded.length && (isUnfolded ? `Show ${FOLDED} only` : `Show ${folded.length} more${limited ? `, ${limited} with a limit` : ""}`))
  renew("hidden", state.hidden.map((name) => button(`Show ${name}`, () => toggleRow("hidden", name))))
  renew("value-head", verdict && roleOf(verdict.row))
  for (const control of controls.values()) if (control.row.isConnected) showRow(control)
  for (const group of $("further").children) {
    const set = group.querySelectorAll(".set").length
    renew(group.querySelector("summary b"), set && `${set} set`)
  }
}

const roleOf = (row) => inspected === row ? "inspected" : row === chosenRow() ? "chosen" : "proposed"

function showRow({column, row, inputs, thumbs, cells, log, note, fill, boxes}) {
  const limit = limitOf(column)
  const out = kept.rejected.get(column.name)
  renew(note, out && `rejects ${exact(sum(out))} of ${exact(data.n)}`)
  row.classList.toggle("set", limit !== null)
  if (boxes) {
    for (const box of boxes) box.checked = !limit || limit.includes(box.value)
    return
  }
  const scale = scaleOf(column)
  const share = shareOn(scale, 0)
  inputs.forEach((input, k) => {
    const value = limit?.[k] ?? null
    const thumb = thumbs[k]
    const isSet = value !== null
    showNumber(input, value)
    input.parentElement.classList.toggle("on", isSet)
    thumb.value = isSet ? round(share(value) * STEPS) : k * STEPS // which it keeps on the axis
    thumb.classList.toggle("on", isSet)
    thumb.ariaValueText = isSet ? valueText(column, value) : "no limit"
  })
  // Where both ends meet, the lower one is the one that can still move.
  thumbs[0].classList.toggle("above", thumbs[0].value > STEPS / 2)
  renew(log, scale.log ? "log" : "linear", make("span.unseen", ` axis of ${column.name}`))
  const j = data.objectives.indexOf(column)
  const behind = verdict?.shares[j]
  const isRanked = behind !== undefined
  const error = errorOf(column)
  let value = verdict && cellText(column, verdict.row)
  if (verdict && error) value += ` ± ${valueText(column, error.values[verdict.row])}`
  renew(cells[0], value)
  const ends = isRanked ? [ranking.nadir[j], ranking.ideal[j]] : [scale.low, scale.high] // from left to right
  ends.forEach((end, k) => renew(cells[k + 1], (isRanked || j < 0) && valueText(column, end)))
  // Below the axis, on a narrow screen, each stands at its place.
  const [from, to] = ends.map((end) => isTurned(column) ? 1 - share(end) : share(end))
  const half = `minmax(max-content, ${500 * (to - from)}fr)` // less than 1fr in all would leave room
  cells[1].parentElement.style.gridTemplateColumns = `${1000 * from}fr ${half} ${half} ${1000 * (1 - to)}fr`
  renew(cells[3], isRanked && (behind < 0 ? "–" : isWithin(behind) ? percent(behind) : "beyond"))
  fill.style.width = `${min(100, max(0, 100 * behind)) || 0}%`
}
