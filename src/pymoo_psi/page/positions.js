// What people hold: a strip of positions, each with a choice, a reason and what the present verdict
// costs them, and the decision of all.

const boxesOfPositions = () => [...$("position-list").querySelectorAll("input")]
let agreeing // what the ticks were last set for: whose choice is the present one agrees

function showPositions() {
  const {positions, decided, chosen} = state
  const held = latest(positions)
  renew("position-list", held.map((one) => make("li", make("span.avatar", {ariaHidden: true}, one.name[0]),
    make("div", make("button.link", {title: "Show the page as it was", ariaLabel: `Show: ${one.name}`, onclick: () => showPosition(one)}, make("b", one.name)),
      " ", choiceOf(one, rowOf(one.chosen))),
    make("div.buttons",
      make("label", {hidden: chosen === null}, make("input", {type: "checkbox", ariaLabel: `${one.name} agrees`}), "agrees"),
      button("×", () => change({positions: positions.filter(({name}) => name !== one.name)}), {ariaLabel: `Remove: ${one.name}`})),
    make("div.rest", factsOf(one)))))
  const key = JSON.stringify([chosen, held])
  if (key !== agreeing) boxesOfPositions().forEach((box, k) => { box.checked = held[k].chosen === chosen })
  agreeing = key
  const texts = separation(ranking, positions).map(tied)
  renew("regret", ranking.count && texts.shift())
  renew("separation", makeAll("li", texts))
  $("decide").disabled = chosen === null
  renew("decide", held.length && `Decide for ${chosen ?? "a chosen design"}`)
  renew("decided", decided && sentence("decided", {on: decided.date && ` on ${decided.date.slice(0, 10)}`, design: decided.chosen, by: decided.agree.length ? ` by ${listed(decided.agree)}` : ""}),
    decided?.dissent.length && ` ${sentence("dissent", {dissent: listed(decided.dissent)})}`)
}

// What a position keeps of a state.
const heldOf = (one) => Object.fromEntries(["limits", "chosen", ...personal].map((key) => [key, one[key]]))

// The page as somebody had it.
function showPosition(one) {
  const owners = Object.fromEntries(personal.map((key) => [key, one.name]))
  change({...heldOf(one), chosen: isDesign(one.chosen) ? one.chosen : null, owners})
}

// Which limits a choice breaks, why somebody wants it, and what the verdict gives up against it.
function factsOf(one) {
  const row = rowOf(one.chosen)
  const limits = entriesOf(one.limits).flatMap(([name, limit]) => limitTexts(columnOf(name), limit))
  const broken = broke(row).flatMap((column) => limitTexts(column, limitOf(column)))
  const facts = [one.reason && `“${one.reason}”`, row >= 0 && verdict && given(row), limits.length && `with ${limits.join(", ")}`]
  return [broken.length && make("span.beyond", `beyond the limit: ${listed(broken)}`), make("span.hint", tied(facts.filter(Boolean).join(" · ")))]
}

function choiceOf({chosen}, row) {
  if (row >= 0) return ["wants ", inspectButton(row)]
  return chosen ? `${sentence("foreign choice", {design: chosen})}.` : "has chosen nothing"
}

// The greatest loss of the verdict against a choice.
function given(row) {
  const role = roleOf(verdict.row)
  if (row === verdict.row) return `is ${role}`
  const {gains, shares} = gainsOf(ranking, verdict.row, row)
  const j = bySize(shares).find((k) => gains[k] < 0)
  if (j === undefined) return `the ${role} design is nowhere worse`
  return `${role}: ${changeText(data.objectives[j], gains[j], ranking)}${isWithin(shares[j]) ? ` (${percent(abs(shares[j]))})` : ""}`
}

// Limits, choice and its reason stay; what another person has said is left out.
function record() {
  const name = $("position-name").value.trim()
  if (!name) return say(["Give the position a name."])
  $("adding").open = false
  $("position-name").value = ""
  const {owners, positions} = state
  const held = heldOf(state)
  for (const key of personal) if ((owners[key] ?? name) !== name) [, held[key]] = PERSONAL[key]
  change({positions: [...positions, {name, date: new Date().toISOString(), ...held}], weights: {}, aspiration: {}, answers: [], owners: {reason: owners.reason ?? name}})
}

function decide() {
  const names = namesOf(latest(state.positions))
  const boxes = boxesOfPositions()
  const {true: agree = [], false: dissent = []} = Object.groupBy(names, (_, k) => boxes[k].checked)
  change({decided: {date: new Date().toISOString(), chosen: state.chosen, agree, dissent}})
}

onClicks({keep: record, decide})
