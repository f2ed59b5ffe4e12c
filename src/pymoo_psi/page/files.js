// Files: decisions, pages and tables that are saved, and decisions that are opened.

const decisionNow = () => decisionOf(state, new Date().toISOString())
const isSaved = () => { saved = JSON.stringify(state) }
const asJson = (text) => new Blob([text], {type: "application/json"})

function saveDecision() {
  const name = `${data.file}-decision.json`
  download(asJson(`${JSON.stringify(decisionNow(), null, 1)}\n`), name, ` Commands read it by --decision ${name}.`)
  isSaved()
}

function exportRows() {
  const name = `${data.file}-shown.csv`
  download(new Blob([csv(order, ranking)], {type: "text/csv"}), name)
  download(asJson(metadata(order, state, name)), `${name}-metadata.json`, ` Keep it beside ${name}.`)
}

// The page as it was made, with the decision in place of what it opened with.
function savePage() {
  const copy = asWritten.cloneNode(true)
  const script = copy.querySelector("#payload")
  const content = {...JSON.parse(script.textContent), opens_with: decisionNow(), made, more: data.more, live: null}
  script.replaceChildren(JSON.stringify(content).replaceAll("<", "\\u003c"))
  download(new Blob([`<!DOCTYPE html>\n${copy.outerHTML}\n`], {type: "text/html"}), `${data.file}.html`)
  isSaved()
}

// The positions of files are added, and nothing else changes unless it is asked for; a single file
// without positions is taken whole.
async function openFiles(files) {
  const reads = await Promise.all(Array.from(files, async (file) => ({name: file.name, ...opened(await file.text())})))
  const remarks = reads.flatMap(({name, remarks}) => remarks.map((text) => `${name}: ${text}`))
  const positions = reads.flatMap(({state}) => state?.positions ?? [])
  const single = reads.length === 1 && reads[0].state
  const merged = (next) => checked({...next, positions: [...state.positions, ...positions]}).state
  const whole = () => take({state: merged(single), remarks})
  if (!positions.length) return single ? whole() : say([...remarks, "No positions are added."])
  change(merged(state))
  say([...remarks, [sentence("added"), single && button("Take those of the file", whole)]])
}

onClicks({save: saveDecision, "save-page": savePage, print: () => print(), export: exportRows, open: () => $("file").click()})
$("file").onchange = async () => {
  await openFiles($("file").files)
  $("file").value = ""
}
$("menu").onclick = ({target}) => { if (target.tagName === "BUTTON") $("menu").open = false }
addEventListener("beforeunload", (event) => { if (JSON.stringify(state) !== saved) event.preventDefault() })
