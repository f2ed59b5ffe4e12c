// In which order designs are shown.

// The rows shown, prototypes first, then the best design first; dominated designs come last but
// where they are sorted by a column. "distance" is by place.
function ordered(data, ranking, state) {
  const {by, name, down} = state.order
  const {pareto, byPlace} = ranking
  const turned = (list) => (down ? list.slice().reverse() : list)
  if (by === "column" || by === "label") {
    const column = by === "label" ? null : data.by.get(name)
    const array = column ? valuesOf(ranking, column) : data.alphabetic ??= alphabetic(data)
    const sorted = argsort(array, state.dominated ? ranking.rows : ranking.front)
    const known = picked(sorted, (i) => !Number.isNaN(array[i]))
    return joined(data.prototypes, turned(known), picked(sorted, (i) => Number.isNaN(array[i]))) // missing ones last
  }
  const dominated = state.dominated ? picked(ranking.rows, (i) => !pareto[i]) : new Int32Array(0)
  if (by === "preference") {
    const {value, total, best} = preference(data, ranking, state.preference)
    const others = picked(ranking.front, (i) => !best.includes(i))
    const byWish = joined(best, argsort(value, argsort(total, others)))
    return joined(data.prototypes, turned(byWish), turned(argsort(value, dominated)))
  }
  return joined(data.prototypes, turned(byPlace), turned(argsort(ranking.mu1, dominated)))
}

// The rows that a search finds by a part of a name or a text, whatever the limits, those shown first.
function searched(data, text, shown) {
  if (!text) return shown
  const fits = (cell) => cell.toLowerCase().includes(text.toLowerCase())
  const columns = data.columns.filter(({texts}) => texts)
  const exact = data.rowOf.has(text) ? [data.rowOf.get(text)] : []
  return Int32Array.from([...new Set([...exact, ...shown, ...data.names.keys()])].filter((row) =>
    fits(data.names[row]) || columns.some(({texts, values}) => fits(texts[values[row]]))))
}

// The places of the names in the order of a dictionary, in which 9 comes before 10.
function alphabetic({names}) {
  const {compare} = new Intl.Collator(undefined, {numeric: true})
  const places = new Float64Array(names.length)
  names.map((_, row) => row).sort((a, b) => compare(names[a], names[b])).forEach((row, k) => { places[row] = k })
  return places
}

// The achievement function of every row left, max w (f - r) / range, the least of which is chosen,
// and the sum of its terms, which decides ties (selection's ReferencePoint). Without an aspiration
// an objective is measured from its best value; weights are 1 unless given.
function preference(data, ranking, {weights, aspiration}) {
  const {objectives} = data
  const value = new Float64Array(data.total).fill(NaN)
  const total = value.slice()
  if (ranking.count === 0) return {value, total, best: []}
  const {frame, front} = ranking
  const given = objectives.map(({name}) => entryOf(weights, name) ?? 1)
  const most = max(...given)
  const ratios = given.map((weight) => (most > 0 ? weight / most : 1))
  const w = ratios.map((ratio) => ratio / sum(ratios))
  const point = objectives.map(({name, maximize}, j) => {
    const wish = entryOf(aspiration, name)
    if (wish === undefined) return frame.ideal[j]
    return maximize ? -wish : wish
  })
  const measure = (row) => {
    let greatest = -Infinity
    let all = 0
    for (let j = 0; j < w.length; j++) {
      const term = w[j] * ((data.F[j][row] - point[j]) / frame.scale[j])
      if (term > greatest) greatest = term
      all += term
    }
    value[row] = greatest
    total[row] = all
  }
  joined(ranking.rows, data.prototypes).forEach(measure)
  const noise = frame.sizes.map((size, j) =>
    LAST_PLACES * w[j] * max(size, abs(point[j] / frame.scale[j])))
  const nearest = (list, key, tolerance) => {
    const reach = leastOf(list.map((i) => key[i])) + tolerance
    return list.filter((i) => key[i] <= reach)
  }
  const best = nearest(nearest([...front], value, max(...noise)), total, sum(noise))
  return {value, total, best}
}
