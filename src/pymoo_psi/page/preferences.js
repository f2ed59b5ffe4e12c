// Weights and aspirations, a second order of the designs.

const wishes = []
for (const column of data.objectives) {
  const row = copyOf("preference-row")
  row.firstElementChild.append(...broken(column.label))
  row.querySelectorAll("input").forEach((input, k) => {
    const kind = k ? "aspiration" : "weights"
    numberField(input, `${column.label}, ${k ? "aspiration" : "weight"}`, (value) => {
      if (!k && value < 0) return "A weight must be 0 or more."
      const others = without(state.preference[kind], column.name)
      change({preference: {...state.preference, [kind]: value === null ? others : {...others, [column.name]: value}}})
      return ""
    })
    wishes.push({input, kind, column})
  })
  $("preference-table").tBodies[0].append(row)
}
$("by-preference").onclick = () => change({order: {by: state.order.by === "preference" ? "distance" : "preference", down: false}})
$("preferences").ontoggle = soon

function showPreference() {
  for (const {input, kind, column} of wishes) showNumber(input, entryOf(state.preference[kind], column.name) ?? null)
  $("by-preference").ariaPressed = state.order.by === "preference"
  if (!$("preferences").open || !verdict) return renew("preference-words")
  const [first] = preference(data, ranking, state.preference).best
  renew("preference-words", "First by your preferences: ", make("strong", called(first)),
    ranking.place[first] === 1 ? ", also the best compromise. " : ". ", chooseButton(first), " ", pinButton(first))
}
