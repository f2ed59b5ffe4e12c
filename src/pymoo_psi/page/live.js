// The connection of a page to the server of a growing study: new designs, progress, steering.
if (data.live) {
  // Other tests, or other columns: load the page anew, in the state that it has when the next one arrives.
  const reload = () => {
    commit() // to the address
    isSaved()
    location.reload()
  }
  const waiting = [] // designs, while a hand drags
  let {count} = data.live
  let since = count

  const source = new EventSource(`events?from=${data.live.from}`)
  source.onopen = () => { $("offline").hidden = true }
  source.onerror = () => { $("offline").hidden = false }
  source.onmessage = (event) => {
    const {rows, lines, steered, tests, is_running} = JSON.parse(event.data)
    if (!rows) return reload()
    waiting.push(...rows)
    count = tests
    $("running").disabled = !is_running
    renew("progress", makeAll("li", lines))
    renew("steered", makeAll("li", steered))
    $("since").textContent = count - since
    $("since").parentElement.hidden = !ranking.count
  }
  setInterval(() => {
    if (!waiting.length || dragging) return
    const before = proposedRow()
    page.grow(waiting.splice(0))
    if (proposedRow() !== before) since = count
  }, 100)

  const name = $("steerer")
  name.value = sessionStorage.steerer ?? ""
  name.oninput = () => { sessionStorage.steerer = name.value }
  $("live").hidden = false
  $("steering").hidden = !data.live.steer
  // A key that is held would send thirty requests a second.
  $("steering").onkeydown = (event) => { if (event.repeat && event.target.name) event.preventDefault() }
  $("steering").onclick = async ({target}) => {
    const action = target.name
    if (!action) return
    const body = {action, name: name.value, count: Number($("more").value), formulation: decisionNow()}
    const answer = await fetch("steer", {method: "POST", body: JSON.stringify(body)})
    say(answer.ok ? [] : [await answer.text()])
  }
}
