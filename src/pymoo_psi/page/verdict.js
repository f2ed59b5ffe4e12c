// What is proposed, chosen or looked at, what others would give up, and how sure it is.

// What was computed when the page was made holds for the limits and ranges that it opened with.
const asked = ({limits, fixed}) => JSON.stringify([limits, fixed])
const isAsOpened = () => asked(state) === asked(initial.state)
const validity = () => isAsOpened() ? "" : "For the limits and ranges that the page opened with:"

// What the heading does not say yet: in what the proposal is the best, what it costs, and its probability.
function leadText({row, standing, costs}) {
  const best = standing.replace(`Proposed: ${called(row)}`, "").replace(/^[.,] */, "")
  const sure = data.cautions.filter((text) => isAsOpened() && row === initialBest && text.startsWith(data.sentences.confidence.split("{")[0]))
  return [best && best[0].toUpperCase() + best.slice(1), costs, ...sure].filter(Boolean).join(" ")
}

let initialBest = -1 // what was proposed when the page was made
function showVerdict() {
  if (initialBest < 0) initialBest = proposedRow()
  const chosen = chosenRow()
  const isInspected = inspected >= 0 && inspected !== chosen
  const word = isInspected ? "Inspected: " : chosen >= 0 ? "Chosen: " : "Proposed: "
  if (verdict) {
    const {row, proposed, instead, remarks} = verdict
    renew("verdict-title", word, make("em", called(row)))
    const beyond = broke(row).map(({name}) => name)
    renew("verdict-words",
      make("p.lead", instead || leadText(verdict)),
      beyond.length && make("p.warning", `${called(row)} is beyond the limits on ${listed(beyond)}.`),
      makeAll("p.caution", remarks))
    renew("verdict-actions",
      chosen >= 0 && !isInspected ? button("Clear choice", () => choose(chosen)) : button("Choose", () => choose(row), {className: "small main", title: "C", ariaLabel: `Choose: ${called(row)}`}),
      pinButton(row),
      ranking.front.length > 1 && data.points.length && button("Help me choose", openQuestions),
      instead && button("Compare with the proposal", () => pin(proposed), {ariaPressed: isPinned(proposed)}),
      isInspected && button("Back", () => inspect(-1), {title: "Esc"}))
    const parts = data.columns.filter(({role}) => role === "variable")
      .map((column) => `${column.name} = ${cellText(column, row)}${column.unit ? ` ${column.unit}` : ""}`)
    renew("verdict-variables", parts.length && `${parts.join(", ")}.`)
  } else {
    renew("verdict-title", "No design is left")
    renew("verdict-words", make("p.lead", "Below: the single limits at which there is one."), chosen >= 0 && make("p.warning", `${called(chosen)} is chosen.`))
    renew("verdict-actions", chosen >= 0 && button("Clear choice", () => choose(chosen)))
    renew("verdict-variables")
  }
  show("cautions", verdict && data.cautions.length)
  renew($("cautions").querySelector("p"), validity())
  renew("shaded", isShaded && validity())
  show("reasoning", chosen >= 0 && !isInspected)
  renew($("reasoning").firstElementChild, `Reason for choosing ${state.chosen}`)
  if ($("reason").value !== state.reason) $("reason").value = state.reason
  renew("reason-printed", state.reason || "–")
  showCounts()
}

function showCounts() {
  const set = entriesOf(state.limits).length
  renew("count", left.count === 0 ? "No design is left"
    : set ? `${exact(left.count)} of ${exact(data.n)} within the limit${set > 1 ? "s" : ""}` : counted(data.n, "design"))
  $("count").classList.toggle("warning", left.count === 0)
  // Not disabled in earnest: a key that is held would go on with the button beside it.
  $("undo").ariaDisabled = at <= 0
  $("redo").ariaDisabled = at >= past.length - 1
  $("fixed").checked = state.fixed
  $("dominated").checked = state.dominated
  const what = state.dominated ? counted(shownRows.length, "design") : `${counted(ranking.front.length, "design")} that no other dominates`
  const within = set ? " within the limits" : ""
  const measure = state.fixed ? "of the fixed range" : "of the thick part, their worst to their best"
  renew("foot", `Lines: the ${what}${within}. Per cent: ${measure}.`)
  const lines = limitable.flatMap((column) => limitTexts(column, limitOf(column)))
  renew("record-limits", makeAll("li", lines.length ? lines : ["None."]), state.fixed && make("li", "Ranked by fixed ranges, which limits do not change."))
}

function showSteps() {
  const {steps} = verdict ?? {steps: []}
  show("steps", steps.length)
  renew("steps-list", steps.map(({row, text}) => {
    const [gain, ...costs] = text.split(". ")
    return make("div", make("h3", inspectButton(row), `: ${gain}`), make("p", costs.length && `${costs.join(". ")}.`), pinButton(row))
  }))
}

// Until which limits a proposal stays takes longer than a frame: it waits until the hand rests.
let search = null
function switchLater() {
  search?.return() // that of the limits before
  $("relax").ariaBusy = true
  search = switches(data, state, ranking)
  setTimeout(inPieces, 250, search, showSwitches)
}

function showSwitches(found) {
  if (!found) return // another search has begun
  search = null
  const changes = found.filter(({value}) => value !== null)
  show("relax", changes.length)
  $("relax").ariaBusy = false
  const keepFocus = focusKept()
  renew("relax-list", changes.map((one) => {
    const {name, end, row, next, exact} = one
    const column = data.by.get(name)
    const limit = [...(limitOf(column) ?? [null, null])]
    limit[end] = next
    return make("li", `${switchText(data, one)}${exact ? "" : " (of values tried)"}. `.replace(/^./, (first) => first.toUpperCase()), row >= 0 && pinButton(row), " ",
      next !== null && button("Set", () => setLimit(column, limit), {ariaLabel: `Set: ${name}, ${end ? "at most" : "at least"} ${valueText(column, next)}`}))
  }))
  keepFocus()
}

// Comparison: what it holds and against what is comparison()'s.
function showCompare() {
  const parts = comparison(data, ranking, state, inspected)
  const rows = parts.map(({row}) => row)
  show("compare", rows.length > 1)
  renew("compare-hint", `Gains and losses against ${called(rows[0])}, with per cent of the range.`)
  if (rows.length < 2) return renew("compare-table")
  const heads = parts.map(({row, roles}) => {
    const name = called(row)
    return head("col", make("div.named", left.mask[row] && icon(LOOKS[look(row)]), make("button.link.label", {onclick: () => inspect(row)}, name)),
      make("div.roles", [...roles, placed(row)].join(", ")),
      make("div.buttons",
        isPinned(row) && button("×", () => pin(row), {ariaLabel: `× ${name} out of the comparison`, title: "Take out"})))
  })
  renew("compare-table",
    make("thead", make("tr", head("col", "Objective"), heads)),
    make("tbody", compareRows(data, ranking, rows, rows[0]).map((objective) => compareRow(rows, objective))))
}

function compareRow(rows, {column, gains, shares}) {
  return make("tr", head("row", broken(column.label)), rows.map((row, k) => {
    const text = make("div", cellText(column, row))
    if (k === 0) return make("td.number", text)
    if (gains[k] === 0) return make("td.number", text, make("div.hint", "the same"))
    return make("td.number", text,
      make(gains[k] > 0 ? "div.gain" : "div.loss", `${awayText(column, gains[k])} ${gains[k] > 0 ? "better" : "worse"}`),
      isWithin(shares[k]) && make("div.hint.shares", percent(abs(shares[k]))))
  }))
}

function buildVerdict() {
  $("remarks").append(...makeAll("p.hint", data.remarks.filter((text) => !text.startsWith("Warning"))))
  renew($("cautions").querySelector("b"), String(data.cautions.length))
  $("cautions").append(make("p.hint"), ...makeAll("p.caution", data.cautions))
  $("scale").textContent = data.normalize ? ", each objective in units of its range" : ", the objectives in their own units"
  if (data.further) renew("next", "16 more tests inside these limits: save the decision where the search was run, and run there ", make("code", data.further))
  filtering.push(switchLater)
  leading.push(showVerdict)
  following.push(showSteps, showCompare)
}
