// A few questions find the design that a person wants (pareto's Preferences, by the same steps; the
// reasons for its numbers stand there).

const [N_WEIGHTS, N_OTHERS, AVERAGED, LIKELIEST, ASKED] = [1024, 128, 128, 256, 12]
const [SHARPNESS, MISTAKES, CERTAIN, ENOUGH] = [30, 0.15, 0.9, 0.01]
const [VISIBLE, ALIKE, CHEBYSHEV_SUM] = [0.01, 0.04, 1e-9]
const RELATIONS = [">", "=", "?"] // the first is preferred, both are as good, the question was skipped

// The first of the greatest values; what differs by less than TIE is equal.
function firstGreatest(values) {
  const reach = endOf(values, -1) - TIE
  return values.findIndex((value) => value >= reach)
}

// What is known of a person before the first answer. Designs are places in the front.
//   steps         for each objective, how far they are from its best value; what is seen
//   terms         of each design, what the weights multiply, those of repeated objectives left out
//   weights       the first of them measure by the norm 1, others by the greatest part, most by 2
//   candidates    what can be proposed: the designs that are the best for some weights
//   scales        for each weight, the least distance and what is at stake
//   values        for each weight, of the candidates: 1 for the best one, 0 for an average one
//   winners       for each weight, which candidate is the best
class Preferences {
  constructor({front, frame}) {
    this.front = front
    const columns = data.F.map((column, j) => Float64Array.from(front, (i) => max(0, (column[i] - frame.ideal[j]) / frame.scale[j])))
    const varied = columns.filter((column) => endOf(column, -1) > endOf(column, 1))
    this.steps = varied.map((column) => {
      const [low, high] = [endOf(column, 1), endOf(column, -1)]
      return column.map((term) => (term - low) / (high - low))
    })
    const isAlike = (one, other) => sqrt(sum(one.map((step, i) => (step - other[i]) ** 2)) / front.length) <= ALIKE
    const weighted = varied.filter((_, j) => this.steps.findIndex((other) => isAlike(other, this.steps[j])) === j)
    const all = upTo(front.length)
    this.terms = Array.from(all, (i) => weighted.map((column) => column[i]))
    this.weights = simplexWeights(data.points, weighted.length)
    const nearest = this.weights.map((_, w) => {
      const distances = this.distances(w, all)
      return distances.indexOf(endOf(distances, 1))
    })
    this.candidates = unique(nearest).sort((a, b) => a - b)
    const step = ceil(front.length / AVERAGED)
    const some = all.filter((i) => i % step === 0)
    this.scales = this.weights.map((_, w) => {
      const least = endOf(this.distances(w, this.candidates), 1)
      return [least, max(sum(this.distances(w, some)) / some.length - least, 1e-12)]
    })
    this.values = this.weights.map((_, w) => this.valued(w, this.candidates))
    this.winners = this.values.map(firstGreatest)
  }

  distances(w, places) {
    const weight = this.weights[w]
    const result = new Float64Array(places.length)
    for (let k = 0; k < places.length; k++) {
      const terms = this.terms[places[k]]
      let total = 0
      let square = 0
      let greatest = 0
      for (let j = 0; j < terms.length; j++) {
        const part = weight[j] * terms[j]
        total += part
        square += part * part
        if (part > greatest) greatest = part
      }
      result[k] = w >= 2 * N_OTHERS ? sqrt(square) : w < N_OTHERS ? total : greatest + CHEBYSHEV_SUM * total
    }
    return result
  }

  valued(w, places) {
    const [least, stake] = this.scales[w]
    return this.distances(w, places).map((distance) => 1 - (distance - least) / stake)
  }

  // What answers say: lists of a row, a relation and another row, all of the front.
  //   row, regret    the proposal and its expected regret
  //   shares         the probability that a row is the best, a Map
  //   texts          these in per cent
  //   question       two rows, or null where another answer is not worth it
  after(answers) {
    let chances = this.weights.map(() => 1 / N_WEIGHTS)
    for (const [one, relation, other] of answers) {
      if (relation === "?") continue
      const places = [one, other].map((row) => this.front.indexOf(row))
      chances = chances.map((chance, w) => {
        const c = chanceOf(...this.valued(w, places))
        return chance * (relation === "=" ? 4 * c * (1 - c) : c)
      })
      const total = sum(chances)
      chances = chances.map((chance) => chance / total)
    }
    const expected = expectedValues(chances, this.values)
    const best = firstGreatest(expected)
    const regret = max(0, 1 - endOf(expected, -1))
    const likely = this.candidates.map(() => 0)
    this.winners.forEach((k, w) => { likely[k] += chances[w] })
    const rows = this.candidates.map((place) => this.front[place])
    const byRow = (list) => new Map(rows.map((row, k) => [row, list[k]]))
    const [shares, texts] = [byRow(likely), byRow(percents(likely))]
    likely[best] += 1
    const question = regret < ENOUGH ? null : this.question(chances, bySize(likely).slice(0, LIKELIEST), answers)
    return {row: rows[best], regret, shares, texts, question}
  }

  // The rows of two of the likeliest candidates after whose comparison the proposal is expected to be
  // regretted least.
  question(chances, likeliest, answers) {
    const values = this.values.map((own) => Float64Array.from(likeliest, (k) => own[k]))
    const expected = expectedValues(chances, values)
    const places = likeliest.slice(0, ASKED).map((k) => this.candidates[k])
    let [question, most] = [null, -Infinity]
    places.forEach((one, a) => places.forEach((other, b) => {
      const rows = [this.front[one], this.front[other]]
      const visible = this.steps.filter((column) => abs(column[one] - column[other]) >= VISIBLE - TIE)
      const isKnown = answers.some(([first, , second]) => rows.includes(first) && rows.includes(second))
      if (b <= a || visible.length < 2 || isKnown) return
      const prefers = chances.map((chance, w) => chance * chanceOf(values[w][a], values[w][b]))
      const share = sum(prefers)
      if (!(share > 1 - CERTAIN && share < CERTAIN)) return
      const favoured = expectedValues(prefers, values)
      const after = endOf(favoured, -1) + endOf(expected.map((value, k) => value - favoured[k]), -1)
      if (after > most + TIE) [question, most] = [rows, after]
    }))
    return question
  }
}

// The sums over all weights of their chances times the values of designs.
function expectedValues(chances, values) {
  const result = new Float64Array(values[0].length)
  for (let w = 0; w < chances.length; w++) {
    const [chance, own] = [chances[w], values[w]]
    for (let k = 0; k < own.length; k++) result[k] += chance * own[k]
  }
  return result
}

const chanceOf = (one, other) => (1 + (1 - MISTAKES) * Math.tanh(SHARPNESS * (one - other))) / 2

// Weights that lie evenly on the simplex, of the first points of the LPτ sequence.
function simplexWeights(points, m) {
  return Array.from({length: N_WEIGHTS}, (_, i) => {
    let left = 1
    const weights = []
    for (let rest = m - 1; rest > 0; rest--) {
      weights.push(left * (1 - ((points[m - 1 - rest][i] + 0.5) / N_WEIGHTS) ** (1 / rest)))
      left -= weights.at(-1)
    }
    return [...weights, left]
  })
}

// The answers of names that count here: those on designs that no other dominates.
function countedAnswers({pareto}, answers) {
  const rows = answers.map(([one, relation, other]) => [rowOf(one), relation, rowOf(other)])
  return rows.filter(([one, , other]) => pareto[one] && pareto[other])
}
