// A few questions find the design that a person wants (pareto's Preferences, by the same steps).

const RELATIONS = [">", "=", "?"] // the first is preferred, both are as good, the question was skipped

// The first of the greatest values; what differs by less than TIE is equal.
function firstGreatest(values) {
  const reach = endOf(values, -1) - TIE
  return values.findIndex((value) => value >= reach)
}

// What is known of a person before the first answer. Designs are rows of the front.
//   steps         for each objective, by row, how far they are from its best value; what is seen
//   terms         as these, what the weights multiply, those of repeated objectives left out
//   weights       the first of them measure by the norm 1, others by the greatest part, most by 2
//   candidates    what can be proposed: the designs that are the best for some weights
//   scales        for each weight, the least distance and what is at stake
//   winners       for each weight, which candidate is the best
function preferencesOf({front, frame}) {
  const columns = data.F.map((column, j) => column.map((value) => max(0, (value - frame.ideal[j]) / frame.scale[j])))
  const varied = columns.filter((column) => endOf(column, -1, front) > endOf(column, 1, front))
  const steps = varied.map((column) => {
    const [low, high] = endsOf(column, front)
    return column.map((term) => (term - low) / (high - low))
  })
  const isAlike = (one, other) => sqrt(sum(Array.from(front, (i) => (one[i] - other[i]) ** 2)) / front.length) <= SAME
  const terms = varied.filter((_, j) => steps.findIndex((other) => isAlike(other, steps[j])) === j)
  const weights = simplexWeights(data.points, terms.length)
  const nearest = weights.map((_, w) => {
    const away = distancesBy(w, front)
    return front[away.indexOf(endOf(away, 1))]
  })
  const candidates = Int32Array.from(new Set(nearest)).sort()
  const some = front.filter((_, i) => i % ceil(front.length / N_AVERAGED) === 0)
  const scales = weights.map((_, w) => {
    const least = endOf(distancesBy(w, candidates), 1)
    return [least, max(sum(distancesBy(w, some)) / some.length - least, 1e-12)]
  })
  const winners = valued(candidates).map(firstGreatest)

  function distancesBy(w, rows) {
    const weight = weights[w]
    const result = new Float64Array(rows.length)
    for (let k = 0; k < rows.length; k++) {
      let total = 0
      let square = 0
      let greatest = 0
      for (let j = 0; j < terms.length; j++) {
        const part = weight[j] * terms[j][rows[k]]
        total += part
        square += part * part
        if (part > greatest) greatest = part
      }
      result[k] = w >= 2 * N_OTHERS ? sqrt(square) : w < N_OTHERS ? total : greatest + CHEBYSHEV_SUM * total
    }
    return result
  }

  // For each weight, values of designs: 1 for the best one, 0 for an average one.
  function valued(rows) {
    return scales.map(([least, stake], w) => distancesBy(w, rows).map((distance) => 1 - (distance - least) / stake))
  }

  // What answers say: lists of a row, a relation and another row, all of the front.
  //   row, regret    the proposal and its expected regret
  //   shares         the probability that a row is the best, a Map
  //   texts          these in per cent
  //   question       two rows, or null where another answer is not worth it
  function after(answers) {
    const rows = unique([...candidates, ...answers.filter(([, relation]) => relation === ">").map(([one]) => one)])
    let chances = weights.map(() => 1 / N_WEIGHTS)
    for (const [one, relation, other] of answers) {
      if (relation === "?") continue
      valued([one, other]).forEach((values, w) => {
        const c = chanceOf(...values)
        chances[w] *= relation === "=" ? 4 * c * (1 - c) : c
      })
      const total = sum(chances)
      chances = chances.map((chance) => chance / total)
    }
    const expected = ofUnbeaten(expectedValues(chances, valued(rows)), rows, answers)
    const best = firstGreatest(expected)
    const regret = max(0, 1 - expected[best])
    const likely = rows.map(() => 0)
    winners.forEach((k, w) => { likely[k] += chances[w] })
    const byRow = (list) => new Map(rows.map((row, k) => [row, list[k]]))
    const shares = byRow(likely)
    const texts = byRow(percents(likely))
    likely[best] += 1
    const likeliest = bySize(likely).slice(0, N_LIKELIEST).map((k) => rows[k])
    const question = regret < ENOUGH ? null : questionOf(chances, likeliest, answers)
    return {row: rows[best], regret, shares, texts, question}
  }

  // The rows of two of the likeliest designs after whose comparison the proposal is expected to be
  // regretted least.
  function questionOf(chances, likeliest, answers) {
    const values = valued(likeliest)
    const expected = expectedValues(chances, values)
    const rows = likeliest.slice(0, N_ASKED)
    const best = (list, winner, loser) => endOf(ofUnbeaten(list, likeliest, [...answers, [winner, ">", loser]]), -1)
    let question = null
    let most = -Infinity
    rows.forEach((one, a) => rows.forEach((other, b) => {
      const pair = [one, other]
      const visible = steps.filter((column) => abs(column[one] - column[other]) >= VISIBLE - TIE)
      const isKnown = answers.some(([first, , second]) => pair.includes(first) && pair.includes(second))
      if (b <= a || visible.length < 2 || isKnown) return
      const prefers = chances.map((chance, w) => chance * chanceOf(values[w][a], values[w][b]))
      const share = sum(prefers)
      if (!(share > 1 - CERTAIN && share < CERTAIN)) return
      const favoured = expectedValues(prefers, values)
      const after = best(favoured, one, other) + best(expected.map((value, k) => value - favoured[k]), other, one)
      if (after <= most + TIE) return
      question = pair
      most = after
    }))
    return question
  }
  return {front, candidates, after}
}

// The values of rows without those that answers put below others, and not above these again.
function ofUnbeaten(values, rows, answers) {
  const preferred = answers.filter(([, relation]) => relation === ">")
  const below = (row) => {
    const list = new Set([row])
    for (const one of list) for (const [better, , worse] of preferred) if (better === one) list.add(worse)
    return list
  }
  const beaten = preferred.flatMap(([one]) => [...below(one)].filter((row) => !below(row).has(one)))
  return values.map((value, k) => beaten.includes(rows[k]) ? -Infinity : value)
}

// The sums over all weights of their chances times the values of designs.
function expectedValues(chances, values) {
  const result = new Float64Array(values[0].length)
  values.forEach((own, w) => {
    const chance = chances[w]
    for (let k = 0; k < own.length; k++) result[k] += chance * own[k]
  })
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
