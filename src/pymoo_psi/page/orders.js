// In which order designs are shown.

// The rows shown, prototypes first, then the best design first; dominated designs come last but
// where they are sorted by a column, or by the label; without a name they are by place.
function ordered(ranking, state) {
  const {sorted: name, down} = state
  const {front, rows, pareto} = ranking
  const turned = (list) => (down ? list.slice().reverse() : list)
  if (name !== null) {
    const values = columnOf(name)?.values ?? (data.alphabetic ??= alphabetic())
    const sorted = argsort(values, state.dominated ? rows : front)
    const isMissing = (i) => Number.isNaN(values[i]) // these are last
    return joined(data.prototypes, turned(picked(sorted, (i) => !isMissing(i))), picked(sorted, isMissing))
  }
  const dominated = state.dominated ? picked(rows, (i) => !pareto[i]) : []
  return joined(data.prototypes, turned(ranking.byPlace), turned(argsort(ranking.mu1, dominated)))
}

// The rows that a search finds by a part of a name or a text, whatever the limits, those shown first.
function searched(text, shown) {
  if (!text) return shown
  const fits = (cell) => cell.toLowerCase().includes(text.toLowerCase())
  return Int32Array.from(unique([rowOf(text), ...shown, ...data.names.keys()]).filter((row) =>
    row >= 0 && (fits(called(row)) || data.textual.some(({texts, values}) => fits(texts[values[row]])))))
}

// The places of the names in the order of a dictionary, in which 9 comes before 10.
function alphabetic() {
  const {names} = data
  const {compare} = new Intl.Collator(undefined, {numeric: true})
  const places = new Float64Array(names.length)
  Array.from(names.keys()).sort((a, b) => compare(names[a], names[b])).forEach((row, k) => { places[row] = k })
  return places
}

// Weights against the greatest one, 1 unless they are given.
function ratiosOf(weights) {
  const given = data.objectives.map(({name}) => entryOf(weights, name) ?? 1)
  return given.map((weight) => weight / (max(...given) || 1))
}

// The designs with the least achievement function, max w (f - r) / range, and of these those with the least
// sum of its terms (selection's ReferencePoint). Without an aspiration an objective is measured from its
// best value; weights are 1 unless given.
function preference(ranking, {weights, aspiration}) {
  const {objectives, F} = data
  if (!ranking.count) return []
  const {frame, front} = ranking
  const ratios = ratiosOf(weights)
  const w = ratios.map((ratio) => max(...ratios) > 0 ? ratio / sum(ratios) : 1 / ratios.length)
  const point = objectives.map(({name, maximize}, j) => {
    const wish = entryOf(aspiration, name) ?? NaN
    return isNumber(wish) ? (maximize ? -wish : wish) : frame.ideal[j]
  })
  const value = new Float64Array(data.n)
  const total = new Float64Array(data.n)
  for (const row of front) {
    const terms = w.map((weight, j) => weight * ((F[j][row] - point[j]) / frame.scale[j]))
    value[row] = max(...terms)
    total[row] = sum(terms)
  }
  const noise = frame.sizes.map((size, j) =>
    LAST_PLACES * w[j] * max(size, abs(point[j] / frame.scale[j])))
  return leastOf(leastOf(front, value, max(...noise)), total, sum(noise))
}
