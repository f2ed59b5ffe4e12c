// Weights and aspirations, a second order of the designs.

const wishes = []
function buildPreferences() {
  const rows = data.objectives.map((column) => {
    const inputs = [["weights", "1", "weight"], ["aspiration", "its best", "aspiration"]].map(([kind, placeholder, word]) => {
      const input = numberField(`${column.label}, ${word}`, placeholder, (value) => {
        if (kind === "weights" && value < 0) return "A weight must be 0 or more."
        const others = without(state.preference[kind], column.name)
        change({preference: {...state.preference, [kind]: value === null ? others : {...others, [column.name]: value}}})
        return ""
      })
      wishes.push({input, kind, column})
      return make("td", input)
    })
    return make("tr", head("row", broken(column.label)), inputs)
  })
  $("preference-table").append(make("tbody", rows))
  $("by-preference").onclick = () => change({order: {by: state.order.by === "preference" ? "distance" : "preference", down: false}})
  $("preferences").ontoggle = soon
  following.push(showPreference)
}

function showPreference() {
  for (const {input, kind, column} of wishes) {
    showNumber(input, entryOf(state.preference[kind], column.name) ?? null, false)
  }
  $("by-preference").ariaPressed = state.order.by === "preference"
  if (!$("preferences").open || !verdict) return renew("preference-words")
  const [first] = preference(data, ranking, state.preference).best
  renew("preference-words", "First by your preferences: ", make("strong", called(first)),
    ranking.place[first] === 1 ? ", also the best compromise. " : ". ", chooseButton(first), " ", pinButton(first))
}
