// Runs the logic of the page on cases of the tests: node logic_driver.js < {script, cases} > answers.
const {script, cases} = JSON.parse(require("fs").readFileSync(0, "utf-8"))
const names = ["Preferences", "checked", "compareRows", "countedAnswers", "csv", "decisionOf", "decode", "explain", "initialState", "limited", "metadata", "opened",
  "ordered", "parsed", "preference", "ranked", "separation", "switchTexts", "switches", "tradeText", "typed", "verdictOn", "written"]
const Logic = Function(`${script}; return {${names}}`)()
const list = (array) => [...array]

// Only fronts, places and orders, one state after the other as a slider passes them.
function drag({payload, states}) {
  const data = Logic.decode(payload)
  return states.map((given) => {
    const {state} = Logic.checked(data, given)
    const ranking = Logic.ranked(data, Logic.limited(data, state).mask)
    const {front, place} = ranking
    return {front: list(front), place: list(place), order: list(Logic.ordered(data, ranking, state))}
  })
}

// What a person's answers say, one after the other.
function asked({payload, state, answers}) {
  const data = Logic.decode(payload)
  const {state: {limits, fixed}} = Logic.checked(data, state)
  const ranking = Logic.ranked(data, Logic.limited(data, {limits}).mask, fixed ? data.fixed : null)
  const counted = Logic.countedAnswers(data, ranking, answers)
  const model = new Logic.Preferences(data, ranking)
  return {
    said: [...Array(counted.length + 1).keys()].map((k) => {
      const {shares, ...said} = model.after(counted.slice(0, k))
      return {...said, shares: [...shares]}
    }),
    trades: counted.map((one) => Logic.tradeText(data, ranking, one)),
  }
}

// What decision files are to the page that have other objectives, directions and units.
function foreign(data) {
  const {state} = Logic.initialState(data)
  const written = Logic.decisionOf(data, state, "2026-01-31")
  const {objectives} = written
  return [{objectives: [...objectives].reverse()}, {units: {}},
    {units: {[objectives[0]]: "t"}}, {maximize: [...written.maximize, "other"]},
    {objectives: objectives.slice(1)}, {objectives: [null]}, {objectives: 5}, {page: 7},
    {normalize: !data.normalize}, {ranges: Object.fromEntries(objectives.map((name) => [name, [-1e9, 1e9]]))}]
    .map((changes) => Logic.opened(data, JSON.stringify({...written, ...changes})))
}

function switched(data, state, ranking) {
  const search = Logic.switches(data, state, ranking)
  let {value: rows, done} = search.next()
  while (!done) ({value: rows, done} = search.next())
  return {rows, texts: Logic.switchTexts(data, ranking, rows).map(([text]) => text)}
}

function answer({payload, states, rows, pins, texts, typed, thorough, numbers = []}) {
  const data = Logic.decode(payload)
  return {
    initial: Logic.initialState(data),
    foreign: foreign(data),
    checked: texts.map((text) => Logic.checked(data, Logic.parsed(text))),
    typed: typed.map((text) => Logic.typed(text)),
    numbers: numbers.map(([notation, value]) => Logic.written({notation}, value)),
    polluted: Object.keys(Object.prototype).length > 0 || ({}).dominated !== undefined,
    states: states.map((given, k) => {
      const {state, remarks} = Logic.checked(data, given)
      const {mask, count} = Logic.limited(data, state)
      const ranking = Logic.ranked(data, mask, state.fixed ? data.fixed : null)
      const {front, place, pareto, best, ideal, nadir, mu1, mu2, mu3} = ranking
      const order = Logic.ordered(data, ranking, state)
      const written = JSON.stringify(Logic.decisionOf(data, state, "2026-01-31"))
      return {
        state, remarks, count, verdict: Logic.verdictOn(data, ranking, -1), written, mask: list(mask),
        front: list(front), place: list(place), pareto: list(pareto), best, ideal, nadir,
        mu: [mu1, mu2, mu3].map(list), order: list(order),
        explained: count ? rows[k].map((row) => Logic.explain(data, ranking, row)) : [],
        instead: rows[k].map((row) => Logic.verdictOn(data, ranking, row)?.instead),
        compared: count ? Logic.compareRows(data, ranking, pins[k].slice(1), pins[k][0]) : null,
        separation: thorough[k] ? Logic.separation(data, ranking, state.positions) : null,
        switches: thorough[k] || !count ? switched(data, state, ranking) : null,
        preferred: list(Logic.preference(data, ranking, state.preference).best),
        opened: Logic.opened(data, written),
        csv: Logic.csv(data, order, ranking),
        metadata: Logic.metadata(data, order, state, "left.csv"),
      }
    }),
  }
}

process.stdout.write(JSON.stringify(cases.map((one) => (one.rows ? answer : one.answers ? asked : drag)(one))))
