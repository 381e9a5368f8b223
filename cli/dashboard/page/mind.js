// What competes and becomes conscious, schemes, needs, and why.
import { bar, byId, children, cleared, colour, element, resized } from "/page/dom.js";

const ROW = 18;
const BAR = /^[█▏▎▍▌▋▊▉ ]+$/; // as a terminal draws it; the number beside it says the same
const LABELS = 150;

let competitions = [];

export function showMind(mind) {
  competitions = mind.competitions;
  requestAnimationFrame(drawTimeline);
  children(byId("needs"), mind.needs.map((each) =>
    bar(`need: ${each.name}`, each.level.toFixed(2), { share: each.level, note: each.is_eased ? "eased" : "" })));
  children(byId("schemes"), mind.schemes.slice(0, 8).map((each) =>
    bar(each.name, each.activation.toFixed(2),
      { share: each.activation, note: each.verdict, chosen: each.is_chosen })));
  showWhy(mind);
}

function drawTimeline() {
  const { context, width, height } = cleared(byId("timeline"));
  const codelets = [...new Set(competitions.flatMap((each) => each.contenders.map((c) => c.codelet)))].sort();
  if (!codelets.length) return;
  const labels = Math.min(LABELS, width * 0.35);
  const step = (width - labels) / competitions.length;
  const row = Math.min(ROW * 2, (height - 14) / codelets.length);
  context.font = "12px system-ui, sans-serif";
  context.textBaseline = "middle";

  codelets.forEach((codelet, number) => {
    const y = number * row;
    context.fillStyle = colour("ink");
    context.fillText(codelet, 0, y + row / 2, labels - 6);
    context.fillStyle = colour("fill");
    context.fillRect(labels, y + 1, width - labels, row - 2);
  });
  competitions.forEach((each, at) => {
    for (const contender of each.contenders) {
      const y = codelets.indexOf(contender.codelet) * row;
      const tall = Math.max(1, contender.activation * (row - 3));
      context.fillStyle = contender.fate === "won" ? colour("estimate") : colour("accent");
      context.globalAlpha = contender.fate === "won" || contender.fate === "waiting" ? 1 : 0.4;
      context.fillRect(labels + at * step, y + row - 1 - tall, Math.max(1, step - 1), tall);
    }
  });
  context.globalAlpha = 1;
  context.fillStyle = colour("faint");
  const first = competitions[0].at_s;
  const last = competitions[competitions.length - 1].at_s;
  context.fillText(`${first.toFixed(1)} s`, labels, height - 6);
  context.textAlign = "right";
  context.fillText(`${last.toFixed(1)} s; orange became conscious`, width, height - 6);
  context.textAlign = "left";
  const won = competitions.filter((each) => each.conscious).length;
  byId("timeline").setAttribute("aria-label",
    `Coalitions of ${codelets.length} codelets by their activation, ${first.toFixed(1)} s to ${last.toFixed(1)} s; ${won} became conscious`);
}

function showWhy(mind) {
  const made = [];
  if (mind.explained) made.push(element("p", { class: "note" }, mind.explained));
  for (const stage of mind.stages) {
    made.push(element("h3", {}, [`${stage.title} `, element("span", {}, stage.after)]));
    const rows = stage.rows.map((row) =>
      element("tr", row.is_chosen ? { class: "chosen" } : {},
        row.cells.filter((cell) => !BAR.test(cell)).map((cell) => element("td", {}, cell))));
    made.push(element("table", { role: "presentation" }, [element("tbody", {}, rows)]));
    for (const why of stage.why) made.push(element("p", {}, why));
  }
  const panel = byId("why");
  if (!panel.matches(":hover, :focus")) children(panel, made);
}

resized(byId("timeline"), drawTimeline);
