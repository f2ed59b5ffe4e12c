// "Help me choose": which of two designs somebody would rather have, and what the answers say.

let model = null // what is known before the first answer
let sayings = {} // what answers say, by their text
let question = null // the two rows that are asked about

// What the answers that count say, `counting`, and the rest of it.
function said(answers) {
  if (model?.front !== ranking.front) {
    model = preferencesOf(ranking)
    sayings = {}
  }
  const counting = countedAnswers(ranking, answers)
  return sayings[counting.join(";")] ??= {counting, ...model.after(counting)}
}

function openQuestions() {
  show("questions", true)
  update()
  $("questions").focus() // which scrolls to it
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

// By keys and by the values of buttons.
const ANSWERS = {a: () => answer(">"), b: () => answer(">", 1), e: () => answer("="), s: () => answer("?"),
  u: () => change({answers: state.answers.slice(0, -1)}), escape: closeQuestions}

// One of two designs: only where it differs from the other, its objectives first and large.
function card(row, other, letter) {
  const differing = data.columns.filter((column) => cellText(column, row) !== cellText(column, other))
  return make("article", make("h3", make("button.main.small", {value: letter, ariaLabel: `${letter}: ${called(row)}`}, letter), ` ${called(row)}`),
    make("dl", differing.slice(0, 12).map((column) => make(isObjective(column) ? "div.large" : "div", make("dt", column.label), make("dd", cellText(column, row))))))
}

function showQuestions() {
  if (dragging || $("questions").hidden) return
  question = null
  if (ranking.count) {
    const {row, counting, texts, regret, question: next} = said(state.answers)
    const leftOut = state.answers.length - counting.length
    const n = counting.filter(([, relation]) => relation !== "?").length
    question = next
    renew("answer-words",
      make("p", sentence(n ? "preferred" : "unanswered", {answers: counted(n, "answer"), design: called(row), share: texts.get(row), regret: percent(regret)})),
      n > 0 && make("div.buttons", chooseButton(row), rowButton("Inspect", inspect, row)),
      !question && make("p", sentence(regret < ENOUGH ? "enough" : "none left")),
      leftOut && make("p.warning", sentence("answers left out", {answers: counted(leftOut, "answer")})))
  } else renew("answer-words")
  renew("questions-title", question ? "Which one would you rather have?" : "No more questions")
  renew("pair", question && [card(...question, "a"), card(...question.toReversed(), "b")])
  $("other-answers").disabled = !question
  $("back").disabled = !state.answers.length
}

// Of several people the shares of designs: first the one with the greatest smallest share.
function showShares() {
  if (dragging) return
  const held = latest(state.positions).filter(({answers}) => answers.length)
  const isShown = held.length > 1 && ranking.count > 0
  show("shares", isShown)
  if (!isShown) return
  const all = held.map(({answers}) => said(answers))
  const rows = [...model.candidates]
  const [least, most] = [1, -1].map((sign) => rows.map((row) => endOf(all.map(({shares}) => shares.get(row)), sign)))
  const [common] = bySize(least)
  const shown = unique([common, ...bySize(most).slice(0, 5)]).map((k) => rows[k])
  renew("shares-table",
    make("thead", make("tr", head("col", "best for"), held.map(({name}) => head("col", name)))),
    make("tbody", shown.map((row) => make("tr", head("row", inspectButton(row)),
      all.map(({texts}) => make("td.number", texts.get(row)))))))
  const last = all.find(({shares}) => shares.get(shown[0]) === least[common])
  const key = least[common] < 0.01 ? "no common" : "common"
  renew("shares-words", sentence(key, {design: called(shown[0]), share: last.texts.get(shown[0])}))
}

$("questions").onclick = ({target}) => ANSWERS[target.value]?.()
onKeys($("questions"), ANSWERS)
