// Runs the logic of the page on cases of the tests: node logic_driver.js < {script, cases} > answers.
const {script, cases} = JSON.parse(require("fs").readFileSync(0, "utf-8"))
const names = ["checked", "countedAnswers", "csv", "decisionOf", "decode", "explain", "gainsOf", "limited", "metadata", "opened",
  "ordered", "parsed", "preference", "preferencesOf", "ranked", "separation", "stateOf", "changesOf", "outcomeOf", "switches", "typed", "verdictOn", "written"]
const Logic = Function(`${script}; return {${names}}`)()
const list = (array) => [...array]

// Only fronts, places and orders, one state after the other as a slider passes them.
function drag({payload, states}) {
  const data = Logic.decode(payload)
  let ranking = null
  return states.map((given) => {
    const {state} = Logic.checked(given)
    ranking = Logic.ranked(Logic.limited(state).mask, null, ranking)
    const {front, place} = ranking
    return {front: list(front), place: list(place), order: list(Logic.ordered(ranking, state))}
  })
}

// What a person's answers say, one after the other.
function asked({payload, state, answers}) {
  const data = Logic.decode(payload)
  const {state: {limits, fixed}} = Logic.checked(state)
  const ranking = Logic.ranked(Logic.limited({limits}).mask, fixed ? data.fixed : null)
  const counted = Logic.countedAnswers(ranking, answers)
  const model = Logic.preferencesOf(ranking)
  return {
    said: [...Array(counted.length + 1).keys()].map((k) => {
      const {shares, texts, ...said} = model.after(counted.slice(0, k))
      return {...said, shares: [...shares], texts: [...texts]}
    }),
  }
}

// What decision files are to the page that have other objectives, directions and units.
function foreign(data) {
  const {state} = Logic.stateOf(data.opens_with)
  const written = Logic.decisionOf(state, "2026-01-31")
  const {objectives} = written
  // What a command writes of it: objectives and the page are left out.
  const bare = {objectives: undefined, page: undefined, normalize: undefined, units: undefined, ranges: undefined}
  return [{objectives: [...objectives].reverse()}, {units: {}}, bare, {...bare, maximize: undefined},
    {...bare, maximize: ["other"]}, {...bare, limits: undefined, positions: undefined},
    {units: {[objectives[0]]: "t"}}, {maximize: [...written.maximize, "other"]},
    {objectives: objectives.slice(1)}, {objectives: [null]}, {objectives: 5}, {page: 7},
    {normalize: !data.normalize}, {ranges: Object.fromEntries(objectives.map((name) => [name, [-1e9, 1e9]]))}]
    .map((changes) => Logic.opened(JSON.stringify({...written, ...changes})))
}

function switched(state, ranking) {
  const search = Logic.switches(state, ranking)
  let {value: rows, done} = search.next()
  while (!done) ({value: rows, done} = search.next())
  return {rows, texts: Logic.changesOf(rows).map((change) => `${change.condition}, ${Logic.outcomeOf(change)}`)}
}

function answer({payload, states, rows, pins, texts, typed, thorough, numbers = []}) {
  const data = Logic.decode(payload)
  return {
    initial: Logic.stateOf(data.opens_with),
    foreign: foreign(data),
    checked: texts.map((text) => Logic.checked(Logic.parsed(text))),
    typed: typed.map((text) => Logic.typed(text)),
    numbers: numbers.map(([notation, value]) => Logic.written({notation}, value)),
    polluted: Object.keys(Object.prototype).length > 0 || ({}).dominated !== undefined,
    states: states.map((given, k) => {
      const {state, remarks} = Logic.checked(given)
      const {mask, count} = Logic.limited(state)
      const ranking = Logic.ranked(mask, state.fixed ? data.fixed : null)
      const {front, place, pareto, best, ideal, nadir, mu1} = ranking
      const order = Logic.ordered(ranking, state)
      const written = JSON.stringify(Logic.decisionOf(state, "2026-01-31"))
      return {
        state, remarks, count, verdict: Logic.verdictOn(ranking, -1), written, mask: list(mask),
        front: list(front), place: list(place), pareto: list(pareto), best, ideal, nadir,
        mu1: list(mu1), order: list(order),
        explained: count ? rows[k].map((row) => Logic.explain(ranking, row)) : [],
        instead: rows[k].map((row) => Logic.verdictOn(ranking, row)?.instead),
        compared: count ? pins[k].slice(1).map((row) => Logic.gainsOf(ranking, row, pins[k][0])) : null,
        separation: thorough[k] ? Logic.separation(ranking, state.positions) : null,
        switches: thorough[k] || !count ? switched(state, ranking) : null,
        preferred: list(Logic.preference(ranking, state)),
        opened: Logic.opened(written),
        csv: Logic.csv(order, ranking),
        metadata: Logic.metadata(order, state, "left.csv"),
      }
    }),
  }
}

process.stdout.write(JSON.stringify(cases.map((one) => (one.rows ? answer : one.answers ? asked : drag)(one))))
