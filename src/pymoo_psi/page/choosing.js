// "Help me choose": which of two designs somebody would rather have, and what the answers say.

let model = null // what is known before the first answer, of the ranking `modelled`
let modelled = null
let sayings = new Map() // what answers say, by their text
let question = null // the two rows that are asked about

function said(answers) {
  if (modelled !== ranking) [model, modelled, sayings] = [new Preferences(data, ranking), ranking, new Map()]
  const counted = countedAnswers(data, ranking, answers)
  const key = counted.join(";")
  if (!sayings.has(key)) sayings.set(key, model.after(counted))
  return sayings.get(key)
}

function openQuestions() {
  show("questions", true)
  update()
  $("questions").focus()
  $("questions").scrollIntoView({block: "nearest"})
}
function closeQuestions() {
  show("questions", false)
  $("verdict").focus()
}

function answer(relation, first = 0) {
  if (!question) return
  change({answers: [...state.answers, [called(question[first]), relation, called(question[1 - first])]]})
  update()
}
const forget = () => change({answers: state.answers.slice(0, -1)})

const ANSWERS = {a: () => answer(">"), b: () => answer(">", 1), e: () => answer("="), s: () => answer("?"), u: forget, escape: closeQuestions}

// One of two designs: only where it differs from the other, its objectives large.
function card(row, other, letter) {
  const list = (columns, kind) => columns.filter((column) => cellText(column, row) !== cellText(column, other)).map((column) =>
    make(`div.${kind}`, make("dt", column.name), make("dd", isNumber(column.values[row]) && !column.texts ? withUnit(column, cellText(column, row)) : cellText(column, row))))
  const others = limitable.filter((column) => !isObjective(column))
  return make("article", make("h3", button(letter, ANSWERS[letter.toLowerCase()], {ariaLabel: `${letter}: ${called(row)}`, className: "main"}), ` ${called(row)}`),
    make("dl", list(data.objectives, "large"), list(others, "small").slice(0, 8)))
}

function showQuestions() {
  if (dragging || $("questions").hidden) return
  question = null
  if (ranking.count) {
    const {row, regret, shares, enough, question: pair} = said(state.answers)
    question = pair
    const counting = countedAnswers(data, ranking, state.answers)
    const answered = counting.filter(([, relation]) => relation !== "?").length
    const leftOut = state.answers.length - counting.length
    renew("answer-words",
      make("p", sentence(data, "preferred", {answers: counted(answered, "answer"), design: called(row), share: percent(shares.get(row) ?? 0), regret: percent(regret)})),
      make("div.buttons", chooseButton(row), rowButton("Inspect", inspect, row)),
      !pair && make("p", sentence(data, enough ? "enough" : "none left")),
      leftOut && make("p.warning", `${counted(leftOut, "answer")} left out: not about two designs that no other dominates within the limits.`),
      make("ul", makeAll("li", counting.map((one) => tradeText(data, ranking, one)).filter(Boolean))))
  } else renew("answer-words", make("p", "No design is left."))
  renew("questions-title", question ? "Which one would you rather have?" : "No more questions")
  renew("pair", question && [card(...question, "A"), card(...question.toReversed(), "B")])
  for (const id of ["equally-good", "skip-question"]) $(id).disabled = !question
  $("back").disabled = !state.answers.length
}

// Of several people the share of each design, and the design with the greatest smallest one.
function showShares() {
  if (dragging) return
  const held = latest(state.positions).filter(({answers}) => answers.length)
  const isShown = held.length > 1 && ranking.count > 0
  show("shares", isShown)
  if (!isShown) return
  const all = held.map(({answers}) => said(answers).shares)
  const designs = [...all[0].keys()].map((row) => {
    const shares = all.map((one) => one.get(row))
    return {row, shares, least: min(...shares), most: max(...shares)}
  }).sort((a, b) => b.most - a.most || a.row - b.row)
  const common = designs.reduce((a, b) => round(b.least / TIE) > round(a.least / TIE) ? b : a)
  const shown = designs.filter((one, k) => (k < 6 && one.most >= 0.01) || one === common)
  renew("shares-table",
    make("thead", make("tr", head("col", "best for"), held.map(({name}) => head("col", name)))),
    make("tbody", shown.map(({row, shares}) => make("tr", head("row", inspectButton(row)),
      shares.map((share) => make("td.number", percent(share)))))))
  renew("shares-words", sentence(data, "common", {design: called(common.row), share: percent(common.least)}))
}

function buildQuestions() {
  onClicks({"equally-good": ANSWERS.e, "skip-question": ANSWERS.s, back: ANSWERS.u, "close-questions": ANSWERS.escape})
  onKeys($("questions"), ANSWERS)
  following.push(showQuestions, showShares)
}
