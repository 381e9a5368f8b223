// Latency by stage, the health of the processes, and messages.
import { bar, byId, children, element } from "/page/dom.js";

// `kill` is called with the name of a worker; null where none can be killed.
export function showSystem(system, kill) {
  const longest = Math.max(1, ...system.stages.map((each) => each.compute_ms + each.rest_ms));
  const rows = system.stages.map((each) =>
    bar(each.module, `${(each.compute_ms + each.rest_ms).toFixed(0)} ms`, {
      share: each.compute_ms / longest,
      rest: each.rest_ms / longest,
    }));
  const text = system.stages.length
    ? `From sensing to command ${system.cycle_p50_ms.toFixed(0)} ms in the median, ` +
      `${system.cycle_max_ms.toFixed(0)} ms at most, of the last 50; blue computes, grey waits and travels.`
    : "No command yet.";
  children(byId("latency"), [element("p", { class: "note" }, text), ...rows]);

  children(byId("processes").tBodies[0], system.processes.map((each) => {
    const cells = [
      each.instance, `${Math.round(100 * each.busy)} %`, each.compute_p50_ms.toFixed(1),
      each.memory_mb.toFixed(0), each.queued, each.lost, each.rejected,
      each.is_silent ? "silent" : each.notes.join("; "),
    ];
    const isBad = each.is_silent || each.lost > 0 || each.rejected > 0;
    const row = element("tr", isBad ? { class: "bad" } : {}, cells.map((cell) => element("td", {}, String(cell))));
    if (each.is_worker && kill) {
      const button = element("button", { type: "button" }, `Kill ${each.instance}`);
      button.onclick = () => kill(each.instance);
      row.append(element("td", {}, button));
    }
    return row;
  }));
}

export function showTopics(found) {
  const select = byId("topic");
  const chosen = select.value;
  if (select.matches(":focus") && select.options.length > found.topics.length) return;
  const options = found.topics.map((each) =>
    element("option", { value: each.name }, `${each.name} (${each.type}, ${each.count})`));
  children(select, [element("option", { value: "" }, "none"), ...options]);
  select.value = chosen;
}

export function showMessage(message) {
  const panel = byId("message");
  if (!panel.matches(":hover, :focus")) panel.textContent = message.text;
}
