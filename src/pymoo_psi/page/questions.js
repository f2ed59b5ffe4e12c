// A few questions find the design that a person wants (pareto's Preferences, by the same steps; the
// reasons for its numbers stand there).

const NORMS = [[2, 1024, 0.8], [1, 256, 0.1], [Infinity, 256, 0.1]] // with their weights and probability
const [PROPOSED, OF_MEDIAN, ASKED] = [256, 128, 12] // the most designs
const [SHARPNESS, MISTAKES, CERTAIN, ENOUGH, OPEN] = [60, 0.15, 0.9, 0.01, 1e-3]
const [VISIBLE, ALIKE] = [0.01, 0.04] // in units of the ranges
const RELATIONS = [">", "=", "?"] // the first is preferred, both are as good, the question was skipped

// The places of values, the greatest first, and the first of the greatest; what differs by less than
// TIE is equal.
const bySizes = (values) => [...values.keys()].sort((a, b) => round(values[b] / TIE) - round(values[a] / TIE) || a - b)
function firstGreatest(values) {
  const reach = endOf(values, -1) - TIE
  return values.findIndex((value) => value >= reach)
}

// What is known of a person before the first answer.
//   steps             for each objective, how far the front is from its best values; what is seen
//   terms             for each of the m objectives that have a weight, what it weighs
//   weights, norms    m for each of n; prior, their probabilities
//   candidates        places in the front of what can be proposed
//   values            of the candidates, for each weight; winners, the candidate that it proposes
class Preferences {
  constructor(data, {front, frame}) {
    this.front = front
    const columns = data.F.map((column, j) => Float64Array.from(front, (i) => max(0, (column[i] - frame.ideal[j]) / frame.scale[j])))
    const most = max(...columns.map((column) => endOf(column, -1))) || 1
    const varied = columns.filter((column) => endOf(column, -1) > endOf(column, 1))
    const scaled = (varied.length ? varied : columns.slice(0, 1)).map((column) => column.map((term) => term / most))
    this.steps = scaled.map((column) => {
      const [low, high] = [endOf(column, 1), endOf(column, -1)]
      return column.map((term) => (term - low) / max(high - low, 1e-300))
    })
    const isAlike = (one, other) => sqrt(sum(one.map((step, i) => (step - other[i]) ** 2)) / front.length) <= ALIKE
    this.terms = scaled.filter((_, j) => this.steps.findIndex((other) => isAlike(other, this.steps[j])) === j)
    this.m = this.terms.length
    this.norms = NORMS.flatMap(([p, count]) => Array(count).fill(p))
    this.prior = Float64Array.from(NORMS.flatMap(([, count, share]) => Array(count).fill(share / count)))
    this.weights = Float64Array.from(NORMS.flatMap(([, count]) => this.simplex(data.points, count)))
    this.n = this.norms.length
    this.findCandidates()
  }

  // Weights that lie evenly on the simplex, of the first points of the LPτ sequence.
  simplex(points, count) {
    const weights = []
    for (let i = 0; i < count; i++) {
      let left = 1
      for (let rest = this.m - 1; rest > 0; rest--) {
        const point = points[this.m - 1 - rest][i] / 1024 + 0.5 / count
        const share = left * (1 - (point % 1) ** (1 / rest))
        weights.push(max(0, share))
        left -= share
      }
      weights.push(max(0, left))
    }
    return weights
  }

  // The distances of some designs of the front by a weight. Loops over columns, as there are many.
  distances(w, places) {
    const norm = this.norms[w]
    const result = new Float64Array(places.length)
    this.terms.forEach((column, j) => {
      const share = this.weights[w * this.m + j]
      for (let k = 0; k < places.length; k++) {
        const part = share * column[places[k]]
        if (norm === 1) result[k] += part
        else if (norm === 2) result[k] += part * part
        else if (part > result[k]) result[k] = part
      }
    })
    return norm === 2 ? result.map(sqrt) : result
  }

  // The nearest design by a weight. By the greatest term, the sum of all tells designs apart for which
  // that is the same.
  nearest(w, places) {
    const distances = this.distances(w, places)
    if (this.norms[w] === Infinity) this.terms.forEach((column, j) => {
      const share = 1e-9 * this.weights[w * this.m + j]
      for (let i = 0; i < column.length; i++) distances[i] += share * column[i]
    })
    return distances.indexOf(endOf(distances, 1))
  }

  findCandidates() {
    const n = this.front.length
    const firsts = new Map() // of equal designs
    const all = upTo(n)
    const first = all.map((i) => {
      const key = this.terms.map((column) => column[i]).join()
      if (!firsts.has(key)) firsts.set(key, i)
      return firsts.get(key)
    })
    const counts = new Float64Array(n)
    for (let w = 0; w < this.n; w++) counts[first[this.nearest(w, all)]] += this.prior[w]
    this.candidates = bySizes(counts).slice(0, PROPOSED).filter((i) => counts[i] > 0).sort((a, b) => a - b)
    const few = min(n, OF_MEDIAN)
    const some = upTo(few).map((i) => floor(i * n / few))
    this.scales = [] // the least distance and what is at stake
    this.values = []
    for (let w = 0; w < this.n; w++) {
      const others = this.distances(w, some).sort()
      const own = this.distances(w, this.candidates)
      const least = endOf(own, 1)
      const middle = (others[(few - 1) >> 1] + others[few >> 1]) / 2
      this.scales.push([least, max(max(middle, others[few - 1] / 4) - least, 1e-12)])
      this.values.push(this.valued(w, own))
    }
    this.winners = this.values.map(firstGreatest)
  }

  valued(w, distances) {
    const [least, stake] = this.scales[w]
    return distances.map((distance) => max(1 - (distance - least) / stake, -1))
  }

  // The sums over all weights of their chances times the values of the candidates.
  expected(chances) {
    const result = new Float64Array(this.candidates.length)
    for (let w = 0; w < this.n; w++) {
      const values = this.values[w]
      for (let j = 0; j < values.length; j++) result[j] += chances[w] * values[j]
    }
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
      const places = [one, other].map((row) => this.front.indexOf(row))
      chances = chances.map((chance, w) => {
        const c = chanceOf(...this.valued(w, this.distances(w, places)))
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
    const some = bySizes(likely).slice(0, ASKED).filter((c) => likely[c] > 0)
    let [pair, most] = [null, -Infinity]
    some.forEach((a, at) => some.slice(at + 1).forEach((b) => {
      const [one, other] = [this.candidates[a], this.candidates[b]]
      const visible = this.steps.filter((column) => abs(column[one] - column[other]) >= VISIBLE - TIE).length
      if (visible < 2 || asked.has(pairKey(this.front[one], this.front[other]))) return
      const prefers = chances.map((chance, w) => chance * chanceOf(this.values[w][a], this.values[w][b]))
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
  const difference = gainsOf(data, ranking, one, other)
  const [better, worse] = gainsAndLosses(difference, (j) =>
    `${amount(data.objectives[j], abs(difference.gains[j]))} of ${data.objectives[j].name}`)
  if (relation === "?" || !(better || worse)) return ""
  const names = {design: data.names[one], other: data.names[other]}
  return sentence(data, relation === ">" ? "rather" : "as good", {...names, better, worse})
}
