// In which order designs are shown.

// The rows shown, prototypes first, then the best design first; dominated designs come last but
// where they are sorted by a column. "distance" is by place.
function ordered(data, ranking, state) {
  const {by, name, down} = state.order
  const {front, rows, pareto} = ranking
  const turned = (list) => (down ? list.slice().reverse() : list)
  if (by === "column" || by === "label") {
    const values = by === "label" ? data.alphabetic ??= alphabetic(data) : valuesOf(ranking, data.by.get(name))
    const sorted = argsort(values, state.dominated ? rows : front)
    const isMissing = (i) => Number.isNaN(values[i]) // these are last
    return joined(data.prototypes, turned(picked(sorted, (i) => !isMissing(i))), picked(sorted, isMissing))
  }
  let [first, key] = [ranking.byPlace, ranking.mu1]
  if (by === "preference") {
    const {value, total, best} = preference(data, ranking, state.preference)
    first = joined(best, argsort(value, argsort(total, picked(front, (i) => !best.includes(i)))))
    key = value
  }
  const dominated = state.dominated ? picked(rows, (i) => !pareto[i]) : []
  return joined(data.prototypes, turned(first), turned(argsort(key, dominated)))
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
  const {objectives, F} = data
  const value = new Float64Array(data.total).fill(NaN)
  const total = value.slice()
  if (ranking.count === 0) return {value, total, best: []}
  const {frame, front} = ranking
  const given = objectives.map(({name}) => entryOf(weights, name) ?? 1)
  const most = max(...given)
  const ratios = given.map((weight) => (most > 0 ? weight / most : 1))
  const w = ratios.map((ratio) => ratio / sum(ratios))
  const point = objectives.map(({name, maximize}, j) => {
    const wish = entryOf(aspiration, name) ?? NaN
    return isNumber(wish) ? (maximize ? -wish : wish) : frame.ideal[j]
  })
  for (const row of joined(ranking.rows, data.prototypes)) {
    value[row] = -Infinity
    total[row] = 0
    for (let j = 0; j < w.length; j++) {
      const term = w[j] * ((F[j][row] - point[j]) / frame.scale[j])
      if (term > value[row]) value[row] = term
      total[row] += term
    }
  }
  const noise = frame.sizes.map((size, j) =>
    LAST_PLACES * w[j] * max(size, abs(point[j] / frame.scale[j])))
  const nearest = (rows, key, tolerance) => {
    const reach = leastOf(key, rows) + tolerance
    return rows.filter((i) => key[i] <= reach)
  }
  const best = nearest(nearest([...front], value, max(...noise)), total, sum(noise))
  return {value, total, best}
}
