// A few questions find the design that a person wants (pareto's Preferences, by the same steps; the
// reasons for its numbers stand there).

const NORMS = [[2, 1024, 0.8], [1, 256, 0.1], [Infinity, 256, 0.1]] // with their weights and probability
const [PROPOSED, OF_MEDIAN, ASKED] = [256, 128, 12] // the most designs
const [SHARPNESS, MISTAKES, CERTAIN, ENOUGH, OPEN] = [60, 0.15, 0.9, 0.01, 1e-3]
const [VISIBLE, ALIKE] = [0.01, 0.04] // in units of the ranges
const RELATIONS = [">", "=", "?"] // the first is preferred, both are as good, the question was skipped

// Weights that lie evenly on the simplex, of n points of the LPτ sequence, one row after the other.
function simplexWeights(directions, n, m) {
  const weights = new Float64Array(n * m)
  for (let i = 0; i < n; i++) {
    let left = 1
    for (let j = 0; j < m - 1; j++) {
      let point = 0
      for (let k = 0; i >> k; k++) if ((i >> k) & 1) point ^= directions[j][k]
      const share = left * (1 - ((point / 1024 + 0.5 / n) % 1) ** (1 / (m - 1 - j)))
      weights[i * m + j] = max(0, share)
      left -= share
    }
    weights[i * m + m - 1] = max(0, left)
  }
  return weights
}

// The places of values, the greatest first, and the first of the greatest; what differs by less than
// TIE is equal.
const bySizes = (values) => [...values.keys()].sort((a, b) => round(values[b] / TIE) - round(values[a] / TIE) || a - b)
function firstGreatest(values) {
  const reach = endOf(values, -1) - TIE
  return values.findIndex((value) => value >= reach)
}

// What is known of a person before the first answer.
//   steps, terms    distances of the front from the best values, what is seen and what is weighted
//   weights         of all norms, each as {p, all, from, to}
//   candidates      places in the front of what can be proposed
//   values          of the candidates, a row for each weight
//   winners         the candidate that each weight proposes
//   prior           the probability of each weight
class Preferences {
  constructor(data, {front, frame}) {
    this.front = front
    const n = front.length
    let columns = data.F.map((column, j) => Float64Array.from(front, (i) => max(0, (column[i] - frame.ideal[j]) / frame.scale[j])))
    const most = max(...columns.map((column) => endOf(column, -1))) || 1
    columns = columns.map((column) => column.map((term) => term / most))
    const varied = columns.filter((column) => endOf(column, -1) > endOf(column, 1))
    columns = varied.length ? varied : columns.slice(0, 1)
    this.steps = columns.map((column) => {
      const [low, high] = [endOf(column, 1), endOf(column, -1)]
      return column.map((term) => (term - low) / max(high - low, 1e-300))
    })
    const isAlike = (one, other) => sqrt(sum(one.map((step, i) => (step - other[i]) ** 2)) / n) <= ALIKE
    this.terms = columns.filter((_, j) => this.steps.findIndex((other) => isAlike(other, this.steps[j])) === j)
    const m = this.terms.length
    let from = 0
    this.weights = NORMS.map(([p, count]) => ({p, all: simplexWeights(data.directions, count, m), from, to: from += count}))
    this.n = from
    this.prior = new Float64Array(from)
    NORMS.forEach(([, count, share], k) => this.prior.fill(share / count, this.weights[k].from, this.weights[k].to))
    this.findCandidates()
  }

  findCandidates() {
    const n = this.front.length
    const firsts = new Map()
    const first = upTo(n).map((i) => {
      const key = this.terms.map((column) => column[i]).join()
      if (!firsts.has(key)) firsts.set(key, i)
      return firsts.get(key)
    })
    const counts = new Float64Array(n)
    for (const group of this.weights) {
      const nearest = this.nearest(group)
      for (let w = group.from; w < group.to; w++) counts[first[nearest[w - group.from]]] += this.prior[w]
    }
    this.candidates = bySizes(counts).slice(0, PROPOSED).filter((i) => counts[i] > 0).sort((a, b) => a - b)
    const few = min(n, OF_MEDIAN)
    const others = this.distances(Array.from({length: few}, (_, i) => floor(i * n / few)))
    const values = this.distances(this.candidates)
    const k = this.candidates.length
    this.least = new Float64Array(this.n)
    this.stake = new Float64Array(this.n)
    this.winners = new Int32Array(this.n)
    for (let w = 0; w < this.n; w++) {
      const row = values.subarray(w * k, w * k + k)
      const other = others.subarray(w * few, w * few + few).sort()
      this.least[w] = endOf(row, 1)
      const middle = (other[(few - 1) >> 1] + other[few >> 1]) / 2
      this.stake[w] = max(max(middle, other[few - 1] / 4) - this.least[w], 1e-12)
      for (let j = 0; j < k; j++) row[j] = this.value(w, row[j])
      this.winners[w] = firstGreatest(row)
    }
    this.values = values
  }

  value(w, distance) {
    return max(1 - (distance - this.least[w]) / this.stake[w], -1)
  }

  // The nearest design of each weight of a norm. No root is taken, as it changes no order.
  nearest({p, all, from, to}) {
    const m = this.terms.length
    const n = this.front.length
    const terms = this.terms.map((column) => isNumber(p) ? column.map((term) => term ** p) : column)
    const result = new Int32Array(to - from)
    const distances = new Float64Array(n)
    for (let w = 0; w < to - from; w++) {
      const weight = all.subarray(w * m, w * m + m)
      const most = endOf(weight, -1)
      distances.fill(0)
      for (let j = 0; j < m; j++) {
        const share = weight[j] / most
        const [factor, column] = [isNumber(p) ? share ** p : share, terms[j]]
        if (isNumber(p)) for (let i = 0; i < n; i++) distances[i] += factor * column[i]
        else for (let i = 0; i < n; i++) distances[i] = max(distances[i], factor * column[i])
      }
      if (!isNumber(p)) for (let j = 0; j < m; j++) { // what the greatest term does not tell apart
        const [factor, column] = [1e-9 * weight[j] / most, terms[j]]
        for (let i = 0; i < n; i++) distances[i] += factor * column[i]
      }
      let best = 0
      for (let i = 1; i < n; i++) if (distances[i] < distances[best]) best = i
      result[w] = best
    }
    return result
  }

  // Weighted distances of some designs of the front, a row for each weight.
  distances(places) {
    const [m, k] = [this.terms.length, places.length]
    const result = new Float64Array(this.n * k)
    for (const {p, all, from, to} of this.weights) for (let w = from; w < to; w++) for (let c = 0; c < k; c++) {
      let total = 0
      for (let j = 0; j < m; j++) {
        const term = all[(w - from) * m + j] * this.terms[j][places[c]]
        total = isNumber(p) ? total + term ** p : max(total, term)
      }
      result[w * k + c] = p === 2 ? sqrt(total) : total
    }
    return result
  }

  // The sums over all weights of their chances times the values of the candidates.
  expected(chances) {
    const k = this.candidates.length
    const result = new Float64Array(k)
    for (let w = 0; w < this.n; w++) for (let j = 0; j < k; j++) result[j] += chances[w] * this.values[w * k + j]
    return result
  }

  // What answers say: lists of a row, a relation and another row, all of the front.
  //   row, regret    the proposal and its expected regret
  //   shares         the probability that a row is the best, a Map
  //   question       two rows, or null; `enough` if another answer is not worth it
  after(answers) {
    let {prior: chances} = this
    const asked = new Set()
    for (const [one, relation, other] of answers) {
      asked.add(pairKey(one, other))
      if (relation === "?") continue
      const distances = this.distances([one, other].map((row) => this.front.indexOf(row)))
      chances = chances.map((chance, w) => {
        const c = chanceOf(this.value(w, distances[2 * w]), this.value(w, distances[2 * w + 1]))
        return chance * (relation === "=" ? 4 * c * (1 - c) : c)
      })
      const total = sum(chances)
      chances = chances.map((chance) => chance / total)
    }
    const expected = this.expected(chances)
    const best = firstGreatest(expected)
    const regret = max(0, 1 - endOf(expected, -1))
    const likely = new Float64Array(expected.length)
    for (let w = 0; w < this.n; w++) likely[this.winners[w]] += chances[w]
    const rowOfCandidate = (k) => this.front[this.candidates[k]]
    const shares = new Map([...likely.keys()].map((k) => [rowOfCandidate(k), likely[k]]))
    const enough = regret < ENOUGH
    likely[best] += 1
    const pair = enough ? null : this.question(chances, expected, likely, asked)
    return {row: rowOfCandidate(best), regret, shares, enough, question: pair && pair.map(rowOfCandidate)}
  }

  // The pair of candidates after whose answer the proposal is expected to be regretted least.
  question(chances, expected, likely, asked) {
    const k = this.candidates.length
    const some = bySizes(likely).slice(0, ASKED).filter((c) => likely[c] > 0)
    const prefers = new Float64Array(this.n)
    let [pair, most] = [null, -Infinity]
    some.forEach((a, at) => some.slice(at + 1).forEach((b) => {
      const [one, other] = [this.candidates[a], this.candidates[b]]
      const visible = this.steps.filter((column) => abs(column[one] - column[other]) >= VISIBLE - TIE).length
      if (visible < 2 || asked.has(pairKey(this.front[one], this.front[other]))) return
      for (let w = 0; w < this.n; w++) prefers[w] = chances[w] * chanceOf(this.values[w * k + a], this.values[w * k + b])
      const share = sum(prefers)
      const certainty = (share - MISTAKES / 2) / (1 - MISTAKES)
      if (!(certainty > 1 - CERTAIN && certainty < CERTAIN)) return
      const favoured = this.expected(prefers)
      const after = endOf(favoured, -1) + endOf(expected.map((value, c) => value - favoured[c]), -1) + OPEN * share * (1 - share)
      if (after > most + TIE) [pair, most] = [[a, b], after]
    }))
    return pair
  }
}

const pairKey = (one, other) => [one, other].sort((a, b) => a - b).join()
const chanceOf = (one, other) => (1 - MISTAKES) / (1 + Math.exp(-SHARPNESS * (one - other))) + MISTAKES / 2

// The answers of names that count here: those on designs that no other dominates.
function countedAnswers(data, {pareto}, answers) {
  const rows = answers.map(([one, relation, other]) => [data.rowOf.get(one) ?? -1, relation, data.rowOf.get(other) ?? -1])
  return rows.filter(([one, , other]) => pareto[one] && pareto[other])
}

// What an answer gives up for what (pareto's Preferences.trades).
function tradeText(data, ranking, [one, relation, other]) {
  const {gains: [, gains], shares: [, shares]} = gainsOf(data, ranking, [other, one])
  if (relation === "?" || !gains.some((gain) => gain !== 0)) return ""
  const [better, worse] = [1, -1].map((sign) => listed(bySize(shares).filter((j) => sign * gains[j] > 0).map((j) =>
    `${amount(data.objectives[j], abs(gains[j]))} of ${data.objectives[j].name}`)))
  const names = {design: capital(data.names[one]), other: data.names[other]}
  return sentence(data, relation === ">" ? "rather" : "as good", {...names, better, worse})
}
