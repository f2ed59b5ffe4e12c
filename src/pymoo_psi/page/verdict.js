// What is proposed, chosen or looked at, what others would give up, and how sure it is.

// What was computed when the page was made holds for the limits and ranges that it opened with.
const asked = ({limits, fixed}) => JSON.stringify([limits, fixed])
const isAsOpened = () => !data.more.length && asked(state) === asked(initial.state)

// What the heading does not say yet: in what the proposal is the best, what it costs, and its probability.
function leadText({row, standing, costs}) {
  const best = standing.replace(`Proposed: ${called(row)}`, "").replace(/^[.,] */, "")
  const [start] = data.sentences.confidence.split("{")
  const sure = isAsOpened() && row === proposedRow() ? data.cautions.filter((text) => text.startsWith(start)) : []
  return [upper(best), costs, ...sure].filter(Boolean).join(" ")
}

function showVerdict() {
  const chosen = chosenRow()
  const isChosen = chosen >= 0 && (inspected < 0 || inspected === chosen)
  show("reasoning", isChosen)
  show("cautions", verdict && data.cautions.length)
  const clear = isChosen && button("Clear choice", () => choose(chosen))
  if (verdict) {
    const {row, instead, remarks} = verdict
    const beyond = broke(row).map(({name}) => name)
    renew("verdict-title", `${upper(roleOf(row))}: `, make("em", called(row)))
    renew("verdict-words",
      make("p.lead", tied(instead || leadText(verdict))),
      beyond.length && make("p.warning", `${called(row)} is beyond the limits on ${listed(beyond)}.`),
      makeAll("p.caution", remarks))
    renew("verdict-actions", clear || chooseButton(row), pinButton(row),
      ranking.front.length > 1 && data.points.length && button("Help me choose", openQuestions),
      inspected >= 0 && !isChosen && button("Back", () => inspect(-1), {title: "Esc"}))
    const variables = data.columns.filter(({role}) => role === "variable").map((column) => `${column.name} = ${withUnit(column, cellText(column, row))}`)
    renew("verdict-variables", variables.length && `${variables.join(", ")}.`)
  } else {
    renew("verdict-title", "No design is left")
    renew("verdict-words", make("p.lead", "Below: the single limits at which there is one."), chosen >= 0 && make("p.warning", `${called(chosen)} is chosen.`))
    renew("verdict-actions", clear)
    renew("verdict-variables")
  }
  renew("certain", !isAsOpened() && "For the limits and ranges that the page opened with:")
  renew($("reasoning").firstElementChild, `Reason for choosing ${state.chosen}`, state.owners.reason && `, by ${state.owners.reason}`)
  if ($("reason").value !== state.reason) showText($("reason"), state.reason)
  renew("reason-printed", state.reason || "–")
  showCounts()
}

function showCounts() {
  const set = entriesOf(state.limits).length
  const within = set ? ` within the limit${set > 1 ? "s" : ""}` : ""
  renew("count", !left.count ? "No design is left"
    : set ? `${exact(left.count)} of ${exact(data.n)}${within}` : counted(data.n, "design"))
  $("count").classList.toggle("warning", !left.count)
  // Not disabled in earnest: a key that is held would go on with the button beside it.
  $("undo").ariaDisabled = at <= 0
  $("redo").ariaDisabled = at >= past.length - 1
  $("fixed").checked = state.fixed
  legend("foot", shownRows.length < 2 ? [] : [
    [swatch(shownRows.length <= MOST_LINES ? "tick.own" : "line"), `${exact(shownRows.length)} designs${state.dominated ? within : " that no other dominates"}`],
    shownRows.length <= MOST_LINES && [swatch("strong"), "places 2 and 3"],
    shownRows.length < data.n && data.n <= MOST_TICKS && [swatch("tick"), "other designs"],
    data.columns.some((column) => !column.texts && limitOf(column)) && [swatch("hatch"), "beyond a limit"],
    [swatch("thick"), state.fixed ? "the fixed range, 100 % to 0 % behind" : "their worst to best value, 100 % to 0 % behind"]])
  const lines = data.columns.flatMap((column) => limitTexts(column, limitOf(column)))
  renew("record-limits", makeAll("li", lines.length ? lines : ["None."]), state.fixed && make("li", "Ranked by fixed ranges, which limits do not change."))
}

// The limits at which another design is proposed, where they are known.
let changes = []
const changeTo = (row) => changes.find(([, one]) => one.row === row && !one.looser)?.[1]
const tried = ({exact}) => exact ? "" : " (of values tried)"
function setButton({name, end, next, looser, limit}) {
  const column = data.by.get(name)
  const words = looser ? ["at least", "at most"] : ["above", "below"]
  return button(`Set ${name} ${words[end]} ${limit}`,
    () => setLimit(column, numericLimit(column).with(end, next)))
}

function showSteps() {
  const {steps} = verdict ?? {steps: []}
  show("steps", steps.length)
  renew("steps-list", steps.map(({row, text}) => {
    const [gain, costs] = text.split(/\. (?=But )/)
    const change = changeTo(row)
    return make("div", make("h3", inspectButton(row), `: ${tied(gain)}`),
      make("p", costs && `${tied(costs)}. `, change && tied(`Proposed ${switchText(change, "").replace(/, $/, tried(change))}.`)),
      make("div.buttons", pinButton(row), change && setButton(change)))
  }))
  const isStep = ({row}) => steps.some((step) => step.row === row)
  const others = changes.filter(([, one]) => !(isStep(one) && changeTo(one.row) === one))
  const place = $(verdict ? "further-words" : "left") // a way back is needed at once
  if ($("relax").parentElement !== place) verdict ? place.prepend($("relax")) : place.append($("relax"))
  show("relax", others.length)
  renew("relax-list", others.map(([text, one]) => make("li", upper(`${tied(text)}${tried(one)}. `),
    one.row >= 0 && pinButton(one.row), " ", one.next !== null && setButton(one))))
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
  changes = switchTexts(found)
  const keepFocus = focusKept()
  showSteps()
  keepFocus()
}

// Comparison: what it holds and against what is comparison()'s.
function showCompare() {
  const parts = comparison(ranking, state, verdict)
  const rows = parts.map(({row}) => row)
  show("compare", rows.length > 1)
  renew("compare-hint", `Gains and losses against ${called(rows[0])}, with per cent of the range.`)
  if (rows.length < 2) return renew("compare-table")
  const heads = parts.map(({row, roles}) => head("col",
    make("div.named", left.mask[row] && icon(LOOKS[look(row)]), inspectButton(row, ".label")),
    make("div.roles", [...roles, placed(row)].join(", ")),
    make("div.buttons", isPinned(row) && pinButton(row))))
  renew("compare-table",
    make("thead", make("tr", head("col", "Objective"), heads)),
    make("tbody", compareRows(ranking, rows, rows[0]).map(({column, gains, shares}) =>
      make("tr", head("row", column.label), rows.map((row, k) =>
        make("td.number", make("div", cellText(column, row)), k > 0 && gainTexts(column, gains[k], shares[k])))))))
}

function gainTexts(column, gain, share) {
  if (gain === 0) return make("div.hint", "the same")
  const kind = gain > 0 ? "better" : "worse"
  return make(`div.${kind}`, `${amount(column, abs(gain), ranking)} ${kind}`, isWithin(share) && make("span.hint.shares", ` (${percent(abs(share))})`))
}
