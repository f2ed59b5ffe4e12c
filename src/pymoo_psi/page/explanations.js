// Why a design and what others give up, in the sentences of pareto.

const TIE = 1e-9 // as in pareto
const STEP = 0.01
const MOST_COSTS = 4

const sentence = (data, name, parts = {}) =>
  data.sentences[name].replace(/\{(\w+)\}/g, (_, part) => parts[part])

// A name that the user gave stays as it is.
const capital = (text) => text.replace(/^(design|row|test) /, (ours) => ours[0].toUpperCase() + ours.slice(1))
const listed = (names, word = "and") =>
  names.length > 1 ? `${names.slice(0, -1).join(", ")} ${word} ${names.at(-1)}` : names.join("")
const counted = (n, one) => `${exact(n)} ${one}${n === 1 ? "" : "s"}`

// What a design is under the limits.
function placeText(data, {mask, pareto, place}, row) {
  if (row >= data.n) return "prototype"
  if (!mask[row]) return "outside the limits"
  return pareto[row] ? `place ${place[row]}` : "dominated"
}

// A share that is given in per cent: where the range is 0, or ends before, only units tell.
const isWithin = (share) => abs(share) <= 1 + TIE

// The objectives by share, the largest first, NaN last.
function bySize(shares) {
  const sizes = shares.map((share) => (Number.isNaN(share) ? -1 : round(abs(share) / TIE)))
  return shares.map((_, j) => j).sort((a, b) => sizes[b] - sizes[a] || a - b)
}

// What a row gains against another in each objective, and this in shares of the ranges.
function gainsOf(data, {frame}, row, other) {
  const gains = data.F.map((column) => column[other] - column[row] + 0)
  return {gains, shares: gains.map((gain, j) => shareOf(gain, frame.lengths[j]))}
}

// What is gained and what is lost, the largest share of a range first.
const gainsAndLosses = ({gains, shares}, text) => [1, -1].map((sign) =>
  listed(bySize(shares).filter((j) => sign * gains[j] > 0).map(text)))

const changeText = (data, column, gain) => sentence(data, (gain > 0) === column.maximize ? "higher" : "lower",
  {objective: column.name, amount: amount(column, abs(gain))})

// Where a design is better than another and where worse, in words.
function differenceText(data, ranking, row, other) {
  const difference = gainsOf(data, ranking, row, other)
  const [better, worse] = gainsAndLosses(difference, (j) => changeText(data, data.objectives[j], difference.gains[j]))
  return better && worse ? sentence(data, "mixed", {better, worse}) : better || worse || sentence(data, "equal")
}

const shareOf = (difference, length) =>
  length === Infinity && difference !== 0 ? NaN : difference / length + 0

function against(data, ranking, key, row, other, parts = {}) {
  const name = data.names[row]
  const design = data.sentences[key].startsWith("{design}") ? capital(name) : name
  return sentence(data, key, {design, other: data.names[other], difference: differenceText(data, ranking, row, other), ...parts})
}

// The rows to compare, the base first: the existing design, or else the best. Beside it stand the
// best, the chosen one, the one looked at and what is pinned, and the designs nearest to the one
// looked at, so that there are four. Each: `{row, roles}`.
function comparison(data, ranking, state, shown = -1) {
  if (ranking.count === 0) return []
  const row = (name) => data.rowOf.get(name) ?? -1
  const best = ranking.best[0]
  const chosen = row(state.chosen)
  const base = data.total > data.n ? data.n : best
  const looked = shown >= 0 ? shown : chosen >= 0 ? chosen : best
  const rows = new Set([base, best, chosen, looked, ...state.pins.map(row)].filter((i) => i >= 0))
  const near = nearestTo(data, ranking, looked, rows, 4 - rows.size)
  const roles = [[base, "base"], [best, "proposed"], [chosen, "chosen"], ...near.map((i) => [i, "near"])]
  return [...rows, ...near].map((i) => ({
    row: i, roles: roles.filter(([one]) => one === i).map(([, role]) => role),
  }))
}

// Some rows of the front that are nearest to a row, in units of the ranges, but for those taken.
function nearestTo(data, {front, frame}, row, taken, count) {
  const away = new Float64Array(data.n)
  data.F.forEach((column, j) => {
    for (const i of front) away[i] += ((column[i] - column[row]) / frame.lengths[j]) ** 2
  })
  return [...argsort(away, picked(front, (i) => !taken.has(i))).subarray(0, max(0, count))]
}

// What rows gain against one of them in each objective, and this in shares of its range.
function compareRows(data, ranking, rows, base) {
  const all = rows.map((row) => gainsOf(data, ranking, row, base))
  return data.objectives.map((column, j) => ({column, gains: all.map(({gains}) => gains[j]), shares: all.map(({shares}) => shares[j])}))
}

// Why a design: its distances from the best, and towards each objective the design that gives up
// least (pareto's explain). Any row, also dominated or a prototype.
function explain(data, ranking, row) {
  const {front, frame: {low, lengths}, pareto} = ranking
  const {objectives, F} = data
  const own = F.map((column) => column[row])
  const behind = own.map((value, j) => value - low[j])
  const shares = behind.map((value, j) => shareOf(value, lengths[j]))
  const loss = new Float64Array(front.length) // the greatest in an objective, in units of the ranges
  F.forEach((column, j) => {
    const [value, length] = [own[j], lengths[j]]
    for (let k = 0; k < loss.length; k++) {
      const d = column[front[k]] - value
      if (d > 0 && d / length > loss[k]) loss[k] = d / length
    }
  })
  const distance = (k) => sqrt(sum(F.map((column, j) => ((column[front[k]] - own[j]) / lengths[j]) ** 2)))
  // The nearest of some; among those that tie, the least by a key.
  const nearest = (some, key) => {
    const away = Float64Array.from(some, distance).map((value) => (Number.isNaN(value) ? Infinity : value))
    const reach = leastOf(away) * (1 + TIE)
    return some.filter((_, k) => away[k] <= reach).reduce((a, b) => (key(b) < key(a) ? b : a))
  }
  const neighbours = F.map((column, j) => {
    const leastLosses = (step) => { // the places of those that gain so much
      let [some, reach] = [[], Number.MAX_VALUE]
      for (let k = 0; k < loss.length; k++) {
        if (!(loss[k] <= reach && column[front[k]] < own[j] && own[j] - column[front[k]] >= step)) continue
        reach = min(reach, loss[k] + TIE)
        some.push(k)
      }
      return some.filter((k) => loss[k] <= reach)
    }
    const some = [STEP * lengths[j], 0].map(leastLosses).find((list) => list.length)
    return some ? front[nearest(some, (k) => column[front[k]])] : -1
  })
  const least = leastOf(loss)
  const dominatedBy = pareto[row] ? -1 : front[nearest(picked(upTo(front.length), (k) => loss[k] === least), (k) => loss[k])]
  const ordered = bySize(shares)
  const most = max(0, ...shares.filter((share) => !Number.isNaN(share)))
  const weakest = objectives.filter((_, j) => most > 0 && shares[j] >= most * (1 - TIE)).map(({name}) => name)
  const steps = [] // a neighbour towards several objectives is one step
  for (const j of ordered.filter((j) => neighbours[j] >= 0)) {
    const same = steps.find((step) => step.row === neighbours[j])
    if (same) same.names.push(objectives[j].name)
    else steps.push({names: [objectives[j].name], row: neighbours[j], text: differenceText(data, ranking, neighbours[j], row)})
  }
  return {
    row,
    objectives: objectives.map(({name, values, maximize}, j) => ({
      name, value: values[row], best: maximize ? -low[j] : low[j], away: behind[j], share: shares[j],
    })),
    weakest,
    steps,
    standing: standingOf(data, ranking, row, dominatedBy),
    costs: costsOf(data, ranking, behind, shares),
  }
}

// How far a design is from the best values, the greatest share of a range first.
function costsOf(data, ranking, behind, shares) {
  const places = bySize(shares).filter((j) => behind[j] > 0)
  if (!places.length) return sentence(data, "all best")
  const changes = places.slice(0, MOST_COSTS).map((j, k) => {
    const column = data.objectives[j]
    return sentence(data, `${isWithin(shares[j]) ? "" : "bare "}${k ? "change" : "first change"}`, {objective: column.name,
      amount: amount(column, behind[j]), share: percent(shares[j]), range: ranking.fixed ? "fixed range" : "range"})
  })
  if (places.length > MOST_COSTS) changes.push(counted(places.length - MOST_COSTS, "other objective"))
  return sentence(data, "costs", {changes: listed(changes)})
}

function standingOf(data, ranking, row, dominatedBy) {
  const {front, best, place, mask, frame} = ranking
  const design = data.names[row]
  if (row >= data.n) return `${capital(design)} is not among the designs that are ranked.`
  if (!mask[row]) return `${capital(design)} is beyond the limits.`
  if (dominatedBy >= 0) {
    return sentence(data, "dominated", {design: capital(design), other: data.names[dominatedBy], difference: differenceText(data, ranking, dominatedBy, row)})
  }
  if (front.length === 1) return sentence(data, "single", {design})
  const names = data.objectives.filter((_, j) => frame.lengths[j] < Infinity && data.F[j][row] === frame.low[j]).map(({name}) => name)
  const parts = {best: names.length ? sentence(data, "best", {objectives: listed(names)}) : "", count: best.length, place: place[row], front: front.length}
  if (place[row] > 1) return sentence(data, "ranked", {...parts, design: capital(design)})
  return sentence(data, best.length === 1 ? "optimum" : "optima", {...parts, design})
}

// What is to be looked at first: the chosen design, or else the best compromise, which is proposed;
// null if nothing is left and none is chosen.
//   proposed   the row of the best compromise, or -1
//   instead    chosen against proposed, as a sentence; "" where they are one
//   remarks    what a reader must know of it
function verdictOn(data, ranking, chosen, key = "instead") {
  const proposed = ranking.best[0] ?? -1
  const row = chosen >= 0 ? chosen : proposed
  if (row < 0 || !ranking.count) return null
  const found = explain(data, ranking, row)
  const first = data.whole.best[0]
  const remarks = []
  if (ranking.place[first] !== 1) {
    remarks.push(against(data, ranking, ranking.mask[first] ? "moved" : "without limits", first, proposed))
  }
  const isProposed = ranking.place[row] === 1
  return {...found, proposed, remarks, instead: isProposed ? "" : against(data, ranking, key, row, proposed)}
}
