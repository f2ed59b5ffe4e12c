// Why a design and what others give up, in the sentences of pareto.

// A sentence with its parts; one that begins with a design has a capital.
function sentence(name, parts = {}) {
  const text = data.sentences[name]
  const isBegin = (part, at) => part === "design" && at === 0 && text.endsWith(".")
  return text.replace(/\{(\w+)\}/g, (_, part, at) => isBegin(part, at) ? capital(parts.design) : parts[part])
}

// A name that the user gave stays as it is.
const capital = (text) => text.replace(/^(design|row|test) \d/, (ours) => ours[0].toUpperCase() + ours.slice(1))
// The name of a column in a sentence: "the price", but "f1".
const withArticle = (name) => (/^\p{L}{3,}(?![\p{L}\p{N}_])/u.test(name) ? `the ${name}` : name)
const listed = (names, word = "and") =>
  names.length > 1 ? `${names.slice(0, -1).join(", ")} ${word} ${names.at(-1)}` : names.join("")
const counted = (n, one) => `${exact(n)} ${one}${n === 1 ? "" : "s"}`

// What a design is under the limits.
function placeText({mask, pareto, place}, row) {
  if (row >= data.n) return "prototype"
  if (!mask[row]) return "outside the limits"
  return pareto[row] ? `place ${place[row]}` : "dominated"
}

// A share that is given in per cent: where the range is 0, or ends before, only units tell.
const isWithin = (share) => abs(share) <= 1 + TIE

// The objectives by share, the largest first, NaN last.
function bySize(shares) {
  const sizes = shares.map((share) => (Number.isNaN(share) ? -1 : round(abs(share) / TIE)))
  return [...shares.keys()].sort((a, b) => sizes[b] - sizes[a] || a - b)
}

// What a row gains against another in each objective, and this in shares of the ranges.
function gainsOf({frame}, row, other) {
  const gains = data.F.map((column) => column[other] - column[row] + 0)
  return {gains, shares: gains.map((gain, j) => shareOf(gain, frame.lengths[j]))}
}

const changeText = (column, gain, ranking) => sentence((gain > 0) === column.maximize ? "higher" : "lower",
  {objective: column.name, amount: amount(column, abs(gain), ranking)})

// Where a design is better than another and where worse, the largest share of a range first.
function differenceOf(ranking, row, other) {
  const {gains, shares} = gainsOf(ranking, row, other)
  const [better, worse] = [1, -1].map((sign) => listed(bySize(shares).filter((j) => sign * gains[j] > 0)
    .map((j) => changeText(data.objectives[j], gains[j], ranking))))
  return {better, worse}
}
function differenceText(ranking, row, other) {
  const {better, worse} = differenceOf(ranking, row, other)
  return better && worse ? sentence("mixed", {better, worse}) : better || worse || sentence("equal")
}

const shareOf = (difference, length) =>
  length === Infinity && difference !== 0 ? NaN : difference / length + 0

function against(ranking, key, row, other, parts = {}) {
  return sentence(key, {design: called(row), other: called(other), difference: differenceText(ranking, row, other), ...parts})
}

// How far a row is from the best values, those of fixed ranges perhaps, and this in shares of the
// ranges; negative where it is better.
function behindOf({frame: {ideal, lengths}}, row) {
  const behind = data.F.map((column, j) => column[row] - ideal[j])
  const shares = behind.map((value, j) => shareOf(value, lengths[j]))
  return {behind, shares, places: bySize(shares).filter((j) => behind[j] > NOISE * abs(ideal[j]))}
}

// Why a design: its distances from the best, and towards each objective the design that gives up
// least (pareto's explain). Any row, also dominated or a prototype.
function explain(ranking, row) {
  const behind = behindOf(ranking, row)
  const {shares} = behind
  const losses = lossesFrom(ranking, row)
  const neighbours = data.F.map((column, j) => {
    const rows = nearestTo(ranking, row, leastLoss(ranking, row, j, losses))
    return rows.length ? rows.reduce((a, b) => (column[b] < column[a] ? b : a)) : -1
  })
  // A neighbour towards several objectives is one step.
  const steps = unique(bySize(shares).map((j) => neighbours[j])).filter((i) => i >= 0)
  return {
    row,
    shares,
    steps: steps.map((i) => ({row: i, ...differenceOf(ranking, i, row)})),
    costs: costsOf(ranking, behind),
  }
}

// The greatest loss of each row of the front against a row, in units of the ranges.
function lossesFrom({front, frame: {lengths}}, row) {
  const losses = new Float64Array(data.total)
  data.F.forEach((column, j) => {
    const own = column[row]
    const length = lengths[j]
    for (const i of front) {
      const share = (column[i] - own) / length
      if (share > losses[i]) losses[i] = share
    }
  })
  return losses
}

// The rows of the front that lose least of those better than a row in an objective: by a step or, if
// none is, at all.
function leastLoss({front, frame: {lengths}}, row, j, losses) {
  const column = data.F[j]
  const own = column[row]
  for (const step of [STEP * lengths[j], 0]) {
    const better = []
    let reach = Number.MAX_VALUE
    for (const i of front) {
      if (!(losses[i] <= reach && column[i] < own && own - column[i] >= step)) continue
      reach = min(reach, losses[i] + TIE)
      better.push(i)
    }
    if (better.length) return better.filter((i) => losses[i] <= reach)
  }
  return []
}

// Those of some rows that are the nearest to a row, in units of the ranges.
function nearestTo({frame: {lengths}}, row, rows) {
  // Of an existing design without some value a distance is NaN.
  const away = rows.map((i) => sqrt(sum(data.F.map((column, j) => ((column[i] - column[row]) / lengths[j]) ** 2))) || 0)
  const reach = endOf(away, 1) + TIE
  return rows.filter((_, k) => away[k] <= reach)
}

// How far a design is from the best value where this is the greatest share of a range.
function behindText(ranking, row) {
  const {behind, shares, places: [j]} = behindOf(ranking, row)
  if (j === undefined) return "–"
  const column = data.objectives[j]
  return `${isWithin(shares[j]) ? percent(shares[j]) : amount(column, behind[j], ranking)} in ${column.name}`
}

// How far a design is from the best values, the greatest share of a range first; the rows have the shares.
function costsOf(ranking, {behind, places}) {
  const measure = ranking.fixed ? "fixed" : "best"
  if (!places.length) return sentence(`all ${measure}`)
  const changes = places.slice(0, MOST_COSTS).map((j) => {
    const column = data.objectives[j]
    return sentence("change", {objective: column.name, amount: amount(column, behind[j], ranking)})
  })
  if (places.length > MOST_COSTS) changes.push(counted(places.length - MOST_COSTS, "other objective"))
  return sentence(`costs ${measure}`, {changes: listed(changes)})
}

// In what the proposed design is the best.
function meritOf({front, frame: {low, high}}, row) {
  if (front.length === 1) return sentence("only")
  const best = data.objectives.filter((_, j) => low[j] < high[j] && data.F[j][row] === low[j])
  return best.length ? sentence("best", {objectives: listed(namesOf(best))}) : sentence("nearest")
}

// What is to be looked at first: the chosen design, or else the best compromise, which is proposed;
// null if nothing is left and none is chosen.
//   merit      why it is proposed, and, in a sentence, that others are as near
//   instead    it against what is proposed; "" where they are one
//   remark     what limits have changed, if they have
function verdictOn(ranking, chosen, key = "instead") {
  const proposed = ranking.best[0] ?? -1
  const row = chosen >= 0 ? chosen : proposed
  if (!ranking.count) return null
  const first = (ranking.fixed ? data.wholeFixed : data.whole).best[0]
  const {best, mask} = ranking
  return {
    ...explain(ranking, row),
    remark: best.includes(first) ? "" : against(ranking, mask[first] ? "moved" : "without limits", first, proposed),
    merit: meritOf(ranking, row),
    ties: best.length > 1 ? sentence("ties", {count: best.length}) : "",
    instead: best.includes(row) ? "" : against(ranking, key, row, proposed),
  }
}
