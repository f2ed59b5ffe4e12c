// The decision page: controls, texts and the table. logic.js says what is left, ranked and best;
// charts.js draws. The state is one value that nothing changes in place: every control makes a new
// one through change(), and all of the page is told from it by update(), at most once a frame.
//
// Texts of the user's (names, units, labels, reasons) become text nodes or values, never markup.
"use strict"
const page = (() => {
  const payload = JSON.parse(document.getElementById("payload").textContent)
  const data = Logic.decode(payload)
  const MOST_DRAWN = 1000 // designs in a chart; more lines are a blur, and take longer than a frame
  const $ = (id) => document.getElementById(id)
  const countText = (count) => String(count).replace(/\B(?=(\d{3})+$)/g, "\u202f")
  // A name may be "constructor": only what a state says itself counts.
  const own = (object, name) => (Object.hasOwn(object, name) ? object[name] : null)
  const limitable = data.columns.filter((column) => column.role !== "geometric")

  // Numbers as people read them: 70040 for 7.004e+04, and 9.52×10⁶ where zeros would be counted.
  const readable = (text) => text.replace(/(?<=^|[\s(])(-?\d(?:\.\d+)?)e([+-]\d+)/g, (number, mantissa, power) => {
    const size = Math.abs(Number(number))
    if (size === 0 || (size >= 1e-5 && size < 1e6)) return String(Number(number))
    return `${mantissa}×10${Charts.raised(Number(power))}`
  })
  // On a scale over decades the digits follow the size of the number, not the range of the column.
  const written = (column, value) => readable(column.log && Number.isFinite(value)
    ? String(Number(value.toPrecision(4))) : Logic.written(column, value))

  // A difference, which is not 0 because its digits are finer than those of its column.
  const apart = (column, difference) => {
    const text = written(column, Math.abs(difference))
    return difference !== 0 && /^[0.]*$/.test(text) ? readable(Logic.short(Math.abs(difference), 2)) : text
  }

  // An element with properties, attributes (those with a dash, and role) and children.
  function make(tag, properties = {}, ...children) {
    const element = document.createElement(tag)
    for (const [name, value] of Object.entries(properties)) {
      if (name.includes("-") || name === "role") element.setAttribute(name, value)
      else element[name] = value
    }
    element.append(...children.flat().filter((child) => child !== null && child !== undefined))
    return element
  }

  // Give an element other children. Those that stay the same are kept, and of the others what differs
  // is written: what is made anew the browser styles, lays out and paints at every step. A control
  // stays only as long as it has its name, so that no click or focus goes over to another one.
  function renew(element, ...children) {
    const fresh = document.createDocumentFragment()
    fresh.append(...children)
    mend(element, fresh)
  }
  function mend(old, fresh) {
    let at = old.firstChild
    for (const child of [...fresh.childNodes]) {
      const next = at?.nextSibling
      if (!at) old.append(child)
      else if (at.nodeName !== child.nodeName || at.ariaLabel !== child.ariaLabel) at.replaceWith(child)
      else if (at.nodeType === Node.TEXT_NODE) at.data === child.data || (at.data = child.data)
      else {
        for (const {name} of [...at.attributes]) if (!child.hasAttribute(name)) at.removeAttribute(name)
        for (const {name, value} of child.attributes) {
          if (at.getAttribute(name) === value) continue
          name === "style" ? at.style.cssText = value : at.setAttribute(name, value) // as the policy allows
        }
        at.onclick = child.onclick
        mend(at, child)
      }
      at = next
    }
    while (at) {
      const next = at.nextSibling
      at.remove()
      at = next
    }
  }

  // The state, its history and its address.

  const initial = Logic.initial(data)
  let {state} = initial
  const past = Logic.history(state)
  let left, ranking, verdict, order
  let filtered = "" // the part of the state that left and ranking were made from
  let selected = new Set()
  const step = {last: 0} // milliseconds of the last update

  // Take a new state; done tells that the user's hand rests, so that undo comes back to here.
  let dragging = false
  function change(changes, done = true) {
    state = {...state, ...changes}
    // Words may become fewer while a hand drags, but nothing moves away under it.
    if (dragging !== !done) $("verdict").style.minHeight = done ? "" : `${$("verdict").offsetHeight}px`
    dragging = !done
    if (done) commit()
    soon()
  }

  // At once, so that nothing is lost, but not for every repeat of a key that is held: browsers
  // refuse hundreds of addresses in ten seconds.
  let addressWaits = 0
  let addressWritten = -Infinity
  function commit() {
    past.push(state)
    clearTimeout(addressWaits)
    const rest = addressWritten + 80 - performance.now()
    rest > 0 ? addressWaits = setTimeout(remember, rest) : remember()
  }
  function remember() {
    clearTimeout(addressWaits)
    addressWritten = performance.now()
    try { history.replaceState(null, "", Logic.toHash(state)) } catch { /* a sandbox without an address */ }
  }

  function take(anything) {
    const checked = Logic.checked(data, anything)
    if (checked.remarks.length) say(checked.remarks)
    change(checked.state)
  }

  function say(sentences) {
    const close = make("button", {className: "small", textContent: "Close", onclick: () => say([])})
    $("messages").replaceChildren(...(sentences.length ? [close] : []), ...sentences.map((text) => make("p", {textContent: text})))
  }

  let waiting = false
  function soon() {
    if (waiting) return
    waiting = true
    requestAnimationFrame(() => waiting && update())
  }

  // While a hand drags, parts that are out of sight wait until it rests.
  const seen = new Set()
  const sight = new IntersectionObserver((parts) => {
    for (const {target, isIntersecting} of parts) isIntersecting ? seen.add(target.id) : seen.delete(target.id)
    if (dragging) soon()
  })
  for (const part of $("page").children) sight.observe(part)
  const waits = (part) => dragging && !seen.has(part)

  // Everything on the page from the state.
  function update(everything = false) {
    const start = performance.now()
    const keepFocus = focusKept()
    waiting = false
    const filter = JSON.stringify([state.limits, state.categories, state.kept])
    const moved = filter !== filtered || everything
    if (moved) {
      filtered = filter
      left = Logic.left(data, state)
      ranking = Logic.ranked(data, left.mask)
      verdict = Logic.verdict(data, ranking)
      thinkLater()
    }
    order = Logic.order(data, ranking, state)
    if (selected.size) {
      const shown = new Uint8Array(data.total)
      for (const row of order) shown[row] = 1
      const kept = [...selected].filter((row) => shown[row])
      if (kept.length !== selected.size) selected = new Set(kept)
    }
    showLimits()
    showCounts()
    if (!waits("verdict")) showVerdict()
    if (!waits("compare")) showCompare()
    showPreference()
    showCharts(everything)
    if (!waits("designs")) table.show()
    if (!waits("steps")) showSteps()
    keepFocus()
    step.last = performance.now() - start
  }

  // Buttons are made anew or disabled: who works by keys stays on the one that was pressed, or
  // else at the first beside it.
  function focusKept() {
    const told = (element) => element.getAttribute("aria-label") ?? element.textContent
    const element = document.activeElement
    const place = element?.closest("section .bar, section, .actions")
    if (!place) return () => 0 // the text of the whole page, its data among it, is none to look for
    const name = told(element)
    return () => {
      if (element.isConnected && !element.disabled) return
      const buttons = [...place.querySelectorAll("button:enabled")]
      const next = buttons.find((button) => told(button) === name) ?? buttons[0]
      next?.focus({preventScroll: true})
    }
  }

  // What takes longer than a frame waits until the hand rests.
  let thinking = 0
  function thinkLater() {
    clearTimeout(thinking)
    $("cautions").replaceChildren()
    thinking = setTimeout(() => {
      thinking = 0
      if (!verdict) return
      const sentences = Logic.cautions(data, ranking)
      $("cautions").replaceChildren(...Logic.stretched(data, ranking).map(outliers),
        ...sentences.map((text) => make("p", {className: "caution", textContent: readable(text)})))
    }, 200 + 10 * step.last) // longer where a ranking takes long, so that it comes between no two steps
  }

  // Penalties and the like, which the ranks must count, but a reader would not.
  function outliers({column, count, worst, ends}) {
    const limit = limitOf(column) ?? [null, null]
    const leave = () => setLimit(column, ends.map((end, k) => end ?? limit[k]), true)
    return make("p", {className: "caution"}, `${count === 1 ? "1 Pareto-optimal design is" : `${countText(count)} Pareto-optimal designs are`} far from all others in ` +
      `${column.name} (${readable(Logic.short(worst, 4))}): perhaps a failure. Its range, by which all are ranked, is stretched. `,
    make("button", {className: "small", textContent: count === 1 ? "Leave it out" : "Leave them out", onclick: leave}))
  }

  // Designs.

  const rowOf = (id) => data.rowOf.get(id) ?? -1
  const isPrototype = (row) => row >= data.n
  const called = (row) => Logic.called(data, row)
  const chosenRow = () => (state.chosen === null ? -1 : rowOf(state.chosen))
  const pinned = () => state.pins.map(rowOf).filter((row) => row >= 0)

  function look(row) {
    if (isPrototype(row)) return "prototype"
    if (!ranking.pareto[row]) return "dominated"
    if (ranking.isBest[row]) return "6"
    return ranking.rank[row] > 0 ? String(ranking.rank[row]) : "unranked"
  }

  function choose(row) {
    if (row >= 0) change({chosen: state.chosen === data.ids[row] ? null : data.ids[row]})
  }

  function pin(row) {
    if (row < 0) return
    const id = data.ids[row]
    const pins = state.pins.includes(id) ? state.pins.filter((other) => other !== id) : [...state.pins, id]
    if (pins.length > Logic.MOST_PINS) return say([`Five designs are pinned. Take one out of the comparison before you pin ${called(row)}.`])
    change({pins})
  }

  const toggles = (row) => [
    make("button", {className: "small", textContent: state.chosen === data.ids[row] ? "Chosen ✓" : "Choose",
      "aria-pressed": state.chosen === data.ids[row], "aria-label": `Choose ${called(row)}`, onclick: () => choose(row)}),
    make("button", {className: "small", textContent: state.pins.includes(data.ids[row]) ? "Pinned ✓" : "Pin to compare",
      "aria-pressed": state.pins.includes(data.ids[row]), "aria-label": `Pin ${called(row)}`, onclick: () => pin(row)}),
  ]

  // The verdict.

  const percent = (share) => {
    const value = 100 * Math.abs(share)
    return value === 0 ? "0 %" : value < 1 ? "< 1 %" : value > 9999 ? "> 9999 %" : `${Math.round(value)} %`
  }

  function showVerdict() {
    const words = $("verdict-words")
    $("verdict-table").hidden = !verdict
    if (!verdict) {
      renew(words, make("p", {className: "warning", textContent: `No design is left: ${remedy()}`}))
      renew($("verdict-more"))
      renew($("verdict-table"))
    } else {
      const {row} = verdict
      const rank = ranking.rank[row]
      renew(words,
        make("p", {className: "best"}, Charts.icon("6"), make("strong", {textContent: called(row)}),
          make("span", {className: "hint", textContent: rank === 6 ? "rank 6, the highest" : rank > 0 ? `rank ${rank}` : ""}), ...toggles(row)),
        // Of many criteria the table below tells the same and is read faster.
        ...verdict.sentences.slice(0, data.criteria.length > 6 ? 1 : 2).map((text) => make("p", {textContent: readable(text)})),
        ...(verdict.bad ? [make("p", {className: "warning", textContent: verdict.warning})] : []))
      renew($("verdict-table"),
        make("thead", {}, make("tr", {}, ...["Criterion", "Value", "Best left", "From its best", "Share of range"].map(
          (text, k) => make("th", {textContent: text, scope: "col", className: ["", "number", "number", "number", "share"][k]})))),
        make("tbody", {}, verdict.criteria.map((criterion) => {
          const column = data.by.get(criterion.name)
          const weak = verdict.weakest.includes(criterion.name)
          return make("tr", {className: weak ? "weak" : ""},
            make("th", {scope: "row"}, Charts.broken(column.label), weak && verdict.criteria.length > 1 ? make("em", {textContent: " weakest"}) : null),
            make("td", {className: "number", textContent: written(column, criterion.value)}),
            make("td", {className: "number", textContent: written(column, criterion.best)}),
            make("td", {className: "number", textContent: apart(column, criterion.away)}),
            make("td", {className: "share"}, bar(criterion.share), make("span", {textContent: percent(criterion.share)})))
        })))
      // Long numbers need the room of the bars.
      $("verdict-table").classList.toggle("long", verdict.criteria.some(({name, value}) => written(data.by.get(name), value).length > 10))
      const {whole, ties} = verdict
      renew($("verdict-more"),
        ...(whole ? [make("p", {className: "whole"}, readable(whole.sentence), " ", ...toggles(whole.row).slice(1))] : []),
        ...(ties && ties.length > 1 ? [make("p", {textContent: `Equally good: ${ties.slice(0, 5).map(called).join(", ")}${ties.length > 5 ? ` and ${countText(ties.length - 5)} more` : ""}.`})] : []))
    }
    const row = chosenRow()
    const where = row < 0 ? "" : verdict && row === verdict.row ? "the best compromise" : rankText(row)
    renew($("chosen"), ...(row < 0
      ? ["No design is chosen yet.", make("span", {className: "screen", textContent: " Choose one here, in the table or by a click in a chart."})]
      : ["Chosen: ", make("strong", {textContent: called(row)}), " ", make("span", {className: left.mask[row] ? "" : "warning", textContent: `(${where})`}),
        " ", make("button", {className: "small", textContent: "Take back", onclick: () => change({chosen: null})})]))
    const told = row >= 0 ? row : verdict?.row ?? -1
    const parts = told < 0 ? [] : data.columns.filter((column) => column.role === "variable")
      .map((column) => `${column.name} = ${cellText(column, told)}${column.unit ? ` ${column.unit}` : ""}`)
    renew($("chosen-variables"), parts.length ? `Variables of ${called(told)}: ${parts.join(", ")}.` : "")
    if ($("reason") !== document.activeElement) $("reason").value = state.reason
    renew($("reason-printed"), state.reason || "–")
  }

  function bar(share) {
    const inner = make("i")
    inner.style.width = `${Math.min(100, Math.max(0, 100 * share))}%`
    return make("span", {className: "bar-of-share", "aria-hidden": "true"}, inner)
  }

  // What to do where nothing is left: the limit without which most would come back is the one to
  // widen, or if more than one stands in the way of all, that which rejects most.
  function remedy() {
    const {rejects, only} = left
    const [most] = [...rejects.keys()].sort((a, b) => only.get(b) - only.get(a) || rejects.get(b) - rejects.get(a))
    if (most === undefined) return "reset the page."
    const alone = only.get(most)
    return `widen the limits, first of all that on ${most}, which ${alone ? `alone rejects ${countText(alone)}` : `rejects ${countText(rejects.get(most))}`}.`
  }

  function showCounts() {
    const dominated = left.count - ranking.front.length
    renew($("count"), left.count === 0 ? "No design is left"
      : `${countText(left.count)} of ${countText(data.n)} ${data.n === 1 ? "design" : "designs"} within the limits, ${countText(ranking.front.length)} Pareto-optimal`)
    $("count").classList.toggle("warning", left.count === 0)
    // Not disabled in earnest: a key that is held would go on with the button beside it.
    $("undo").setAttribute("aria-disabled", !past.canUndo)
    $("redo").setAttribute("aria-disabled", !past.canRedo)
    const shown = selected.size || order.length
    renew($("export"), `Export ${countText(shown)} ${selected.size ? "selected" : "shown"} as CSV`)
    $("export").disabled = shown === 0
    renew($("selection"), [`${countText(order.length)} shown`, state.kept ? "only those kept" : "", selected.size ? `${countText(selected.size)} selected` : ""].filter(Boolean).join(", "))
    $("clear").disabled = selected.size === 0
    $("keep").disabled = selected.size === 0 && state.kept === null
    renew($("keep"), state.kept !== null && selected.size === 0 ? "Keep all again" : "Keep selected only")
    const counts = new Uint32Array(7)
    for (const row of ranking.front) counts[ranking.rank[row]]++
    for (const box of $("ranks").querySelectorAll("input")) {
      const rank = box.value
      box.checked = rank === "dominated" ? state.dominated : state.ranks === null || state.ranks.includes(Number(rank))
      renew(box.parentElement.querySelector("b"), countText(rank === "dominated" ? dominated : counts[rank]))
    }
  }

  // Comparison: what it holds and against what is Logic.compared's.

  function showCompare() {
    const parts = Logic.compared(data, ranking, state)
    const rows = parts.map(({row}) => row)
    const hint = $("compare-hint")
    $("compare-table").hidden = rows.length < 2
    renew(hint, ...(rows.length === 0 ? ["No design is left to compare."] : rows.length === 1 ? ["One design is left, and none to compare it with."]
      : [`Gains and losses against ${called(rows[0])}: in units`, make("span", {className: "shares", textContent: ", in per cent of its value / of the range"}), "."]))
    // By what the reader has asked for, so that nothing changes places under a limit that is dragged.
    $("page").classList.toggle("wide", state.pins.length + (state.chosen !== null) + (data.total > data.n) > 2)
    if (rows.length < 2) return renew($("compare-table"))
    const table = Logic.compare(data, ranking, rows, rows[0])
    const heads = parts.map(({row, roles}, k) => {
      const id = data.ids[row]
      const sums = [[1, "better"], [-1, "worse"]].map(([sign, word]) => [table.criteria.filter(({better}) => better[k] === sign).length, word])
      const out = state.pins.includes(id) || state.base === id
      return make("th", {scope: "col"}, left.mask[row] ? Charts.icon(look(row)) : null, make("span", {className: "label", textContent: called(row)}),
        make("div", {className: "roles", textContent: [...roles, left.mask[row] ? "" : "outside the limits"].filter(Boolean).join(", ")}),
        k > 0 ? make("div", {className: "roles", textContent: sums.map(([sum, word]) => `${sum} ${word}`).join(", ")}) : null,
        make("div", {className: "tools"},
          k > 0 ? make("button", {className: "small", textContent: "as base", "aria-label": `Compare against ${called(row)}`, title: "Compare the others against it", onclick: () => change({base: id})}) : null,
          out ? make("button", {className: "small", textContent: "×", "aria-label": `Take ${called(row)} out of the comparison`, title: "Take out", onclick: () => takeOut(id)}) : null))
    })
    // Made anew: Chromium draws sticky cells that stay, and have moved, off by a pixel.
    $("compare-table").replaceChildren(
      make("thead", {}, make("tr", {}, make("th", {textContent: "Criterion", scope: "col"}), heads)),
      make("tbody", {}, table.criteria.map((criterion) => {
        const column = data.by.get(criterion.name)
        return make("tr", {}, make("th", {scope: "row"}, Charts.broken(column.label)), rows.map((_, k) => {
          const value = make("div", {textContent: written(column, criterion.values[k])})
          const better = criterion.better[k]
          if (k === 0) return make("td", {className: "number"}, value)
          if (better === 0) return make("td", {className: "number"}, value, make("div", {className: "hint", textContent: "the same"}))
          const shares = [criterion.percent[k] / 100, criterion.share[k]].map((share) => (Number.isFinite(share) ? percent(share) : "–")).join(" / ")
          return make("td", {className: "number"}, value,
            make("div", {className: better > 0 ? "gain" : "loss", textContent: `${apart(column, criterion.differences[k])} ${better > 0 ? "better" : "worse"}`}),
            make("div", {className: "hint shares", textContent: shares}))
        }))
      })))
  }

  const takeOut = (id) => change({pins: state.pins.filter((other) => other !== id), base: state.base === id ? null : state.base})

  // What a step gives and costs: in the criteria that it improves, and up to three of each in all.
  function stepText({gains, names}) {
    const sides = [[1, "better in"], [-1, "worse in"]].map(([sign, word]) => {
      const told = gains.filter(({gain}) => sign * gain > 0)
        .sort((a, b) => names.includes(b.name) - names.includes(a.name) || Math.abs(b.share) - Math.abs(a.share))
      const parts = told.slice(0, sign > 0 ? Math.max(3, names.length) : 3).map(({name, unit, gain, share}) =>
        `${name} by ${apart(data.by.get(name), gain)}${unit && `\u00a0${unit}`} (${percent(share).replaceAll(" ", "\u00a0")})`)
      const more = told.length - parts.length
      return told.length ? `${word} ${parts.join(", ")}${more ? ` and less in ${more} more` : ""}` : ""
    })
    return sides.filter(Boolean).join("; ")
  }

  // For the chosen design, or else the best, the cheapest step to improve each criterion.
  function showSteps() {
    const chosen = chosenRow()
    const row = chosen >= 0 && left.mask[chosen] && ranking.pareto[chosen] ? chosen : verdict?.row ?? -1
    $("steps").hidden = row < 0
    if (row < 0) return
    renew($("steps-title"), `Cheapest step to improve each criterion of ${called(row)}`)
    const {steps} = row === verdict.row ? verdict : Logic.explain(data, ranking, row)
    $("steps").hidden = steps.length === 0
    renew($("steps-table"), make("tbody", {}, steps.map((next) => make("tr", {},
      make("th", {scope: "row"}, Charts.broken(next.names.join(", "))), make("td", {title: readable(next.text)}, make("strong", {textContent: next.label}), `: ${stepText(next)}`),
      make("td", {}, next.row >= 0 ? toggles(next.row).slice(1) : null)))))
  }

  // Limits: number fields, a slider with two ends, the histogram behind it.

  const limitOf = (column) => own(state.limits, column.name)
  const controls = new Map()

  function setLimit(column, limit, done) {
    const {[column.name]: _, ...others} = state.limits
    const empty = limit[0] === null && limit[1] === null
    change({limits: empty ? others : {...others, [column.name]: limit}}, done)
  }

  // A slider gives what can be read: the digits that the column is written with, so that the limit
  // in force is the number in its field.
  const rounded = ({log, notation: [kind, digits]}, value) => Number(log ? value.toPrecision(4)
    : kind === "fixed" ? value.toFixed(digits) : value.toExponential(digits))

  // A number that fits its field.
  const short = (column, value) => {
    const text = written(column, value)
    return text.length <= 9 ? text : readable(value.toExponential(2))
  }

  const hasValues = (column) => column.values.some(Number.isFinite)

  const STEPS = 1000 // finer than a pixel of the track
  function limitControl(column) {
    if (column.texts) return categoryControl(column)
    const [low, high] = column.range
    const name = column.label
    if (!(high > low)) {
      const all = column.beyond ? "all Pareto-optimal designs" : "all"
      return make("p", {className: "constant"}, Charts.broken(name), `: ${hasValues(column) ? `${written(column, low)} for ${all}` : "no values"}`)
    }
    const scale = {low, high, log: column.log}
    const field = (k) => {
      const input = make("input", {type: "text", inputMode: "decimal", autocomplete: "off", placeholder: short(column, k ? high : low),
        title: `${k ? "Greatest" : "Least"} shown: ${written(column, k ? high : low)}`,
        "aria-label": `${name}, ${k ? "at most" : "at least"}`, "aria-describedby": `note-${column.field}`})
      input.addEventListener("change", () => {
        const {value, wrong: why} = Logic.typed(input.value, column)
        const next = [...(limitOf(column) ?? [null, null])]
        next[k] = value
        const wrong = why ?? (next[0] !== null && next[1] !== null && next[0] > next[1] ? "The lower end is above the upper one." : "")
        // What is wrong stays to be mended, until this limit is set otherwise.
        control.wrong[k] = wrong && {why: wrong, beside: JSON.stringify(limitOf(column))}
        wrong ? soon() : setLimit(column, next, true)
      })
      return input
    }
    const thumb = (k) => {
      const input = make("input", {type: "range", min: 0, max: STEPS, step: 1, "aria-label": `${name}, ${k ? "upper" : "lower"} limit`})
      // A limit at the end of its track limits nothing; the one in hand stops at the other.
      const moved = (done) => {
        const other = limitOf(column)?.[1 - k] ?? null
        const at = Number(input.value)
        let value = at === (k ? STEPS : 0) ? null : rounded(column, Charts.valueAt(scale, at / STEPS))
        if (value !== null && other !== null && (k ? value < other : value > other)) value = other
        setLimit(column, k ? [other, value] : [value, other], done)
      }
      input.addEventListener("input", () => moved(false))
      input.addEventListener("change", () => moved(true))
      input.addEventListener("pointerup", () => dragging && moved(true)) // back where it was, without a change
      return input
    }
    const note = make("p", {className: "hint note", id: `note-${column.field}`})
    const canvas = make("canvas", {"aria-hidden": "true"})
    const [fields, thumbs] = [[field(0), field(1)], [thumb(0), thumb(1)]]
    const sense = column.role === "criterion" || column.maximize ? make("span", {className: "hint", textContent: column.maximize ? "more is better" : "less is better"}) : null
    const control = {column, scale, fields, thumbs, note, canvas, all: null, wrong: ["", ""]}
    controls.set(column, control)
    return make("div", {className: "limit", role: "group", "aria-label": `Limits on ${name}`},
      make("div", {className: "name"}, make("span", {}, Charts.broken(name)), sense),
      make("div", {className: "ends"}, fields[0], make("div", {className: "slider"}, canvas, thumbs), fields[1]), note)
  }

  const MOST_BOXES = 200 // names of designs have no boxes: nobody ticks them, and thousands slow every step
  function categoryControl(column) {
    const known = new Set(column.values.subarray(0, data.n)) // an existing design may have another
    const found = column.texts.filter((_, k) => known.has(k))
    const texts = found.length > MOST_BOXES ? [] : found
    const boxes = texts.map((text) => make("input", {type: "checkbox", value: text}))
    const tick = (on) => { for (const box of boxes) box.checked = on; takeBoxes() }
    const takeBoxes = () => {
      const {[column.name]: _, ...others} = state.categories
      const allowed = boxes.filter((other) => other.checked).map((other) => other.value)
      change({categories: allowed.length === boxes.length ? others : {...others, [column.name]: allowed}})
    }
    for (const box of boxes) box.addEventListener("change", takeBoxes)
    const note = make("p", {className: "hint note"})
    controls.set(column, {column, boxes, note})
    return make("fieldset", {className: "limit categories"}, make("legend", {textContent: column.label}),
      boxes.length > 6 ? make("div", {className: "bar"}, [["All", true], ["None", false]].map(([textContent, on]) =>
        make("button", {className: "small", textContent, "aria-label": `${textContent} of ${column.label}`, onclick: () => tick(on)}))) : null,
      make("div", {className: "boxes"}, texts === found ? boxes.map((box, k) => make("label", {}, box, texts[k] || "(missing)"))
        : make("span", {className: "hint", textContent: `${countText(found.length)} different texts, too many to tick`})), note)
  }

  function notes(column) {
    const {rejects, relax} = left
    const told = []
    if (rejects.has(column.name)) told.push(`rejects ${countText(rejects.get(column.name))}`)
    const ends = relax.get(column.name)
    if (ends?.low) told.push(`from ${written(column, ends.low.value)} on it would bring back ${countText(ends.low.back)}`)
    if (ends?.high) told.push(`up to ${written(column, ends.high.value)} it would bring back ${countText(ends.high.back)}`)
    if (column.clipped > 0) told.push(`${countText(column.clipped)} beyond the ends of the slider`)
    return told.join("; ")
  }

  function showLimits() {
    for (const control of controls.values()) {
      const {column, fields, thumbs, note, boxes, wrong = []} = control
      // Of a group that is folded nothing is seen.
      const limit = limitOf(column)
      const group = note.closest("details")
      const told = wrong.map((one) => (one && one.beside === JSON.stringify(limit) ? one.why : ""))
      if (boxes) {
        const allowed = own(state.categories, column.name)
        boxes.forEach((box) => { box.checked = !allowed || allowed.includes(box.value) })
      } else {
        const share = Charts.place(control.scale)
        fields.forEach((field, k) => {
          const value = limit?.[k] ?? null
          const text = value === null ? "" : String(value)
          const typed = field === document.activeElement && Logic.typed(field.value, column).value === value
          if (!told[k] && field.value !== text && !typed) field.value = text
          field.setCustomValidity(told[k])
          field.setAttribute("aria-invalid", String(told[k] !== ""))
          const at = value === null ? k * STEPS : Math.min(STEPS, Math.max(0, Math.round(share(value) * STEPS)))
          if (Number(thumbs[k].value) !== at) thumbs[k].value = at
          thumbs[k].setAttribute("aria-valuetext", value === null ? "no limit" : written(column, value))
        })
        // Where both ends meet at the right, the lower one is the one that can still move.
        thumbs[0].classList.toggle("above", Number(thumbs[0].value) > STEPS / 2)
        if (!group || group.open) showHistogram(control)
      }
      renew(note, [...told, notes(column)].filter(Boolean).join(" "))
      note.classList.toggle("warning", told.some(Boolean))
      note.closest(".limit").classList.toggle("set", Boolean(limit) || own(state.categories, column.name) !== null)
    }
    for (const group of $("limit-groups").querySelectorAll("details")) {
      const set = group.querySelectorAll(".limit.set").length
      renew(group.querySelector("summary b"), set ? `${set} set` : "")
    }
    const lines = limitable.flatMap((column) => {
      const [low, high] = limitOf(column) ?? [null, null]
      const allowed = own(state.categories, column.name)
      if (allowed) return [`${column.name}: ${allowed.join(", ") || "none"}`]
      if (low === null && high === null) return []
      const unit = column.unit ? ` ${column.unit}` : ""
      return [low === null ? `${column.name} at most ${high}${unit}` : high === null ? `${column.name} at least ${low}${unit}`
        : `${column.name} from ${low} to ${high}${unit}`]
    })
    if (state.kept !== null) lines.push(`only ${countText(state.kept.length)} designs, kept by hand`)
    renew($("record-limits"), ...(lines.length ? lines : ["None: all designs count."]).map((text) => make("li", {textContent: text})))
  }

  function showHistogram(control) {
    if (!control.bins) {
      control.bins = Charts.bins(Logic.values(data, ranking, control.column), control.scale)
      control.all = new Uint32Array(Charts.BINS)
      for (const row of data.whole.front) if (control.bins[row] < 255) control.all[control.bins[row]]++
    }
    const counts = new Uint32Array(Charts.BINS)
    const {bins} = control
    for (const row of ranking.front) if (bins[row] < 255) counts[bins[row]]++
    control.draw ??= Charts.histogram(control.canvas)
    control.draw(control.all, counts)
  }

  function buildLimits() {
    const groups = [["criterion", "Criteria"], ["variable", "Variables"], ["output", "Further outputs"]]
    for (const [role, text] of groups) {
      const columns = limitable.filter((column) => column.role === role)
      if (!columns.length) continue
      const open = role === "criterion" || limitable.length <= 6
      $("limit-groups").append(make("details", {open, ontoggle: (event) => event.target.open && soon()},
        make("summary", {}, `Limits on ${text.toLowerCase()} `, make("b", {className: "hint"})), columns.map(limitControl)))
    }
    const ranks = [["6", "rank 6, best"], ["5", "rank 5"], ["4", "rank 4"], ["3", "rank 3"], ["0", "unranked"], ["dominated", "dominated"]]
    for (const [rank, text] of ranks) {
      const box = make("input", {type: "checkbox", value: rank})
      box.addEventListener("change", () => {
        if (rank === "dominated") return change({dominated: box.checked})
        const on = [...$("ranks").querySelectorAll("input:checked")].map((other) => Number(other.value)).filter((value) => value === value)
        change({ranks: on.length === ranks.length - 1 ? null : on})
      })
      $("ranks").append(make("label", {}, box, Charts.icon(rank === "0" ? "unranked" : rank), make("span", {textContent: text}), make("b", {className: "hint"})))
    }
    if (data.total > data.n) $("ranks").append(make("p", {className: "key"}, Charts.icon("prototype"), "prototype, always shown"))
    $("ranks").append(make("p", {className: "key"}, Charts.icon("chosen"), "chosen", Charts.icon("pinned"), "pinned"))
    const {count: failed, reasons} = data.failed
    const told = data.remarks.filter((text) => !text.startsWith("Warning"))
    if (failed) told.push(`${countText(failed)} tests failed${reasons.length ? `: ${reasons.map(([why, many]) => `${why} (${many})`).join(", ")}` : ""}. They are not on the page.`)
    if (data.infeasible) told.push(`${countText(data.infeasible)} designs violate constraints. They are not on the page.`)
    $("remarks").append(...told.map((text) => make("p", {className: "hint", textContent: text})))
    $("scale").textContent = data.normalize ? ", each criterion in units of its range" : ", the criteria in their own units"
  }

  // Preferences.

  const wishes = []
  function buildPreferences() {
    $("preference-table").append(make("thead", {}, make("tr", {}, ["Criterion", "Weight", "Wished"].map((textContent) => make("th", {textContent, scope: "col"})))))
    const body = make("tbody")
    for (const column of data.criteria) {
      const inputs = [["weights", "1", "weight"], ["aspiration", "its best", "wished value"]].map(([kind, placeholder, told]) => {
        const input = make("input", {type: "text", inputMode: "decimal", autocomplete: "off", placeholder, "aria-label": `${column.label}, ${told}`})
        input.addEventListener("change", () => {
          const {value, wrong: why} = Logic.typed(input.value, kind === "weights" ? null : column)
          const wrong = why ?? (kind === "weights" && value < 0 ? "A weight is 0 or more." : "")
          input.setAttribute("aria-invalid", String(wrong !== ""))
          if (wrong) return say([`${column.label}, ${told}: ${wrong}`])
          const {[column.name]: _, ...others} = state.preference[kind]
          change({preference: {...state.preference, [kind]: value === null ? others : {...others, [column.name]: value}}})
        })
        wishes.push({input, kind, column})
        return make("td", {}, input)
      })
      body.append(make("tr", {}, make("th", {scope: "row"}, Charts.broken(column.label)), inputs))
    }
    $("preference-table").append(body)
  }

  function showPreference() {
    for (const {input, kind, column} of wishes) {
      const value = own(state.preference[kind], column.name)
      const wrong = input.getAttribute("aria-invalid") === "true"
      if (input !== document.activeElement && !wrong) input.value = value === null ? "" : String(value)
    }
    const on = state.order.by === "preference"
    $("by-preference").setAttribute("aria-pressed", String(on))
    const used = Object.keys(state.preference.weights).length + Object.keys(state.preference.aspiration).length > 0
    if (!($("preferences").open || on || used) || !verdict) return renew($("preference-words"))
    const [first] = Logic.preference(data, ranking, state.preference).best
    renew($("preference-words"), "First by your preferences: ", make("strong", {textContent: called(first)}),
      first === verdict.row ? ", also the best compromise. " : ". ", ...toggles(first).flatMap((button) => [button, " "]))
  }

  // Charts.

  // A fixed order without pattern, so that the sample drawn is the same at every step.
  function shuffled(n) {
    const rows = Int32Array.from({length: n}, (_, row) => row)
    let seed = 12345
    for (let k = n - 1; k > 0; k--) {
      seed = (Math.imul(seed, 1664525) + 1013904223) >>> 0
      const other = Math.floor((seed / 2 ** 32) * (k + 1)) // its lower bits do have a pattern
      ;[rows[k], rows[other]] = [rows[other], rows[k]]
    }
    return rows
  }
  const shuffle = shuffled(data.n)

  // Up to MOST_DRAWN rows, stable from step to step.
  function sample(wanted) {
    const rows = []
    for (let k = 0; k < shuffle.length && rows.length < MOST_DRAWN; k++) if (wanted(shuffle[k])) rows.push(shuffle[k])
    return rows
  }

  let context = []
  let contextOf = null
  let scales = new Map()
  let axesTold = ""
  let drawn = []
  const plots = []

  // The ends of an axis: the range of the Pareto set, or of what is left.
  function scaleOf(column) {
    if (scales.has(column)) return scales.get(column)
    let [low, high] = column.texts ? [0, column.texts.length - 1] : column.range
    if (column.role === "geometric") [low, high] = endsOf(data.whole, column)
    if (state.axes.zoom && !column.texts) {
      const [least, most] = endsOf(ranking, column)
      if (least < most) [low, high] = [least, most]
    }
    if (!(low <= high)) [low, high] = [0, 1]
    if (high - low <= 1e-12 * Math.max(Math.abs(low), Math.abs(high))) high = low // rounding is no distance
    scales.set(column, {low, high, log: column.log && low > 0})
    return scales.get(column)
  }

  function endsOf(ranking, column) {
    const values = Logic.values(data, ranking, column)
    let [least, most] = [Infinity, -Infinity]
    for (const row of state.dominated ? ranking.rows : ranking.front) {
      if (values[row] < least) least = values[row]
      if (values[row] > most) most = values[row]
    }
    return [least, most]
  }

  function modelOfCharts() {
    const chosen = chosenRow()
    const marks = []
    for (let row = data.n; row < data.total; row++) marks.push({row, look: "prototype"})
    for (const row of pinned()) marks.push({row, look: "pinned"})
    if (verdict) marks.push({row: verdict.row, look: "6"})
    if (chosen >= 0) marks.push({row: chosen, look: "chosen"})
    return {context, left: drawn, marks, selected, look, scale: scaleOf, limit: limitOf,
      values: (column) => Logic.values(data, ranking, column), everything: () => [...order]}
  }

  function showCharts(everything) {
    const dominated = state.dominated
    const fresh = contextOf !== dominated
    if (fresh) {
      context = sample((row) => dominated || data.whole.pareto[row])
      contextOf = dominated
    }
    const key = JSON.stringify(state.axes)
    const moved = key !== axesTold
    const rescaled = moved || everything || (state.axes.zoom && !dragging)
    if (rescaled) scales = new Map()
    if (moved) {
      axesTold = key
      parallel.setAxes(axesShown().map((name) => data.by.get(name)))
      showAxes()
    }
    $("zoom").setAttribute("aria-pressed", String(state.axes.zoom))
    const ranks = state.ranks && new Set(state.ranks)
    const shown = (row) => left.mask[row] && (ranking.pareto[row] ? !ranks || ranks.has(ranking.rank[row]) : dominated)
    drawn = sample(shown)
    const number = order.length - (data.total - data.n)
    if (number > drawn.length) {
      // Ranked designs are few and are all drawn, on top.
      const have = new Set(drawn)
      for (const row of ranking.front) if (ranking.rank[row] > 0 && shown(row) && !have.has(row)) drawn.push(row)
    }
    drawn.sort((a, b) => level(a) - level(b))
    const total = wholeCount(dominated)
    renew($("drawn"), [
      total > context.length ? `grey: ${countText(context.length)} of ${countText(total)} designs, a fixed sample` : "",
      number > drawn.length ? `coloured: ${countText(drawn.length)} of ${countText(number)} left, every ranked one among them` : "",
    ].filter(Boolean).join("; "))
    const model = modelOfCharts()
    const all = fresh || rescaled
    if (!waits("parallel")) parallel.draw(model, all)
    for (const plot of plots) if (!waits(plot.part)) plot.draw(model, all || plot.live())
  }

  // The axes of the parallel coordinates: the user's, or the criteria and the first others.
  const usual = [...data.criteria, ...limitable.filter((column) => column.role !== "criterion" && !column.texts && hasValues(column))]
    .slice(0, Math.max(data.criteria.length, 8)).map((column) => column.name)
  const axesOrder = () => (state.axes.order.length ? state.axes.order : usual)
  function axesShown() {
    const hidden = new Set(state.axes.hidden)
    const shown = axesOrder().filter((name) => !hidden.has(name))
    return shown.length ? shown : axesOrder() // an address may hide all
  }

  const wholeCount = (dominated) => (dominated ? data.n : data.whole.front.length)
  const level = (row) => (ranking.pareto[row] ? ranking.rank[row] : -1)

  function moveAxis(column, steps) {
    const shown = axesShown()
    const from = shown.indexOf(column.name)
    const to = Math.min(shown.length - 1, Math.max(0, from + steps))
    if (from < 0 || from === to) return
    const order = axesOrder().filter((name) => name !== column.name)
    order.splice(order.indexOf(shown[to]) + (to > from ? 1 : 0), 0, column.name)
    change({axes: {...state.axes, order}})
    update()
  }

  function hideAxis(column, hide) {
    const [order, hidden] = [axesOrder(), state.axes.hidden]
    const others = hidden.filter((name) => name !== column.name)
    if (hide && axesShown().length <= 1) return
    change({axes: {...state.axes, order: order.includes(column.name) ? order : [...order, column.name], hidden: hide ? [...others, column.name] : others}})
    update()
  }

  // The same by buttons: a list of all columns, which also reaches those that are hidden.
  function showAxes() {
    const [order, shown] = [axesOrder(), axesShown()]
    const focus = document.activeElement?.dataset.axis
    const names = [...order, ...data.columns.map((column) => column.name).filter((name) => !order.includes(name))]
    $("axes-list").replaceChildren(...names.map((name) => {
      const column = data.by.get(name)
      const on = shown.includes(name)
      const box = make("input", {type: "checkbox", checked: on, onchange: () => hideAxis(column, on)})
      const mover = (text, told, steps) => {
        const button = make("button", {className: "small", textContent: text, disabled: !on, "aria-label": `Move ${column.label} to the ${told}`, onclick: () => moveAxis(column, steps)})
        button.dataset.axis = `${told} ${column.field}`
        return button
      }
      return make("li", {}, make("label", {}, box, column.label), mover("←", "left", -1), mover("→", "right", 1))
    }))
    if (focus) [...$("axes-list").querySelectorAll("button")].find((button) => button.dataset.axis === focus)?.focus()
  }

  function hover(row, x, y) {
    const tip = $("tip")
    tip.hidden = row === undefined || row < 0
    if (tip.hidden) return
    const lines = data.columns.filter((column) => column.role !== "geometric").slice(0, 16)
    tip.replaceChildren(make("strong", {textContent: called(row)}), ` ${rankText(row)}`, make("table", {}, lines.map((column) => make("tr", {},
      make("td", {textContent: column.label}), make("td", {className: "number", textContent: cellText(column, row)})))))
    const [width, height] = [tip.offsetWidth, tip.offsetHeight]
    tip.style.left = `${Math.max(4, x + 16 + width > innerWidth ? x - width - 12 : x + 16)}px`
    tip.style.top = `${Math.max(4, Math.min(y + 12, innerHeight - height - 6))}px`
  }

  const parallel = Charts.parallel($("parallel-chart"), {
    limit: setLimit, move: moveAxis, hide: (column) => hideAxis(column, true), pick: choose, hover,
  })

  function buildScatter(section, name, x, y) {
    const columns = {x, y}
    const factors = make("span", {className: "hint"})
    const out = make("button", {className: "small", textContent: "Whole", title: "Back to the whole range", disabled: true})
    const zoom = make("button", {className: "small", textContent: "Drag zooms", "aria-pressed": "false", title: "A drag zooms instead of selecting"})
    const select = (axis) => {
      const groups = [["criterion", "Criteria"], ["variable", "Variables"], ["output", "Further outputs"], ["geometric", "Distances"]]
      const element = make("select", {"aria-label": `${name}, ${axis} axis`}, groups.map(([role, label]) => {
        const options = data.columns.filter((column) => column.role === role).map((column) => make("option", {value: column.field, textContent: column.label, selected: column === columns[axis]}))
        return options.length ? make("optgroup", {label}, options) : null
      }))
      element.addEventListener("change", () => {
        columns[axis] = data.columns.find((column) => column.field === element.value)
        told()
        plot.setAxes(columns.x, columns.y)
        plot.draw(modelOfCharts(), true)
      })
      return make("label", {}, axis, element)
    }
    const area = make("div", {className: "plot"})
    section.append(make("div", {className: "bar"}, select("y"), select("x"), factors, zoom, out), area)
    const plot = Charts.scatter(area, {
      select: selectRows, pick: choose, hover,
      zoomed: (yes) => { out.disabled = !yes },
      factors: (across, up) => {
        const better = columns.x.role === "criterion" && columns.y.role === "criterion" ? `better: ${"↙↘↖↗"[columns.x.maximize + 2 * columns.y.maximize]}` : ""
        factors.textContent = [up && `y ${up}`, across && `x ${across}`, better].filter(Boolean).join(" ")
      },
    })
    const told = () => area.setAttribute("aria-label", `${columns.y.label} against ${columns.x.label}; the table holds the same designs`)
    area.setAttribute("role", "img")
    told()
    zoom.addEventListener("click", () => {
      const on = zoom.getAttribute("aria-pressed") !== "true"
      zoom.setAttribute("aria-pressed", String(on))
      plot.zooming(on)
    })
    out.addEventListener("click", plot.zoomOut)
    plot.setAxes(x, y)
    // Distances are measured from the U and N of what is left: their context moves with the limits.
    plot.live = () => columns.x.role === "geometric" || columns.y.role === "geometric"
    plot.part = section.id
    plots.push(plot)
  }

  function selectRows(rows) {
    selected = new Set(rows)
    soon()
  }

  // The table: only the rows in view are in the document.

  const cellText = (column, row) => written(column, Logic.values(data, ranking, column)[row])
  const rankText = (row) => {
    if (isPrototype(row)) return "prototype"
    if (!ranking.mask[row]) return "outside the limits"
    if (!ranking.pareto[row]) return "dominated"
    return ranking.rank[row] === 0 ? "unranked" : `rank ${ranking.rank[row]}`
  }

  const table = (() => {
    const HEIGHT = 25
    const box = $("table")
    const head = make("div", {className: "head", role: "row"})
    const body = make("div", {className: "body", role: "rowgroup"})
    box.append(head, body)
    let cursor = 0
    // Of the box, kept: asking after changes would make the browser lay out the page at every step.
    const view = {top: 0, height: box.clientHeight}
    // As wide as the longest text: of numbers those at the ends of the range have it.
    const length = (column) => {
      if (column.texts) return Math.max(...column.texts.map((text) => text.length), 1)
      if (column.role === "geometric") return 9
      let [low, high] = [Infinity, -Infinity]
      for (const value of column.values) { if (value < low) low = value; if (value > high) high = value }
      return low <= high ? Math.max(written(column, low).length, written(column, high).length) : 1
    }
    let labels = 0
    for (let row = 0; row < data.total; row++) labels = Math.max(labels, data.ids[row].length)
    const columns = [
      {text: data.label_name, width: labels, order: null, cell: (row) => data.ids[row], field: "label"},
      {text: "rank", width: 13, order: {by: "rank", down: false}, cell: rankText, field: "rank"},
      ...data.columns.map((column) => ({
        text: column.role === "geometric" ? column.name.split(" ")[0] : column.label, width: length(column), number: !column.texts,
        order: {by: "column", name: column.name, down: false}, cell: (row) => cellText(column, row), field: column.field})),
    ]
    for (const column of columns) column.pixels = Math.ceil(Math.max(7.4 * column.width + 22, Math.min(7.2 * column.text.length + 34, 150), 62))
    const wide = columns.reduce((sum, column) => sum + column.pixels, 0)
    head.style.width = body.style.width = `${wide}px`
    body.style.minHeight = `${Math.min(data.total, 17) * HEIGHT}px` // as high as the box, or all rows, at any limit

    const heads = columns.map((column, k) => {
      const button = make("button", {tabIndex: k === 1 ? 0 : -1, title: column.order ? `Sort by ${column.text}` : column.text, disabled: !column.order}, Charts.broken(column.text))
      button.addEventListener("click", () => {
        const {order: now} = state
        const same = column.order.by === now.by && column.order.name === now.name
        change({order: {...column.order, down: same && !now.down}})
        box.scrollTop = 0
        cursor = 0
      })
      button.addEventListener("keydown", (event) => {
        const next = heads[k + ({ArrowLeft: -1, ArrowRight: 1}[event.key] ?? NaN)]?.querySelector("button")
        if (event.key === "Enter" || event.key === " ") return event.stopPropagation()
        if (!next || next.disabled) return
        event.stopPropagation()
        event.preventDefault()
        button.tabIndex = -1
        next.tabIndex = 0
        next.focus()
      })
      const cell = make("div", {className: column.number ? "cell number" : "cell", role: "columnheader"}, button)
      cell.style.width = `${column.pixels}px`
      return cell
    })
    head.append(...heads)
    box.setAttribute("aria-colcount", columns.length)

    // Lines are used again, and only what differs is written: new elements would be styled and laid
    // out at every step.
    const lines = []
    function newLine() {
      const cells = columns.map((column) => {
        const text = document.createTextNode("")
        const cell = make("div", {className: column.number ? "cell number" : "cell", role: "gridcell"}, text)
        if (column.field === "label") cell.classList.add("label")
        cell.style.width = `${column.pixels}px`
        return text
      })
      return {element: make("div", {role: "row"}, cells.map((text) => text.parentElement)), cells, look: "", told: ""}
    }

    function fill(line, k) {
      const {element, cells} = line
      const row = order[k]
      columns.forEach((column, j) => {
        const text = column.cell(row)
        if (cells[j].data !== text) cells[j].data = text
      })
      if (line.look !== look(row)) {
        line.look = look(row)
        cells[1].parentElement.replaceChildren(Charts.icon(line.look), cells[1])
      }
      const marks = [row === chosenRow() ? "chosen" : "", selected.has(row) ? "selected" : "", k === cursor ? "cursor" : "", state.pins.includes(data.ids[row]) ? "pinned" : ""]
      const told = `${k} ${marks.join(" ")}`
      if (line.told === told) return
      line.told = told
      element.className = `row ${marks.join(" ")}`
      element.id = `row-${k}`
      element.setAttribute("aria-rowindex", k + 2)
      element.setAttribute("aria-selected", selected.has(row))
      element.style.top = `${k * HEIGHT}px`
      element.dataset.k = k
    }

    function show() {
      cursor = Math.max(0, Math.min(cursor, order.length - 1))
      body.style.height = `${order.length * HEIGHT}px`
      const first = Math.max(0, Math.min(order.length, Math.floor(view.top / HEIGHT)) - 2)
      const last = Math.min(order.length, Math.ceil((view.top + view.height) / HEIGHT) + 2)
      const count = Math.max(0, last - first)
      while (lines.length < count) lines.push(newLine())
      for (let k = 0; k < count; k++) fill(lines[k], first + k)
      if (body.childElementCount !== count) body.replaceChildren(...lines.slice(0, count).map((line) => line.element))
      box.setAttribute("aria-rowcount", order.length + 1)
      box.setAttribute("aria-activedescendant", order.length ? `row-${cursor}` : "")
      columns.forEach((column, k) => {
        const sorted = column.order && column.order.by === state.order.by && column.order.name === state.order.name
        heads[k].setAttribute("aria-sort", !sorted ? "none" : state.order.down ? "descending" : "ascending")
      })
      $("choose").disabled = $("pin").disabled = order.length === 0
    }

    function go(k) {
      cursor = Math.max(0, Math.min(order.length - 1, k))
      const top = cursor * HEIGHT
      const room = box.clientHeight - head.offsetHeight - HEIGHT
      if (top < view.top) box.scrollTop = top
      else if (top > view.top + room) box.scrollTop = top - room
      view.top = box.scrollTop
      show()
    }

    const byPage = () => Math.max(1, Math.floor(box.clientHeight / HEIGHT) - 2)
    const keys = {
      ArrowDown: () => go(cursor + 1), ArrowUp: () => go(cursor - 1), PageDown: () => go(cursor + byPage()),
      PageUp: () => go(cursor - byPage()), Home: () => go(0), End: () => go(order.length - 1),
      ArrowLeft: () => { box.scrollLeft -= 80 }, ArrowRight: () => { box.scrollLeft += 80 },
      Enter: () => choose(order[cursor]), p: () => pin(order[cursor]), P: () => pin(order[cursor]),
      " ": () => toggle(order[cursor]),
    }
    box.addEventListener("keydown", (event) => {
      const action = event.ctrlKey || event.altKey || event.metaKey ? null : keys[event.key]
      if (!action || !order.length) return
      event.preventDefault()
      action()
    })
    const toggle = (row) => selectRows(selected.has(row) ? [...selected].filter((other) => other !== row) : [...selected, row])
    body.addEventListener("click", (event) => {
      const element = event.target.closest(".row")
      if (!element) return
      const k = Number(element.dataset.k)
      cursor = k
      event.ctrlKey || event.metaKey ? toggle(order[k]) : choose(order[k])
      show()
    })
    let scrolled = false
    box.addEventListener("scroll", () => {
      if (scrolled) return
      scrolled = true
      requestAnimationFrame(() => {
        scrolled = false
        view.top = box.scrollTop
        show()
      })
    })
    new ResizeObserver(() => {
      view.height = box.clientHeight
      if (order) show()
    }).observe(box)
    return {show, current: () => order[cursor] ?? -1}
  })()

  // Files.

  function download(text, type, name) {
    const link = make("a", {href: URL.createObjectURL(new Blob([text], {type})), download: name})
    link.click()
    setTimeout(() => URL.revokeObjectURL(link.href), 10000)
  }
  const stem = payload.file ?? "designs"

  function wire() {
    const goes = (from) => () => { state = from(); remember(); soon() }
    $("undo").addEventListener("click", goes(past.undo))
    $("redo").addEventListener("click", goes(past.redo))
    $("reset").addEventListener("click", () => {
      for (const control of controls.values()) control.wrong &&= ["", ""]
      for (const {input} of wishes) input.setAttribute("aria-invalid", "false")
      selectRows([])
      change(initial.state)
    })
    $("save").addEventListener("click", () => {
      const name = `${stem}-decision.json`
      download(Logic.decisionFile(data, state, ranking, verdict, new Date().toISOString()), "application/json", name)
      say([`Saved as ${name}. Open it here again by "Open decision…", or with the commands page, rank and report by --decision ${name}.`])
    })
    $("open").addEventListener("click", () => $("file").click())
    $("file").addEventListener("change", async () => {
      const [file] = $("file").files
      $("file").value = ""
      if (!file) return
      const opened = Logic.opened(data, await file.text())
      say(opened.remarks)
      if (opened.state) change(opened.state)
    })
    $("print").addEventListener("click", () => print())
    addEventListener("beforeprint", dateRecord)
    $("export").addEventListener("click", () => {
      const rows = selected.size ? [...order].filter((row) => selected.has(row)) : [...order]
      download(Logic.csv(data, rows, ranking), "text/csv", `${stem}-${selected.size ? "selected" : "shown"}.csv`)
    })
    $("zoom").addEventListener("click", () => change({axes: {...state.axes, zoom: !state.axes.zoom}}))
    $("by-preference").addEventListener("click", () => change({order: {by: state.order.by === "preference" ? "rank" : "preference", down: false}}))
    $("preferences").addEventListener("toggle", soon)
    $("choose").addEventListener("click", () => choose(table.current()))
    $("pin").addEventListener("click", () => pin(table.current()))
    $("keep").addEventListener("click", () => {
      const kept = selected.size ? [...selected].map((row) => data.ids[row]) : null
      selected = new Set()
      change({kept})
    })
    $("clear").addEventListener("click", () => selectRows([]))
    $("reason").addEventListener("input", () => { state = {...state, reason: $("reason").value}; $("reason-printed").textContent = state.reason })
    $("reason").addEventListener("change", commit)
    addEventListener("hashchange", () => take(Logic.fromHash(location.hash) ?? {}))
    addEventListener("pagehide", remember)
    addEventListener("keydown", (event) => {
      // Within a text the browser undoes its letters.
      if (!(event.ctrlKey || event.metaKey) || event.target.matches("textarea, input[type=text]")) return
      const key = event.key.toLowerCase()
      if (key === "z" || key === "y") {
        event.preventDefault()
        $(key === "y" || event.shiftKey ? "redo" : "undo").click()
      }
    })
    addEventListener("keydown", (event) => { if (event.key === "Escape" && selected.size) selectRows([]) })
  }

  function dateRecord() {
    $("record-foot").textContent = `${$("count").textContent}. Printed ${new Date().toLocaleDateString(undefined, {dateStyle: "long"})}.`
  }

  // Start: the state in the address, or else what the page was made with.

  $("verdict-more").before(make("div", {id: "cautions"}))
  const header = document.querySelector("header")
  new ResizeObserver(() => document.documentElement.style.setProperty("--head", `${header.offsetHeight}px`)).observe(header)
  buildLimits()
  buildPreferences()
  const mus = data.columns.filter((column) => column.role === "geometric")
  const [first, second] = [data.criteria, limitable.filter((column) => column.role === "variable" && !column.texts)]
  buildScatter($("scatter-a"), "First plot", first[0], first[1] ?? mus[0])
  buildScatter($("scatter-b"), "Second plot", ...(second.length ? [second[0], second[1] ?? first[0]] : first.length > 2 ? first.slice(-2) : [mus[2], mus[1]]))
  wire()
  say([...data.remarks.filter((text) => text.startsWith("Warning")), ...initial.remarks])
  if (location.hash.length > 1) take(Logic.fromHash(location.hash) ?? {})
  update(true)
  dateRecord()
  document.body.classList.toggle("many", data.criteria.length > 6) // so that a print has one page
  document.body.dataset.ready = "yes"

  return {
    Logic, data, step, ready: performance.now(), update,
    state: () => state,
    set: (next, done = true) => { change(Logic.checked(data, next).state, done); update() },
    get left() { return left }, get ranking() { return ranking }, get verdict() { return verdict },
    get order() { return order }, get selected() { return [...selected] }, get drawn() { return drawn }, get context() { return context },
    get resting() { return !waiting && thinking === 0 }, plots, scale: scaleOf,
  }
})()
window.decisionPage = page
