// The decision page: controls, texts and the table. logic.js says what is left, ranked and best;
// charts.js draws. The state is one value that nothing changes in place: every control makes a new
// one through change(), and update() makes all of the page from it, at most once a frame.
//
// Texts of the user's (names, units, labels, reasons) become text nodes or values, never markup.
"use strict"
const page = (() => {
  const asWritten = document.documentElement.cloneNode(true) // before anything is shown: what is saved
  const data = Logic.decode(JSON.parse(document.getElementById("payload").textContent))
  const GROUPS = [["objective", "objectives"], ["variable", "variables"], ["output", "further outputs"]]
  const $ = (id) => document.getElementById(id)
  const {broken, icon} = Charts
  const countText = (count) => Logic.apart(Logic.local(String(count)))
  // A name may be "constructor": only what a state says itself counts.
  const own = (object, name) => (Object.hasOwn(object, name) ? object[name] : null)
  const without = ({...object}, name) => { delete object[name]; return object }
  const show = (id, on) => { $(id).hidden = !on }
  const limitable = data.columns.filter((column) => column.role !== "geometric")
  const mus = data.columns.filter((column) => column.role === "geometric")

  // On a scale over decades the digits follow the size of the number, not the range of the column.
  const written = (column, value) => column.log && isNumber(value)
    ? Logic.short(value) : Logic.written(column, value)
  const difference = ({unit}, value) => Logic.amount({unit: unit === "%" ? unit : ""}, abs(value)) // as in the sentences

  // An element of "tag.class" with properties, if any, attributes (those with a dash, and role) and children.
  function make(tag, ...children) {
    const [name, ...classes] = tag.split(".")
    const properties = children[0]?.constructor === Object ? children.shift() : {}
    const element = document.createElement(name)
    if (classes.length) element.className = classes.join(" ")
    for (const [key, value] of entriesOf(properties)) {
      if (key.includes("-") || key === "role") element.setAttribute(key, value)
      else element[key] = value
    }
    element.append(...children.flat().filter((child) => child !== null && child !== undefined))
    return element
  }
  const head = (scope, ...children) => make("th", {scope}, ...children)
  const button = (text, onclick, properties = {}) => make("button.small", {onclick, ...properties}, text)

  // Make the children of an element, or of that of an id, like others. What stays is neither laid out
  // nor announced again, and keeps the focus.
  function renew(place, ...children) {
    const element = typeof place === "string" ? $(place) : place
    children.forEach((child, k) => {
      const node = typeof child === "string" ? new Text(child) : child
      const old = element.childNodes[k]
      if (!old) element.append(node)
      else if (old.nodeName !== node.nodeName) old.replaceWith(node)
      else if (old.nodeType !== Node.TEXT_NODE) renewElement(old, node)
      else if (old.data !== node.data) old.data = node.data
    })
    while (element.childNodes.length > children.length) element.lastChild.remove()
  }
  function renewElement(old, node) {
    for (const {name, value} of node.attributes) {
      if (old.getAttribute(name) === value) continue
      if (name === "style") old.style.cssText = value // the policy allows this
      else old.setAttribute(name, value)
    }
    for (const name of old.getAttributeNames()) if (!node.hasAttribute(name)) old.removeAttribute(name)
    old.onclick = node.onclick
    renew(old, ...node.childNodes)
  }

  // The state and its history.

  const initial = Logic.initial(data)
  let {state} = initial
  const past = [] // states as text, for undo and redo
  let at = -1 // the present one
  let saved = "" // the state that a file has
  let left, ranking, verdict, order
  let filtered = "" // the part of the state that left and ranking were made from
  let hovered = -1
  let inspected = -1 // what is looked at, which chooses nothing

  // Take a new state; `done` is false while a hand drags: undo goes back to before the drag.
  let dragging = false
  function change(changes, done = true) {
    state = {...state, ...changes}
    dragging = !done
    if (done) commit()
    soon()
  }

  function commit() {
    const text = JSON.stringify(state)
    if (text !== past[at]) past.splice(++at, Infinity, text)
  }

  function take({state, remarks}) {
    say(remarks)
    if (state) change(state)
  }

  function say(sentences) {
    $("messages").replaceChildren(...(sentences.length ? [button("Close", () => say([]))] : []),
      ...sentences.map((text) => make("p", text)))
  }

  let waiting = false
  let following = false
  function soon() {
    if (waiting) return
    waiting = true
    requestAnimationFrame(() => {
      if (!waiting) return
      lead(false)
      if (following) return
      following = true // once the frame is painted
      requestAnimationFrame(() => setTimeout(() => { if (following) follow() }, 0))
    })
  }

  // Everything on the page from the state: first what decides, in the next frame; then the rest.
  function update(everything = false) {
    lead(everything)
    follow()
  }

  function lead(everything) {
    const keepFocus = focusKept()
    waiting = false
    const filter = JSON.stringify([state.limits, state.fixed, state.positions])
    if (filter !== filtered) {
      filtered = filter
      left = Logic.left(data, state)
      ranking = left.count < data.n || state.fixed ? Logic.ranked(data, left.mask, state.fixed ? data.fixed : null) : data.whole
      switchLater()
      renew("stays")
    }
    verdict = Logic.verdict(data, ranking, inspected >= 0 ? inspected : chosenRow(), inspected >= 0 ? "against" : "instead")
    showLimits()
    showCounts()
    showVerdict()
    $("fixed").checked = state.fixed
    const measure = state.fixed ? "the fixed range of each objective" : "the range of the Pareto-optimal designs within the limits"
    renew("measure", measure)
    $("of-range").title = measure
    showCharts(everything)
    keepFocus()
    enter()
  }

  function follow() {
    const keepFocus = focusKept()
    following = false
    order = Logic.found(data, $("search").value.trim(), Logic.order(data, ranking, state))
    showOrder()
    showCompare()
    showPreference()
    showPositions()
    showSteps()
    for (const [chart, all] of later) chart.draw(modelOfCharts(), all)
    later.clear()
    table.show()
    keepFocus()
    enter()
  }

  let entered // the text of the field in focus, as it was entered or taken last
  const enter = () => { entered = document.activeElement?.value }

  // Buttons go or are disabled: who works by keys stays at the first beside the one that was pressed.
  function focusKept() {
    const element = document.activeElement
    const place = element?.closest("section .bar, section, .actions")
    return () => {
      if (!place || (element.isConnected && !element.disabled)) return
      (place.querySelector("button:enabled") ?? $("verdict")).focus({preventScroll: true})
    }
  }

  // Until which limits a proposal stays takes longer than a frame: it waits until the hand rests.
  let thinking = 0
  function switchLater() {
    clearTimeout(thinking)
    const search = Logic.switches(data, state, ranking)
    const found = []
    const think = () => {
      for (const end = performance.now() + 10; performance.now() < end;) {
        const {value, done} = search.next()
        if (done) thinking = 0
        if (done) return showSwitches(found)
        if (value) found.push(value)
      }
      thinking = setTimeout(think, 0)
    }
    thinking = setTimeout(think, 250)
  }

  function showSwitches(found) {
    show("relax", found.length)
    const keepFocus = focusKept()
    renew("stays", Logic.staying(data, ranking, found))
    renew("separation", ...Logic.separation(data, ranking, state.positions).map((text) => make("li", text)))
    const moved = ({name, end}, value) => {
      const limit = [...(limitOf(data.by.get(name)) ?? [null, null])]
      limit[end] = value
      setLimit(data.by.get(name), limit, true)
    }
    const cell = (one) => {
      if (!one || one.value === null) return [one ? "the same at any" : "–"]
      const {name, end, looser, value, row, next, exact} = one
      const column = data.by.get(name)
      return [`${looser ? "from" : end ? "below" : "above"} ${written(column, value)}${exact ? "" : " (of values tried)"} `, row < 0 ? "none is left" : inspectButton(row), " ",
        next === null ? null : button("Set", () => moved(one, next), {"aria-label": `Set: ${name}, ${end ? "at most" : "at least"} ${written(column, next)}`})]
    }
    renew("relax-table", make("thead", make("tr", ["Limit", "Tighter", "Looser"].map((text) => head("col", text)))),
      make("tbody", found.filter(({looser}) => !looser).map((one) => {
        const column = data.by.get(one.name)
        const limit = limitOf(column)?.[one.end] ?? null
        const looser = found.find(({name, end, looser}) => looser && name === one.name && end === one.end)
        return make("tr", head("row", limit === null ? `${column.name} without a limit` : Logic.limitText(column, one.end, limit)),
          make("td", cell(one)), make("td", cell(looser),
            looser ? button("Remove limit", () => moved(one, null), {"aria-label": `Remove limit: ${one.name}, ${one.end ? "upper" : "lower"}`}) : null))
      })))
    keepFocus()
  }

  // Designs.

  const NEAR = 10 // places up to which designs have a mark of their own

  const rowOf = (name) => data.rowOf.get(name) ?? -1
  const called = (row) => data.names[row]
  const chosenRow = () => rowOf(state.chosen)
  const proposedRow = () => ranking.best[0] ?? -1
  const isPinned = (row) => state.pins.includes(called(row))

  function look(row) {
    if (row >= data.n) return "prototype"
    if (!ranking.pareto[row]) return "dominated"
    const place = ranking.place[row]
    return place === 1 ? "best" : place <= NEAR ? "near" : "other"
  }
  const placeText = (row) => Logic.placeText(data, ranking, row)
  const keysOfLooks = () => $("looks").querySelectorAll("[data-look]")
  const cellText = (column, row) => written(column, Logic.values(data, ranking, column)[row])

  // A click inspects, a button or C chooses. A reason belongs to its choice.
  function inspect(row) {
    inspected = row
    soon()
  }
  function choose(row) {
    if (row < 0) return
    inspected = -1
    change({chosen: state.chosen === called(row) ? null : called(row), reason: "", decided: null})
    if (state.chosen !== null) update(), $("reason").focus()
  }

  function pin(row) {
    if (row < 0) return
    const pins = isPinned(row) ? state.pins.filter((name) => name !== called(row)) : [...state.pins, called(row)]
    if (pins.length > Logic.MOST_PINS) return say([`Five designs are pinned. Unpin one before you pin ${called(row)}.`])
    change({pins})
  }

  const pinButton = (row) => button("Compare", () => pin(row),
    {"aria-pressed": isPinned(row), "aria-label": `Compare: ${called(row)}`})
  const chooseButton = (row) => button("Choose", () => choose(row),
    {title: "C", "aria-pressed": state.chosen === called(row), "aria-label": `Choose: ${called(row)}`})
  const inspectButton = (row) => make("button.link", {onclick: () => inspect(row)}, called(row))

  // The verdict.

  const percent = (share) => (Logic.isWithin(share) ? Logic.percent(abs(share)) : "beyond")

  // The design that is inspected, or else the chosen one, or else the best compromise, which is proposed only.
  function showVerdict() {
    const chosen = chosenRow()
    const isInspected = inspected >= 0 && inspected !== chosen
    renew("verdict-title", isInspected ? "Inspected" : chosen >= 0 ? "Chosen" : verdict ? "Proposed: best compromise within the limits" : "Nothing is proposed")
    show("verdict-table", verdict)
    const clear = chosen < 0 || isInspected ? null : button("Clear choice", () => choose(chosen))
    if (!verdict) {
      renew("verdict-words", make("p.warning", "No design is left. Below: the single limits at which there is one."),
        ...(clear ? [make("p", `${called(chosen)} is chosen. `, clear)] : []))
      for (const id of ["verdict-more", "verdict-rows", "verdict-variables"]) renew($(id))
    } else {
      const {row, proposed, instead, remarks, standing} = verdict
      const beyond = [...left.rejected].flatMap(([name, out]) => (out[row] ? [name] : []))
      renew("verdict-words",
        make("p.best", left.mask[row] ? icon(look(row)) : null, make("strong", called(row)),
          make("span.hint", placeText(row)), clear ?? chooseButton(row), pinButton(row),
          isInspected ? button("Back", () => inspect(-1), {title: "Esc"}) : null),
        make("p.lead", instead || standing),
        ...(instead ? [make("p.screen", pinButton(proposed))] : []),
        ...(beyond.length ? [make("p.warning", `${called(row)} is beyond the limits on ${Logic.listed(beyond)}.`)] : []))
      renew("verdict-rows", ...verdictRows())
      renew("verdict-more", ...remarks.map((text) => make("p.caution", text)))
      const parts = data.columns.filter((column) => column.role === "variable")
        .map((column) => `${column.name} = ${cellText(column, row)}${column.unit ? ` ${column.unit}` : ""}`)
      renew("verdict-variables", parts.length ? `${parts.join(", ")}.` : "")
    }
    show("cautions", verdict && data.cautions.length)
    renew($("cautions").querySelector("p"), validity())
    renew("shaded", isShaded ? validity() : "")
    show("reasoning", chosen >= 0 && !isInspected)
    renew($("reasoning").firstElementChild, `Reason for choosing ${state.chosen}`)
    if ($("reason").value !== state.reason) $("reason").value = state.reason
    renew("reason-printed", state.reason || "–")
  }

  // What was computed when the page was made holds for the limits and ranges that it opened with.
  const asked = ({limits, fixed}) => JSON.stringify([limits, fixed])
  const isAsOpened = () => asked(state) === asked(initial.state)
  const validity = () => isAsOpened() ? "" : "For the limits and ranges that the page opened with:"

  function verdictRows() {
    return verdict.objectives.map(({name, value, best, away, share}) => {
      const column = data.by.get(name)
      const weak = verdict.weakest.includes(name)
      const bar = make("i")
      bar.style.width = `${min(100, max(0, 100 * share))}%`
      return make(weak ? "tr.weak" : "tr",
        head("row", broken(column.label), weak && verdict.objectives.length > 1 ? make("em", " weakest") : null),
        make("td.number", written(column, value)), make("td.number", written(column, best)), make("td.number", `${difference(column, away)}${away < 0 ? " better" : ""}`),
        make("td.share", make("span.bar-of-share", {"aria-hidden": "true"}, bar), make("span", share < 0 ? "–" : percent(share))))
    })
  }

  function showCounts() {
    const dominated = left.count - ranking.front.length
    renew("count", left.count === 0 ? "No design is left"
      : `${countText(left.count)} of ${countText(data.n)} ${data.n === 1 ? "design" : "designs"} within the limits, ${countText(ranking.front.length)} Pareto-optimal`)
    $("count").classList.toggle("warning", left.count === 0)
    // Not disabled in earnest: a key that is held would go on with the button beside it.
    $("undo").setAttribute("aria-disabled", at <= 0)
    $("redo").setAttribute("aria-disabled", at >= past.length - 1)
    const {byPlace, place} = ranking
    const best = ranking.best.length
    const farther = byPlace.findIndex((row) => place[row] > NEAR)
    const near = farther < 0 ? byPlace.length : farther
    const counts = {best, near: near - best, other: byPlace.length - near, dominated}
    for (const key of keysOfLooks()) renew(key.lastElementChild, countText(counts[key.dataset.look]))
    $("dominated").checked = state.dominated
    const marks = {chosen: state.chosen !== null, pinned: state.pins.length, prototype: data.total > data.n}
    renew("key", ...Object.keys(marks).filter((look) => marks[look]).flatMap((look) => [icon(look), look]))
  }

  function showOrder() {
    renew("export", `Export ${countText(order.length)} shown as CSV`)
    $("export").disabled = order.length === 0
    renew("shown", `${countText(order.length)} ${$("search").value ? "found" : "shown"}`)
  }

  // Comparison: what it holds and against what is Logic.compared's.

  function showCompare() {
    const parts = Logic.compared(data, ranking, state, inspected)
    const rows = parts.map(({row}) => row)
    show("compare", rows.length)
    show("compare-table", rows.length > 1)
    renew("compare-hint", rows.length < 2 ? "Only one design is left; there is none to compare it with."
      : `Gains and losses against ${called(rows[0])}, with per cent of the range.`)
    if (rows.length < 2) return renew("compare-table")
    const objectives = Logic.compare(data, ranking, rows, rows[0])
    const heads = parts.map(({row, roles}) => {
      const name = called(row)
      return head("col", make("div.named", left.mask[row] ? icon(look(row)) : null, make("button.link.label", {onclick: () => inspect(row)}, name)),
        make("div.roles", [...roles, placeText(row)].join(", ")),
        make("div.tools",
          isPinned(row) ? button("×", () => pin(row), {"aria-label": `× ${name} out of the comparison`, title: "Take out"}) : null))
    })
    renew("compare-table",
      make("thead", make("tr", head("col", "Objective"), heads)),
      make("tbody", objectives.map((objective) => compareRow(rows, objective))))
  }

  function compareRow(rows, {column, gains, shares}) {
    return make("tr", head("row", broken(column.label)), rows.map((row, k) => {
      const text = make("div", cellText(column, row))
      if (k === 0) return make("td.number", text)
      if (gains[k] === 0) return make("td.number", text, make("div.hint", "the same"))
      return make("td.number", text,
        make(gains[k] > 0 ? "div.gain" : "div.loss", `${difference(column, gains[k])} ${gains[k] > 0 ? "better" : "worse"}`),
        Logic.isWithin(shares[k]) ? make("div.hint.shares", percent(shares[k])) : null)
    }))
  }

  function showSteps() {
    const {row, steps} = verdict ?? {steps: []}
    show("steps", steps.length)
    if (steps.length === 0) return
    renew("steps-title", `Better than ${called(row)} in an objective`)
    renew("steps-table", make("tbody", steps.map((next) => make("tr",
      head("row", broken(next.names.join(", "))),
      make("td", inspectButton(next.row), `: ${next.text}`), make("td", pinButton(next.row))))))
  }

  // Limits: number fields, a slider with two ends.

  const limitOf = (column) => own(state.limits, column.name)
  const controls = new Map()

  // Limits on columns, [null, null] for none.
  function setLimits(pairs, done) {
    let {limits} = state
    for (const [{name}, limit] of pairs) {
      limits = without(limits, name)
      if (limit.some((end) => end !== null)) limits = {...limits, [name]: limit}
    }
    change({limits}, done)
  }
  const setLimit = (column, limit, done) => setLimits([[column, limit]], done)

  // A slider gives what can be read: the digits that the column is written with, so that the limit
  // in force is the number in its field.
  const rounded = ({log, notation: {decimals, powers}}, value) => Number(log ? value.toPrecision(4)
    : powers ? value.toExponential(decimals) : value.toFixed(decimals))

  const hasValues = (column) => column.values.some(isNumber)

  // A field for a number; `taken` returns what is wrong with it, or "". What is wrong stays to be mended.
  function numberField(name, properties, taken) {
    const input = make("input", {type: "text", inputMode: "decimal", autocomplete: "off", "aria-label": name, ...properties})
    input.onchange = () => {
      const {value, wrong} = Logic.typed(input.value)
      const why = wrong ?? taken(value)
      if (why || isWrong(input)) say(why ? [`${name}: ${why}`] : [])
      input.setAttribute("aria-invalid", String(why !== ""))
    }
    return input
  }
  const isWrong = (input) => input.getAttribute("aria-invalid") === "true"
  function showNumber(input, value, changed) {
    if (changed) input.setAttribute("aria-invalid", "false")
    const typed = input === document.activeElement && Logic.typed(input.value).value === value
    if (!isWrong(input) && !typed) input.value = value === null ? "" : countText(value)
  }

  const STEPS = 1000 // finer than a pixel of the track
  function limitControl(column) {
    if (column.texts) return categoryControl(column)
    const {range: [low, high], label, log, maximize, role} = column
    if (!(high > low)) {
      return make("p.constant", broken(label), `: ${hasValues(column) ? `${written(column, low)} for all Pareto-optimal designs` : "no values"}`)
    }
    const scale = {low, high, log}
    const control = {column, scale}
    controls.set(column, control)
    control.fields = [0, 1].map((k) => {
      return numberField(`${label}, ${k ? "at most" : "at least"}`, {"aria-describedby": `note-${column.field}`}, (value) => {
        const next = [...(limitOf(column) ?? [null, null])]
        next[k] = value
        if (next[0] !== null && next[1] !== null && next[0] > next[1]) return "The lower limit is above the upper one."
        setLimit(column, next, true)
        return ""
      })
    })
    control.thumbs = [0, 1].map((k) => {
      const input = make("input", {type: "range", min: 0, max: STEPS, step: 1, "aria-label": `${label}, ${k ? "upper" : "lower"} limit`})
      // A limit at the end of its track limits nothing; the one in hand stops at the other.
      const moved = (done) => {
        const other = limitOf(column)?.[1 - k] ?? null
        const at = Number(input.value)
        let value = at === (k ? STEPS : 0) ? null : rounded(column, Charts.valueAt(scale, at / STEPS))
        if (value !== null && other !== null && (k ? value < other : value > other)) value = other
        setLimit(column, k ? [other, value] : [value, other], done)
      }
      input.oninput = () => moved(false)
      input.onchange = () => moved(true)
      input.onpointerup = () => dragging && moved(true) // back where it was, without a change
      return input
    })
    control.note = make("p.hint.note", {id: `note-${column.field}`})
    const sense = role === "objective" || maximize ? make("span.hint", maximize ? "more is better" : "less is better") : null
    const [[least, most], thumbs] = [control.fields, control.thumbs]
    return make("div.limit", {role: "group", "aria-label": `Limits on ${label}`},
      make("div.name", make("span", broken(label)), sense),
      make("div.ends", least, make("div.slider", thumbs), most), control.note)
  }

  function allow(column, texts) {
    const {found} = controls.get(column)
    const others = without(state.limits, column.name)
    const allowed = found.filter((text) => texts.includes(text))
    change({limits: allowed.length === found.length ? others : {...others, [column.name]: allowed}})
  }

  const MOST_BOXES = 200 // names of designs have no boxes: thousands slow every step
  function categoryControl(column) {
    const known = new Set(column.values.subarray(0, data.n)) // an existing design may have another
    const found = column.texts.filter((_, k) => known.has(k))
    const ticked = () => allow(column, boxes.filter((box) => box.checked).map((box) => box.value))
    const boxes = found.length > MOST_BOXES ? [] : found.map((text) => make("input", {type: "checkbox", value: text, onchange: ticked}))
    const note = make("p.hint.note")
    controls.set(column, {column, boxes, note, found})
    return make("fieldset.limit.categories", make("legend", column.label),
      make("div.boxes", boxes.map((box) => make("label", box, box.value || "(missing)")),
        boxes.length ? null : make("span.hint", `${countText(found.length)} different texts are too many to tick`)), note)
  }

  function showLimits() {
    for (const control of controls.values()) {
      const {column, fields, thumbs, note, boxes} = control
      const limit = limitOf(column)
      const changed = control.limit !== limit
      if (dragging && !changed) continue
      control.limit = limit
      if (boxes) {
        for (const box of boxes) box.checked = !limit || limit.includes(box.value)
      } else {
        const share = Charts.place(control.scale)
        fields.forEach((field, k) => {
          const value = limit?.[k] ?? null
          const end = written(column, column.range[k])
          field.placeholder = end.length <= 9 ? end : column.range[k].toExponential(2)
          field.title = `${k ? "Greatest" : "Least"} value shown: ${end}`
          showNumber(field, value, changed)
          const at = value === null ? k * STEPS : min(STEPS, max(0, round(share(value) * STEPS)))
          if (Number(thumbs[k].value) !== at) thumbs[k].value = at
          thumbs[k].setAttribute("aria-valuetext", value === null ? "no limit" : written(column, value))
        })
        // Where both ends meet at the right, the lower one is the one that can still move.
        thumbs[0].classList.toggle("above", Number(thumbs[0].value) > STEPS / 2)
      }
      const out = left.rejected.get(column.name)
      renew(note, out ? `rejects ${countText(Logic.sum(out))}` : "")
      note.closest(".limit").classList.toggle("set", limit !== null)
    }
    for (const group of $("limit-groups").querySelectorAll("details")) {
      const set = group.querySelectorAll(".limit.set").length
      renew(group.querySelector("summary b"), set ? `${set} set` : "")
    }
    const lines = limitable.flatMap((column) => limitTexts(column, limitOf(column)))
    const ranges = state.fixed ? ["Ranked by fixed ranges, which limits do not change."] : []
    renew("record-limits", ...[...(lines.length ? lines : ["None."]), ...ranges].map((text) => make("li", text)))
  }

  // A limit on a column in words.
  function limitTexts(column, limit) {
    if (column.texts && limit) return [`${column.name}: ${limit.join(", ") || "none"}`]
    return (limit ?? []).flatMap((end, k) => (end === null ? [] : [Logic.limitText(column, k, end)]))
  }

  function buildLimits() {
    for (const [role, text] of GROUPS) {
      const columns = limitable.filter((column) => column.role === role)
      if (!columns.length) continue
      const open = role === "objective" || limitable.length <= 6
      $("limit-groups").append(make("details", {open},
        make("summary", `Limits on ${text} `, make("b.hint")), columns.map(limitControl)))
    }
    for (const key of keysOfLooks()) key.firstElementChild.before(icon(key.dataset.look))
    $("remarks").append(...data.remarks.filter((text) => !text.startsWith("Warning")).map((text) => make("p.hint", text)))
    renew($("cautions").querySelector("b"), String(data.cautions.length))
    $("cautions").append(make("p.hint"), ...data.cautions.map((text) => make("p.caution", text)))
    $("scale").textContent = data.normalize ? ", each objective in units of its range" : ", the objectives in their own units"
  }

  // Preferences.

  const wishes = []
  function buildPreferences() {
    const rows = data.objectives.map((column) => {
      const inputs = [["weights", "1", "weight"], ["aspiration", "its best", "aspiration"]].map(([kind, placeholder, word]) => {
        const input = numberField(`${column.label}, ${word}`, {placeholder}, (value) => {
          if (kind === "weights" && value < 0) return "A weight must be 0 or more."
          const others = without(state.preference[kind], column.name)
          change({preference: {...state.preference, [kind]: value === null ? others : {...others, [column.name]: value}}})
          return ""
        })
        wishes.push({input, kind, column})
        return make("td", input)
      })
      return make("tr", head("row", broken(column.label)), inputs)
    })
    $("preference-table").append(make("tbody", rows))
  }

  function showPreference() {
    for (const {input, kind, column} of wishes) {
      showNumber(input, own(state.preference[kind], column.name), false)
    }
    $("by-preference").setAttribute("aria-pressed", String(state.order.by === "preference"))
    if (!$("preferences").open || !verdict) return renew("preference-words")
    const [first] = Logic.preference(data, ranking, state.preference).best
    renew("preference-words", "First by your preferences: ", make("strong", called(first)),
      ranking.place[first] === 1 ? ", also the best compromise. " : ". ", chooseButton(first), " ", pinButton(first))
  }

  // Charts.

  let context = []
  let scales = new Map()
  let drawn = []
  const plots = []
  let hues = null // colours by row; null for those of the places
  let isShaded = false // whether they show what was computed when the page was made

  // The ends of an axis: the range of the Pareto set, and of what is marked.
  function scaleOf(column) {
    if (scales.has(column)) return scales.get(column)
    let [low, high] = column.texts ? [0, column.texts.length - 1] : column.range
    if (column.role === "geometric") [low, high] = [1, -1].map((sign) =>
      Logic.endOf(Logic.values(data, data.whole, column), sign, state.dominated ? data.whole.rows : data.whole.front))
    if (!(low <= high)) [low, high] = [0, 1]
    for (const row of marked) {
      const value = Logic.values(data, ranking, column)[row]
      if (isNumber(value)) [low, high] = [min(low, value), max(high, value)]
    }
    if (high - low <= 1e-12 * max(abs(low), abs(high))) high = low // rounding is no distance
    scales.set(column, {low, high, log: column.log && low > 0})
    return scales.get(column)
  }

  let marked = [] // rows that no axis leaves out
  function modelOfCharts() {
    const marks = []
    for (let row = data.n; row < data.total; row++) marks.push({row, look: "prototype"})
    for (const name of state.pins) marks.push({row: rowOf(name), look: "pinned"})
    if (ranking.count) marks.push({row: proposedRow(), look: "best"})
    if (chosenRow() >= 0) marks.push({row: chosenRow(), look: "chosen"})
    if (inspected >= 0) marks.push({row: inspected, look: "inspected"})
    marked = marks.map(({row}) => row)
    return {context, left: drawn, near: ranking.byPlace.subarray(0, NEAR), marks, look, hues, scale: scaleOf, limit: (column) => (column.texts ? null : limitOf(column)), written, named: called,
      total: data.total, values: (column) => Logic.values(data, ranking, column)}
  }

  const later = new Map() // charts out of view, and whether they are drawn with their axes
  function showCharts(everything) {
    const {dominated} = state
    context = dominated ? data.designs : data.whole.front
    drawn = dominated ? ranking.rows : ranking.front
    const model = modelOfCharts()
    const ends = () => limitable.map((column) => Object.values(scaleOf(column)).join()).join()
    const former = ends()
    scales = new Map()
    const all = everything || former !== ends()
    for (const chart of [parallel, ...plots]) {
      const whole = all || later.get(chart) === true
      later.delete(chart)
      if (chart.inView) chart.draw(model, whole)
      else later.set(chart, whole)
    }
  }

  // A design under the pointer is marked in all charts and in the table.
  function mark(row) {
    if (row === hovered) return
    hovered = row
    for (const chart of [parallel, ...plots]) chart.mark(row)
    table.show()
  }

  function hover(row, x, y) {
    const tip = $("tip")
    mark(row)
    tip.hidden = row < 0
    if (tip.hidden) return
    tip.replaceChildren(make("strong", called(row)), ` ${placeText(row)}`, make("table", limitable.slice(0, 16).map((column) =>
      make("tr", make("td", column.label), make("td.number", cellText(column, row))))))
    const [width, height] = [tip.offsetWidth, tip.offsetHeight]
    tip.style.left = `${max(4, x + 16 + width > innerWidth ? x - width - 12 : x + 16)}px`
    tip.style.top = `${max(4, min(y + 12, innerHeight - height - 6))}px`
  }

  const dragged = (pairs, done) => setLimits(pairs.map(([column, limit]) =>
    [column, limit.map((end) => (end === null ? null : rounded(column, end)))]), done)
  // The objectives and the first others.
  const axes = [...data.objectives, ...limitable.filter((column) => column.role !== "objective" && !column.texts && hasValues(column))]
    .slice(0, max(data.objectives.length, 8))
  const parallel = Charts.parallel($("parallel-chart"), axes, {limit: dragged, pick: inspect, hover})

  function buildColours() {
    const columns = [...data.columns.filter(({texts}) => texts && texts.length <= Charts.HUES.length), ...data.shades] // so many hues
    $("colour").append(make("option", "place"), ...columns.map(({label}) => make("option", label)))
    $("colour").onchange = () => {
      const column = columns[$("colour").selectedIndex - 1]
      const looks = column?.looks ?? Charts.HUES
      isShaded = data.shades.includes(column)
      hues = column ? (row) => looks[column.values[row] % looks.length] : null
      show("colours", column)
      $("colours").replaceChildren(...(column?.texts ?? []).map((text, k) =>
        make("span.key", icon(looks[k % looks.length]), text || "(missing)")))
      soon()
    }
  }

  function buildScatter(section, name, x, y) {
    const columns = {x, y}
    const area = make("div.plot", {role: "img"})
    const choice = (axis) => {
      const element = make("select", {"aria-label": `${name}, ${axis} axis`}, data.columns.map((column) =>
        make("option", {value: column.field, selected: column === columns[axis]}, column.label)))
      element.onchange = () => {
        columns[axis] = data.columns.find((column) => column.field === element.value)
        setAxes()
        plot.draw(modelOfCharts(), true)
      }
      return make("label", axis, element)
    }
    section.append(make("div.bar", choice("y"), choice("x")), area)
    const plot = Charts.scatter(area, {limit: dragged, pick: inspect, hover})
    const setAxes = () => {
      area.setAttribute("aria-label", `${columns.y.label} against ${columns.x.label}; the table holds the same designs`)
      plot.setAxes(columns.x, columns.y)
    }
    setAxes()
    plots.push(plot)
  }

  // The table: only the rows in view are in the document.

  const table = (() => {
    const HEIGHT = 25
    const box = $("table")
    const head = make("div.head", {role: "row"})
    const body = make("div.body", {role: "rowgroup"})
    box.append(head, body)
    let cursor = 0
    // The height is kept: asking after changes would make the browser lay out the page at every step.
    const view = {top: 0, height: box.clientHeight}
    // As wide as the longest text: of numbers those at the ends of the range have it.
    const longest = (texts) => texts.reduce((most, text) => max(most, text.length), 1)
    const length = (column) => column.texts ? longest(column.texts) : column.role === "geometric" ? 9
      : longest([1, -1].map((sign) => written(column, Logic.endOf(column.values, sign))))
    // A name of which, where it is too long, the end stays: it is what tells such names apart.
    const ended = (name) => name.match(/^(.*?)(.{0,12})$/su).slice(1).map((part) => make("span", part))
    const columns = [
      {text: data.label, width: longest(data.names), order: {by: "label"}, cell: called, kind: ".label"},
      {text: "place", width: 10, order: {by: "distance"}, cell: (row) => placeText(row).replace("place ", ""), kind: ""},
      ...[...limitable, ...mus].map((column) => ({
        text: column.role === "geometric" ? column.name.split(" ")[0] : column.label, width: length(column), order: {by: "column", name: column.name},
        cell: (row) => cellText(column, row), kind: column.texts ? "" : column.role === "geometric" ? ".number.hint" : ".number"})),
    ]
    const pixels = columns.map(({width, text}) => ceil(max(7.4 * width + 22, min(7.2 * text.length + 34, 150), 62)))
    const widths = pixels.map((width, j) => (j ? `${width}px` : `min(${width}px, 55vw)`))
    box.style.setProperty("--columns", widths.join(" "))
    head.style.width = body.style.width = `calc(${widths.join(" + ")})`
    const isSorted = ({order}) => order.by === state.order.by && order.name === state.order.name

    const heads = columns.map((column) => {
      const head = make("button", {title: `Sort by ${column.text}`}, broken(column.text))
      head.onclick = () => {
        change({order: {...column.order, down: isSorted(column) && !state.order.down}})
        home()
      }
      head.onkeydown = (event) => event.stopPropagation()
      return make(`div.cell${column.kind}`, {role: "columnheader"}, head)
    })
    head.append(...heads)

    // A line for each row in view, made once: only its texts and marks change.
    const newLine = () => make("div.row", {role: "row"}, columns.map(({kind}) => make(`div.cell${kind}`, {role: "gridcell"})))
    function fill(line, k) {
      const row = order[k]
      const marks = {row: true, hovered: row === hovered, chosen: row === chosenRow(), inspected: row === inspected, cursor: k === cursor, pinned: isPinned(row)}
      const attributes = {id: `row-${k}`, class: Object.keys(marks).filter((mark) => marks[mark]).join(" "),
        "aria-rowindex": k + 2, "aria-selected": marks.chosen, "data-k": k}
      const [name, ...texts] = columns.map(({cell}) => cell(row))
      const content = JSON.stringify([attributes, look(row), name, texts])
      if (line.content === content) return
      line.content = content
      for (const [name, value] of entriesOf(attributes)) line.setAttribute(name, value)
      line.style.top = `${k * HEIGHT}px`
      renew(line.firstChild, ...ended(name))
      texts.forEach((text, j) => renew(line.children[j + 1], ...(j ? [] : [icon(look(row))]), text))
    }

    function show() {
      cursor = max(0, min(cursor, order.length - 1))
      body.style.height = `${order.length * HEIGHT}px`
      body.style.minHeight = `${min(data.total, 17) * HEIGHT}px` // as high as the box, or all rows, at any limit
      const first = max(0, min(order.length, floor(view.top / HEIGHT)) - 2)
      const last = min(order.length, ceil((view.top + view.height) / HEIGHT))
      while (body.children.length < last - first) body.append(newLine())
      while (body.children.length > max(0, last - first)) body.lastChild.remove()
      for (let k = first; k < last; k++) fill(body.children[k - first], k)
      box.setAttribute("aria-rowcount", order.length + 1)
      box.setAttribute("aria-activedescendant", order.length ? `row-${cursor}` : "")
      columns.forEach((column, k) => {
        heads[k].setAttribute("aria-sort", !isSorted(column) ? "none" : state.order.down ? "descending" : "ascending")
      })
      for (const id of ["choose", "pin"]) $(id).disabled = current() < 0
    }

    function go(k) {
      cursor = max(0, min(order.length - 1, k))
      const top = cursor * HEIGHT
      const room = box.clientHeight - head.offsetHeight - HEIGHT
      if (top < view.top) box.scrollTop = top
      else if (top > view.top + room) box.scrollTop = top - room
      view.top = box.scrollTop
      show()
    }

    const home = () => { box.scrollTop = cursor = 0 }
    const current = () => order[cursor] ?? -1

    const keys = {
      ArrowDown: () => go(cursor + 1), ArrowUp: () => go(cursor - 1), PageDown: () => go(cursor + 15),
      PageUp: () => go(cursor - 15), Home: () => go(0), End: () => go(order.length - 1),
      Enter: () => inspect(order[cursor]), c: () => choose(order[cursor]), p: () => pin(order[cursor]), Escape: () => inspect(-1),
    }
    box.onkeydown = (event) => {
      const action = event.ctrlKey || event.altKey || event.metaKey ? null : keys[event.key] ?? keys[event.key.toLowerCase()]
      if (!action || !order.length) return
      event.preventDefault()
      action()
    }
    body.onclick = (event) => {
      const element = event.target.closest(".row")
      if (!element) return
      go(Number(element.dataset.k))
      inspect(order[cursor])
    }
    body.onpointermove = (event) => {
      const line = event.target.closest(".row")
      mark(line ? order[Number(line.dataset.k)] : -1)
    }
    body.onpointerleave = () => mark(-1)
    box.onscroll = () => { // once a frame
      view.top = box.scrollTop
      show()
    }
    new ResizeObserver(() => {
      view.height = box.clientHeight
      if (order) show()
    }).observe(box)
    return {show, home, current}
  })()

  // Files.

  function download(text, type, name) {
    const link = make("a", {href: URL.createObjectURL(new Blob([text], {type})), download: name})
    link.click()
    setTimeout(() => URL.revokeObjectURL(link.href), 10000)
  }

  const decision = () => Logic.decision(data, state, new Date().toISOString())
  const isSaved = () => { saved = JSON.stringify(state) }

  function saveDecision() {
    const name = `${data.file}-decision.json`
    download(`${JSON.stringify(decision(), null, 1)}\n`, "application/json", name)
    isSaved()
    say([`Saved as ${name}. Open it here with "Open decision…", or in the commands page, rank and report with --decision ${name}.`])
  }

  function exportRows() {
    const name = `${data.file}-shown.csv`
    download(Logic.csv(data, order, ranking, state), "text/csv", name)
    download(Logic.metadata(data, order, state, name), "application/json", `${name}-metadata.json`)
    say([`Exported as ${name}. Keep ${name}-metadata.json beside it: the commands read objectives, directions and units there.`])
  }

  // The page as it was made, with the decision in place of what it opened with.
  function savePage() {
    const copy = asWritten.cloneNode(true)
    const script = copy.querySelector("#payload")
    const content = {...JSON.parse(script.textContent), opens_with: decision(), more: data.more, live: null}
    script.replaceChildren(JSON.stringify(content).replaceAll("<", "\\u003c"))
    download(`<!DOCTYPE html>\n${copy.outerHTML}\n`, "text/html", `${data.file}.html`)
    isSaved()
    say([`Saved as ${data.file}.html: this page with its limits, choice, comparison, positions and reason.`])
  }

  // Positions: what somebody holds at a date, under one name a history.
  const dated = (date) => date.slice(0, 10)
  const boxesOfPositions = () => [...$("position-table").querySelectorAll("input")]
  let agreeing // what the ticks were last set for: whose choice is the present one agrees
  function showPositions() {
    const {positions, decided, chosen} = state
    const held = Logic.latest(positions)
    const row = (title, cell) => make("tr", head("row", title), held.map((one) => make("td", cell(one))))
    const gives = (column) => ({chosen}) => {
      const at = rowOf(chosen)
      if (at < 0) return "–"
      const j = data.objectives.indexOf(column)
      const away = data.F[j][at] - (ranking.count ? ranking : data.whole).frame.low[j]
      return `${cellText(column, at)}, ${away > 0 ? `gives up ${difference(column, away)}` : away < 0 ? `${difference(column, away)} better than the best` : "the best"}`
    }
    const words = ({limits}) => entriesOf(limits).flatMap(([name, limit]) => limitTexts(data.by.get(name), limit)).join("; ") || "–"
    const numbers = (key) => (one) => entriesOf(one[key]).map(([name, value]) => `${name} ${countText(value)}`).join(", ") || "–"
    renew("position-table", ...(held.length ? [make("thead", make("tr", head("col", "Position"), held.map((one) =>
      head("col", make("b", one.name), make("div.tools",
        button("Show", () => change({limits: one.limits, chosen: one.chosen, reason: one.reason, preference: {weights: one.weights, aspiration: one.aspiration}}), {"aria-label": `Show: ${one.name}`}),
        button("×", () => change({positions: positions.filter((other) => other !== one)}), {"aria-label": `Remove: ${one.name}, ${dated(one.date)}`})))))),
    make("tbody", row("Choice", (one) => make("b", one.chosen ?? "none")), data.objectives.map((column) => row(column.label, gives(column))),
      row("Limits", words), row("Weights", numbers("weights")), row("Aspirations", numbers("aspiration")), row("Reason", (one) => one.reason || "–"),
      row("Agrees", (one) => make("input", {type: "checkbox", "aria-label": `${one.name} agrees`})))] : []))
    const key = JSON.stringify([chosen, held])
    if (key !== agreeing) boxesOfPositions().forEach((box, k) => { box.checked = held[k].chosen === chosen })
    agreeing = key
    $("decide").disabled = chosen === null || !held.length
    renew("decide", `Decide for ${chosen ?? "a choice"}`)
    renew("decided", ...(decided ? [[Logic.sentence(data, "decided", {on: decided.date && ` on ${dated(decided.date)}`, design: decided.chosen, by: decided.agree.length ? ` by ${Logic.listed(decided.agree)}` : ""}),
      decided.dissent.length ? Logic.sentence(data, "dissent", {dissent: Logic.listed(decided.dissent)}) : ""].join(" ")] : []))
  }
  function record() {
    const name = $("position-name").value.trim()
    if (!name) return say(["Give the position a name."])
    const {limits, chosen, reason, preference} = state
    change({positions: [...state.positions, {name, date: new Date().toISOString(), chosen, limits, ...preference, reason}]})
  }
  function decide() {
    const names = Logic.latest(state.positions).map(({name}) => name)
    const agrees = boxesOfPositions().map((box) => box.checked)
    change({decided: {date: new Date().toISOString(), chosen: state.chosen, agree: names.filter((_, k) => agrees[k]), dissent: names.filter((_, k) => !agrees[k])}})
  }
  // The positions of files are added, and nothing else changes unless it is asked for; a single file
  // without positions is taken whole.
  async function open(files) {
    const [remarks, positions] = [[], []]
    let single // the state of a single file
    for (const file of files) {
      const read = Logic.opened(data, await file.text())
      single = files.length === 1 && read.state
      remarks.push(...read.remarks.map((text) => `${file.name}: ${text}`))
      positions.push(...read.state?.positions ?? [])
    }
    const joined = (next) => Logic.checked(data, {...next, positions: [...state.positions, ...positions]}).state
    const whole = () => take({state: joined(single), remarks})
    if (!positions.length) return single ? whole() : say([...remarks, "No positions are added."])
    change(joined(state))
    say([...remarks, ["Positions are added. Limits, choice and decision are as before. ", single ? button("Take those of the file", whole) : null]])
  }

  function reset() {
    for (const input of document.querySelectorAll("[aria-invalid=true]")) input.setAttribute("aria-invalid", "false")
    inspected = -1
    change(initial.state)
  }

  function wire() {
    const goes = (steps) => () => {
      at = max(0, min(at + steps, past.length - 1))
      state = JSON.parse(past[at])
      soon()
    }
    const clicks = {
      undo: goes(-1), redo: goes(1), reset, save: saveDecision, print: () => print(),
      export: exportRows,
      open: () => $("file").click(), pin: () => pin(table.current()), choose: () => choose(table.current()),
      "save-page": savePage, keep: record, decide, skip: () => $("verdict").focus(),
      "by-preference": () => change({order: {by: state.order.by === "preference" ? "distance" : "preference", down: false}}),
    }
    for (const [id, action] of entriesOf(clicks)) $(id).onclick = action
    $("file").onchange = async () => {
      await open($("file").files)
      $("file").value = ""
    }
    $("preferences").ontoggle = soon
    for (const id of ["fixed", "dominated"]) $(id).onchange = () => change({[id]: $(id).checked})
    $("search").oninput = () => {
      table.home()
      soon()
    }
    $("reason").oninput = () => { state = {...state, reason: $("reason").value}; $("reason-printed").textContent = state.reason }
    $("reason").onchange = commit
    addEventListener("beforeunload", (event) => { if (JSON.stringify(state) !== saved) event.preventDefault() })
    const dye = () => { Charts.dye(); update(true) }
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", dye)
    const paper = (on) => () => {
      document.documentElement.classList.toggle("paper", on)
      $("record-foot").textContent = `${data.origin ? `From ${data.origin}. ` : ""}${$("count").textContent}. Printed ${new Date().toLocaleDateString(undefined, {dateStyle: "long"})}.`
      dye()
    }
    addEventListener("beforeprint", paper(true))
    addEventListener("afterprint", paper(false))
    addEventListener("focusin", enter)
    addEventListener("keydown", (event) => {
      // What is being typed the browser undoes; after that it would go on in another field.
      const {target} = event
      const isTyping = target.matches("textarea, input[type=text], input[type=search]") && target.value !== (target.id === "search" ? "" : entered)
      if (!(event.ctrlKey || event.metaKey) || isTyping) return
      const key = event.key.toLowerCase()
      if (key === "z" || key === "y") {
        event.preventDefault()
        $(key === "y" || event.shiftKey ? "redo" : "undo").click()
      }
    })
  }

  // Designs that came since. The charts keep their scales unless they must change.
  function grow(more) {
    Logic.grow(data, more)
    for (const {column: {range: [low, high], log}, scale} of controls.values()) if (scale) Object.assign(scale, {low, high, log})
    filtered = null
    update()
  }
  // Load the page anew, in the state that it has when the next one arrives.
  function reload(more) {
    isSaved()
    addEventListener("pagehide", () => sessionStorage.setItem(location.pathname, JSON.stringify({state, ...more()})))
    location.reload()
  }

  // Start: what the page was made with.

  const header = document.querySelector("header")
  new ResizeObserver(() => document.documentElement.style.setProperty("--head", `${header.offsetHeight}px`)).observe(header)
  buildLimits()
  buildColours()
  buildPreferences()
  const [first, second] = [data.objectives, limitable.filter((column) => column.role === "variable" && !column.texts)]
  buildScatter($("scatter-a"), "First plot", first[0], first[1] ?? mus[0])
  buildScatter($("scatter-b"), "Second plot", ...(second.length ? [second[0], second[1] ?? first[0]] : first.length > 2 ? first.slice(-2) : [mus[2], mus[1]]))
  wire()
  past[++at] = saved = JSON.stringify(state)
  say([...data.remarks.filter((text) => text.startsWith("Warning")), ...initial.remarks])
  if (data.further) renew("next", "16 more tests inside these limits: save the decision where the search was run, and run there ", make("code", data.further))
  document.body.classList.toggle("many", data.objectives.length > 6) // so that a print has one page
  update(true)
  document.body.dataset.ready = "yes"
  const preparing = Logic.prepare(data)
  setTimeout(function prepare() {
    for (const end = performance.now() + 10; performance.now() < end;) if (preparing.next().done) return
    setTimeout(prepare)
  })

  return {
    Logic, data, ready: performance.now(), update, grow, reload, decision, say, make, renew, $,
    state: () => state,
    set: (next, done = true) => { change(Logic.checked(data, next).state, done); update() },
    get left() { return left }, get ranking() { return ranking }, get verdict() { return verdict },
    get order() { return order }, get drawn() { return drawn }, get inspected() { return inspected },
    get dragging() { return dragging },
    get settled() { return !waiting && !following },
    get resting() { return page.settled && thinking === 0 }, plots, parallel, scale: scaleOf,
  }
})()
window.decisionPage = page
