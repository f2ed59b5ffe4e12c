// Weights and aspirations, and the design that they choose.

const wishes = []
for (const column of data.objectives) {
  const row = copyOf("preference-row")
  row.firstElementChild.append(column.label)
  row.querySelectorAll("input").forEach((input, k) => {
    const kind = k ? "aspiration" : "weights"
    numberField(input, `${column.label}, ${k ? "aspiration" : "weight"}`, (value) => {
      if (!k && value < 0) return "A weight must be 0 or more."
      setEntry(kind, column, value)
      return ""
    })
    wishes.push({input, kind, column})
  })
  $("preference-table").tBodies[0].append(row)
}
$("preferences").ontoggle = soon

function showPreference() {
  for (const {input, kind, column} of wishes) showNumber(input, entryOf(state[kind], column.name) ?? null)
  if (!$("preferences").open || !verdict) return renew("preference-words")
  const [first] = preference(ranking, state)
  renew("preference-words", "First by your preferences: ", make("strong", called(first)),
    ranking.place[first] === 1 ? ", also the best compromise. " : ". ", chooseButton(first), " ", pinButton(first))
}
