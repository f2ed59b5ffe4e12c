// A row for each objective: its name, its limit, its axis, what is proposed, the best and what lies
// between, in units and per cent. Variables and further outputs have rows without the last three.
// axes.js draws on the axes.

const STEPS = 1000 // of a slider, finer than a pixel
const FOLDED = 8 // rows that are shown unless more are asked for
const FURTHER = [["variable", "variables"], ["output", "further outputs"]]
const controls = new Map()
let isUnfolded = false

// The end of its limits beyond which an objective gets worse: 0 is the lower one.
const worseEnd = (column) => isObjective(column) && column.maximize ? 0 : 1
// The axis of an objective to be minimised runs from its greatest value at the left: right is better.
const isTurned = (column) => isObjective(column) && !column.maximize

// Objectives as the reader has put them in order, without those that are hidden.
function objectivesInOrder() {
  const {order, hidden} = state.rows
  const names = [...new Set([...order, ...data.objectives.map(({name}) => name)])]
  return names.map((name) => data.by.get(name)).filter((column) => isObjective(column) && !hidden.includes(column.name))
}

// The columns whose axes are shown, in the order of their rows.
function shownColumns() {
  return [...controls.values()].filter(({row, fields}) => fields && row.checkVisibility())
    .sort((a, b) => a.row.offsetTop - b.row.offsetTop).map(({column}) => column)
}

function changeRows(changes) {
  change({rows: {...state.rows, ...changes}})
}
function moveRow(column, to, done = true) {
  const names = objectivesInOrder().map(({name}) => name).filter((name) => name !== column.name)
  names.splice(max(0, to), 0, column.name)
  change({rows: {...state.rows, order: names}}, done)
}

function grip(column) {
  const place = () => objectivesInOrder().indexOf(column)
  const element = make("button.grip", {ariaLabel: `Move ${column.name}`, title: "Drag, or use the arrow keys"})
  const step = (by) => () => {
    moveRow(column, place() + by)
    update()
    element.focus()
  }
  onKeys(element, {arrowup: step(-1), arrowdown: step(1)})
  onDrag(element, (_, y) => {
    const from = place()
    const height = controls.get(column).row.offsetHeight
    const to = (v) => from + round((v - y) / height)
    return {
      move: (_, v) => { if (to(v) !== place()) moveRow(column, to(v), false) },
      up: (_, v, moved) => { if (moved) moveRow(column, to(v)) },
    }
  })
  return element
}

// Two fields; that of the better side of an objective appears where it is used.
function limitFields(column) {
  return [0, 1].map((k) => {
    const text = k ? "at most" : "at least"
    const input = numberField(`${column.label}, ${text}`, "–", (value) => {
      const next = [...(limitOf(column) ?? [null, null])]
      next[k] = value
      if (next[0] !== null && next[1] !== null && next[0] > next[1]) return "The lower limit is above the upper one."
      setLimit(column, next, true)
      return ""
    })
    input.setAttribute("aria-describedby", `note-${column.field}`)
    return {input, label: make("label.field", make("span", text), input)}
  })
}

// The handles of an axis. One at the end of its axis limits nothing; the one in hand stops at the other.
function limitThumbs(column) {
  return [0, 1].map((k) => {
    const input = make("input", {type: "range", min: 0, max: STEPS, step: 1, ariaLabel: `${column.label}, ${k ? "upper" : "lower"} limit`})
    if (isTurned(column)) input.dir = "rtl"
    if (isObjective(column) && k !== worseEnd(column)) input.className = "better" // only keys take it from the end
    const moved = (done) => {
      const other = limitOf(column)?.[1 - k] ?? null
      const at = Number(input.value)
      let value = at === (k ? STEPS : 0) ? null : readable(column, valueAt(scaleOf(column), at / STEPS))
      if (value !== null && other !== null && (k ? value < other : value > other)) value = other
      setLimit(column, k ? [other, value] : [value, other], done)
    }
    input.oninput = () => moved(false)
    input.onchange = () => moved(true)
    input.onpointerup = () => dragging && moved(true) // back where it was, without a change
    return input
  })
}

function rowOfColumn(column) {
  if (column.texts) return rowOfTexts(column)
  const {label, name, field, maximize, unit} = column
  const {low, high} = scaleOf(column)
  if (!(high > low) && !isObjective(column)) {
    return make("p.constant", broken(label), `: ${column.values.some(isNumber) ? `${valueText(column, low)} for all designs` : "no values"}`)
  }
  const control = {column, fields: limitFields(column), thumbs: limitThumbs(column), note: make("p.note", {id: `note-${field}`})}
  controls.set(column, control)
  const worse = worseEnd(column)
  const fields = worse ? [...control.fields].reverse() : control.fields
  if (isObjective(column)) fields[1].label.classList.add("other")
  control.log = low > 0 && high >= 100 * low && button("", () => {
    const {turned} = state.rows
    changeRows({turned: turned.includes(name) ? turned.filter((one) => one !== name) : [...turned, name]})
  }, {title: "Axis"})
  control.axis = make("div.axis", {role: "cell"}, control.thumbs)
  control.cells = ["value", "best", "share"].map((kind) => make(`div.${kind}`, {role: "cell"}))
  control.fill = make("i")
  const isMany = data.objectives.length > 1
  const text = unit ? label.slice(0, label.length - unit.length - 3) : label
  control.row = make("div.row", {role: "row"},
    make("div.tools", {role: "cell"}, isObjective(column) && isMany && grip(column)),
    make("div.name", {role: "rowheader"}, make("b", broken(text)), unit && ` [${unit}]`,
      make("div.sense", isObjective(column) && (maximize ? "more is better" : "less is better"), control.log)),
    make("div.limit", {role: "cell"}, fields.map(({label}) => label), control.note),
    control.axis, control.cells,
    make("div.bar", {role: "cell"}, control.fill),
    make("div.tools", {role: "cell"}, isObjective(column) && isMany && button("×", () => changeRows({hidden: [...state.rows.hidden, name]}),
      {ariaLabel: `Hide ${name}`, title: "Hide; it counts as before"})))
  return control.row
}

const MOST_BOXES = 200 // names of designs have no boxes: thousands slow every step
function rowOfTexts(column) {
  const known = new Set(column.values.subarray(0, data.n)) // an existing design may have another
  const found = column.texts.filter((_, k) => known.has(k))
  const ticked = () => {
    const allowed = boxes.filter((box) => box.checked).map((box) => box.value)
    const others = without(state.limits, column.name)
    change({limits: allowed.length === found.length ? others : {...others, [column.name]: allowed}})
  }
  const boxes = found.length > MOST_BOXES ? [] : found.map((text) => make("input", {type: "checkbox", value: text, onchange: ticked}))
  const note = make("p.note")
  const row = make("fieldset.row", make("legend", column.label),
    make("div.boxes", boxes.map((box) => make("label", box, box.value || "(missing)")),
      !boxes.length && make("span.hint", `${exact(found.length)} different texts are too many to tick`)), note)
  controls.set(column, {column, boxes, note, row})
  return row
}

function buildRows() {
  $("objectives").append(...data.objectives.map(rowOfColumn))
  for (const [role, text] of FURTHER) {
    const columns = limitable.filter((column) => column.role === role)
    if (!columns.length) continue
    const table = columns.map(rowOfColumn)
    const group = make("details", {ontoggle: () => { columnsShown = null; soon() }}, make("summary", `Limits on ${text} `, make("b.hint")),
      make("div", {role: "table", ariaLabel: `Limits on ${text}`}, table.filter(({role}) => role === "row")), table.filter(({role}) => role !== "row"))
    $("further").append(group)
  }
  $("fold").onclick = () => {
    isUnfolded = !isUnfolded
    update(true)
  }
}

function showRows() {
  const columns = objectivesInOrder()
  const shown = isUnfolded ? columns : columns.slice(0, FOLDED)
  const table = $("objectives")
  const rows = [table.firstElementChild, ...shown.map((column) => controls.get(column).row)]
  if (rows.length !== table.children.length || rows.some((row, k) => row !== table.children[k])) {
    table.replaceChildren(...rows)
    columnsShown = null
  }
  const folded = columns.slice(FOLDED)
  const limited = folded.filter((column) => limitOf(column)).length
  show("fold", folded.length)
  renew("fold", isUnfolded ? `Show ${FOLDED} only` : `Show ${folded.length} more${limited ? `, ${limited} with a limit` : ""}`)
  renew("hidden", state.rows.hidden.map((name) => button(`Show ${name}`, () => changeRows({hidden: state.rows.hidden.filter((one) => one !== name)}))))
  renew("value-head", verdict ? roleOf(verdict.row) : "none")
  for (const control of controls.values()) if (control.boxes || control.row.isConnected) showRow(control)
  for (const group of $("further").querySelectorAll("details")) {
    const set = group.querySelectorAll(".set").length
    renew(group.querySelector("summary b"), set && `${set} set`)
  }
}

const roleOf = (row) => inspected === row ? "inspected" : row === chosenRow() ? "chosen" : "proposed"

function showRow({column, row, fields, thumbs, note, boxes, cells, fill, log}) {
  const limit = limitOf(column)
  const changed = controls.get(column).limit !== limit
  controls.get(column).limit = limit
  const out = left.rejected.get(column.name)
  renew(note, out && `rejects ${exact(sum(out))} of ${exact(data.n)}`)
  row.classList.toggle("set", limit !== null)
  if (boxes) {
    for (const box of boxes) box.checked = !limit || limit.includes(box.value)
    return
  }
  const scale = scaleOf(column)
  const share = shareOn(scale)
  fields.forEach(({input, label}, k) => {
    const value = limit?.[k] ?? null
    input.title = `${k ? "Greatest" : "Least"} value: ${valueText(column, k ? scale.high : scale.low)}`
    showNumber(input, value, changed)
    label.classList.toggle("on", value !== null)
    const at = value === null ? k * STEPS : min(STEPS, max(0, round(share(value) * STEPS)))
    if (Number(thumbs[k].value) !== at) thumbs[k].value = at
    thumbs[k].classList.toggle("on", value !== null)
    thumbs[k].ariaValueText = value === null ? "no limit" : valueText(column, value)
  })
  // Where both ends meet, the lower one is the one that can still move.
  thumbs[0].classList.toggle("above", Number(thumbs[0].value) > STEPS / 2)
  if (log) renew(log, scale.log ? "log" : "linear", make("span.unseen", ` axis of ${column.name}`))
  const one = verdict?.objectives[data.objectives.indexOf(column)]
  const texts = ["", "", ""]
  if (verdict) texts[0] = cellText(column, verdict.row)
  if (one) {
    const error = errorOf(column)
    if (error) texts[0] += ` ± ${valueText(column, error.values[verdict.row])}`
    texts[1] = valueText(column, one.best)
    texts[2] = one.share < 0 ? "–" : shareText(one.share)
    row.classList.toggle("weak", verdict.weakest.includes(column.name))
  }
  texts.forEach((text, k) => renew(cells[k], text))
  fill.style.width = `${one ? min(100, max(0, 100 * one.share)) || 0 : 0}%`
}

buildRows() // before axes.js asks for them
