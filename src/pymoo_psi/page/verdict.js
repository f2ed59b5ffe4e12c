// What is proposed, chosen or looked at, what others would give up, and how sure it is.

// What was computed when the page was made holds for the limits and ranges that it was made with.
const isAsMade = () => !data.more.length && asked(state) === made

// In what the proposal is the best, what it costs, and its probability.
function leadText({merit, ties, costs, instead}, confidence) {
  return instead || [`${upper(merit)}.`, ties, costs, ...confidence].filter(Boolean).join(" ")
}

function showVerdict() {
  const chosen = chosenRow()
  const isChosen = chosen >= 0 && (inspected < 0 || inspected === chosen)
  show("reasoning", isChosen)
  show("cautions", verdict && $("certain").nextSibling)
  const clear = isChosen && button("Clear choice", () => choose(chosen))
  if (verdict) {
    const {row, remark} = verdict
    const beyond = namesOf(broke(row))
    const isTested = isAsMade() && row === proposedRow()
    const caution = isTested && $("cautions").querySelector(".caution")
    renew("verdict-title", `${upper(roleOf(row))}: `, make("em", called(row)))
    renew("verdict-words",
      make("p.lead", tied(leadText(verdict, isTested ? data.confidence : []))),
      beyond.length && make("p.warning", `${called(row)} is beyond the limits on ${listed(beyond)}.`),
      [remark, caution?.textContent].map((text) => text && make("p.caution", text)))
    renew("verdict-actions", clear || chooseButton(row), pinButton(row),
      ranking.front.length > 1 && data.points.length && button("Help me choose", openQuestions),
      inspected >= 0 && !isChosen && button("Back", () => inspect(-1)))
    const variables = data.columns.filter(({role}) => role === "variable").map((column) => `${column.name} = ${withUnit(column, cellText(column, row))}`)
    renew("verdict-variables", variables.length && `${variables.join(", ")}.`)
  } else {
    renew("verdict-title", "No design is left")
    renew("verdict-words", chosen >= 0 && make("p.warning", `${called(chosen)} is chosen.`))
    renew("verdict-actions", clear)
    renew("verdict-variables")
  }
  show("certain", !isAsMade())
  renew($("reasoning").firstElementChild, `Reason for choosing ${state.chosen}`, state.reason && state.owners.reason && `, by ${state.owners.reason}`)
  if ($("reason").value !== state.reason) showText($("reason"), state.reason)
  renew("reason-printed", state.reason || "–")
  showCounts()
}

function showCounts() {
  renew("count", !kept.count ? "No design is left"
    : within() ? `${exact(kept.count)} of ${exact(data.n)}${within()}` : counted(data.n, "design"))
  $("count").classList.toggle("warning", !kept.count)
  // Not disabled in earnest: a key that is held would go on with the button beside it.
  $("undo").ariaDisabled = at <= 0
  $("redo").ariaDisabled = at >= past.length - 1
  $("fixed").checked = state.fixed
  const lines = data.columns.flatMap((column) => limitTexts(column, limitOf(column)))
  renew("record-limits", makeAll("li", lines.length ? lines : ["None."]))
  show("record-fixed", state.fixed)
}

// The limits at which another design is proposed, where they are known.
let changes = []
// A sentence on a limit, which sets it.
function limitButton({name, end, next, isExact}, sentence) {
  const column = columnOf(name)
  const text = `${tied(sentence)}${isExact ? "" : " (of values tried)"}. `
  return next === null ? text : make("button.link", {title: "Set this limit", onclick: () => setLimit(column, numericLimit(column).with(end, next))}, text)
}

function showSteps() {
  const used = new Set()
  renew("steps-list", (verdict?.steps ?? []).map(({row, better, worse}) => {
    const change = changes.find((one) => one.row === row && !one.looser)
    used.add(change)
    return make("div", make("h3", inspectButton(row), `: ${tied(better)}`),
      make("p", worse && `But ${tied(worse)}. `, change && limitButton(change, `Proposed ${change.condition}`)),
      make("div.buttons", pinButton(row)))
  }))
  const items = changes.filter((change) => !used.has(change)).map((change) => make("li", limitButton(change, upper(`${change.condition}, ${outcomeOf(change)}`)),
    change.row >= 0 && pinButton(change.row)))
  renew("relax-list", verdict && items)
  renew("ways-back", !verdict && items)
}

// Until which limits a proposal stays takes longer than a frame: it waits until the hand rests.
let search = null
function switchLater() {
  search?.return() // that of the limits before
  changes = []
  search = switches(state, ranking)
  setTimeout(inPieces, 250, search, showSwitches)
}

function showSwitches(found) {
  if (!found) return // another search has begun
  search = null
  changes = changesOf(found)
  const keepFocus = focusKept()
  showSteps()
  keepFocus()
}

// Comparison with a base: the existing design, or else the best. Beside it stand the best, the chosen
// one, the one looked at, what is pinned, and designs one step away, so that there are four.
function showCompare() {
  const proposed = proposedRow()
  const chosen = chosenRow()
  const base = data.total > data.n ? data.n : proposed
  const all = new Set(verdict ? [base, proposed, chosen, verdict.row, ...state.pins.map(rowOf)] : [])
  all.delete(-1)
  for (const {row} of verdict?.steps ?? []) if (all.size < 4) all.add(row)
  const rows = [...all]
  show("compare", rows.length > 1)
  if (rows.length < 2) return
  const roles = entriesOf({base, proposed, chosen})
  const heads = rows.map((row) => head("col",
    make("div.named", kept.mask[row] && icon(LOOKS[look(row)]), inspectButton(row, ".label")),
    make("div.roles", [...roles.filter(([, one]) => one === row).map(([role]) => role), placed(row)].join(", ")),
    make("div.buttons", isPinned(row) && pinButton(row))))
  const differences = rows.map((row) => gainsOf(ranking, row, rows[0]))
  renew("compare-table",
    make("thead", make("tr", head("col", "Objective"), heads)),
    make("tbody", data.objectives.map((column, j) => make("tr", head("row", column.label), differences.map(({gains, shares}, k) =>
      make("td.number", make("div", cellText(column, rows[k])), k > 0 && gainTexts(column, gains[j], shares[j])))))))
}

function gainTexts(column, gain, share) {
  if (gain === 0) return make("div.hint", "the same")
  const kind = gain > 0 ? "better" : "worse"
  return make(`div.${kind}`, `${amount(column, abs(gain), ranking)} ${kind}`, isWithin(share) && make("span.hint.shares", ` (${percent(abs(share))})`))
}
