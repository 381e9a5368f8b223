// Asks the server for what is new, and hands each part to its panels.
import { MapView } from "/page/map.js";
import { showCamera, showDepth } from "/page/camera.js";
import { showMind } from "/page/mind.js";
import { showSystem, showTopics, showMessage } from "/page/system.js";
import { byId, children, element } from "/page/dom.js";

const RETRY_MS = 1000;
const KEYS = "uiojklm,. "; // as those of `cogmap teleop`
const ARROWS = { ArrowUp: "i", ArrowLeft: "j", ArrowRight: "l", ArrowDown: "," };
const REPEAT_MS = 150; // of a key that is held
const ASKED_FOR = ["costs", "cuts", "truth"]; // layers that are sent only while they are shown
// A page rests longer than it draws, so that a slow machine is left to what it shows.
const RESTS = 9;
const LONGEST_REST_MS = 400;
const map = new MapView(byId("map"), byId("above"), byId("layers"), {
  onGoal: (x, y) => wish({ place: [x, y] }),
  onLayer: () => ask(),
});
const have = {};
let playing = null;
let isSliding = false;
let isLive = false;
let isDriving = false;
let pressedMs = 0;
let restMs = 0; // what the server asks for
let now = null;
let ask = () => {};

function connect() {
  const socket = new WebSocket(`ws://${location.host}/news`);
  socket.binaryType = "arraybuffer";
  let rest = null;
  ask = () => {
    if (rest === null) return;
    clearTimeout(rest);
    rest = null;
    const also = ASKED_FOR.filter((name) => map.shown[name]);
    socket.send(JSON.stringify({ have, also, topic: byId("topic").value }));
  };
  const askAfter = (ms) => { rest = setTimeout(() => ask(), ms); };
  socket.onopen = () => askAfter(0);
  socket.onmessage = (event) => {
    const began = performance.now();
    show(JSON.parse(new TextDecoder().decode(event.data)));
    const showing = performance.now() - began;
    if (document.hidden) askAfter(RETRY_MS);
    else drawn((drawing) =>
      askAfter(Math.max(restMs, Math.min(RESTS * (showing + drawing), LONGEST_REST_MS))));
  };
  socket.onclose = () => {
    clearTimeout(rest);
    setStatus("the dashboard has ended", "bad");
    for (const name of Object.keys(have)) delete have[name];
    setTimeout(connect, RETRY_MS);
  };
}

// Calls `then` once the page has been drawn, with the milliseconds that this took.
function drawn(then) {
  requestAnimationFrame(() => {
    const began = performance.now();
    setTimeout(() => then(performance.now() - began));
  });
}

function show(news) {
  byId("label").textContent = news.label;
  restMs = news.rest_ms;
  isLive = news.playing === null;
  byId("player").hidden = isLive;
  byId("person").hidden = byId("workers").hidden = !isLive;
  map.takesGoals = isLive;
  if (!isLive) showPlaying(news.playing);
  for (const [name, part] of Object.entries(news.parts)) {
    have[name] = part.version;
    const shown = panels[name];
    if (shown) shown(part.content);
  }
  if (news.message) showMessage(news.message);
  showStatus(news.is_there);
}

const panels = {
  now: showNow,
  map: (content) => { map.setMap(content); showNames(content.objects); },
  places: (content) => map.setPicture("places", content),
  costs: (content) => map.setPicture("costs", content),
  camera: showCamera,
  depth: showDepth,
  mind: showMind,
  system: (content) => showSystem(content, isLive ? (kill) => wish({ kill }) : null),
  topics: showTopics,
  cuts: (content) => map.setCuts(content.links),
  streets: (content) => showStreets(content.names),
  truth: (content) => map.setTruth(content),
};

function showNow(content) {
  now = content;
  map.setNow(now);
  byId("pause").textContent = now.is_paused ? "Go on" : "Pause";
  byId("pause").setAttribute("aria-pressed", now.is_paused);
  const facts = [["time", `${now.at_s.toFixed(1)} s`], ["cycle", now.cycle]];
  if (now.pose) {
    const [x, y, heading] = now.pose;
    const degrees = Math.round(heading * 180 / Math.PI);
    facts.push(["at", `${x.toFixed(1)}, ${y.toFixed(1)} ± ${now.pose_sd_m.toFixed(2)} m, ${degrees}°`]);
  }
  facts.push(["speed", `${now.speed_m_s.toFixed(2)} m/s`]);
  if (now.energy !== null) {
    facts.push(["battery", `${Math.round(100 * now.energy)} %${now.is_charging ? ", charging" : ""}`]);
  }
  if (now.action) facts.push(["does", now.action]);
  if (now.plan) facts.push(["plan", now.plan]);
  children(byId("facts"), facts.map(([name, value]) =>
    element("div", {}, [element("dt", {}, name), element("dd", {}, String(value))])));
  byId("conscious").textContent = now.conscious ? `Conscious last: ${now.conscious}` : "";
}

function showStatus(isThere) {
  if (!isThere) setStatus("no system runs here", "bad");
  else if (!now || !now.cycle) setStatus("no agent yet", "");
  else if (now.is_paused) setStatus("paused", "");
  else if (now.halted_by) setStatus(`stands: ${now.halted_by}`, now.halted_by === "at goal" ? "good" : "bad");
  else if (now.slowed_by) setStatus(`slowed: ${now.slowed_by}`, "");
  else setStatus("drives", "good");
}

function setStatus(text, kind) {
  const status = byId("status");
  if (status.textContent !== text) status.textContent = text;
  status.className = `pill ${kind}`;
}

function showPlaying(now) {
  playing = now;
  const slider = byId("time");
  slider.max = now.duration_s;
  if (!isSliding) slider.value = now.at_s;
  const indexed = now.indexed_s < now.duration_s ? `, ${Math.round(100 * now.indexed_s / now.duration_s)} % read` : "";
  byId("clock").textContent = `${now.at_s.toFixed(1)} of ${now.duration_s.toFixed(1)} s${indexed}`;
  if (now.failure) say(now.failure, false);
  byId("play").textContent = now.is_playing ? "Pause" : "Play";
  byId("play").setAttribute("aria-pressed", now.is_playing);
}

function showNames(objects) {
  const names = [...new Set(objects.map((each) => each.name || each.label))].sort();
  children(byId("names"), names.map((value) => element("option", { value })));
}

// A list that is the same stays, with what is chosen of it.
function showStreets(names) {
  const select = byId("street");
  const shown = [...select.options].map((each) => each.value);
  if (shown.join() === names.join()) return;
  children(select, names.map((name) => element("option", {}, name)));
}

async function wish(wanted) {
  const response = await fetch("/wish", {
    method: "POST",
    headers: { "Content-Type": "application/json" },
    body: JSON.stringify(wanted),
  });
  say(await response.text(), response.ok);
  ask();
  return response.ok;
}

// Keys drive the robot until they are given back; those that are typed into a field do not.
function drive(drives) {
  showDriving(drives);
  press(drives ? "k" : "q");
}

function showDriving(drives) {
  isDriving = drives;
  byId("drive").setAttribute("aria-pressed", drives);
}

async function press(key) {
  pressedMs = performance.now();
  if (!(await wish({ key }))) showDriving(false);
}

addEventListener("keydown", (event) => {
  const key = ARROWS[event.key] || event.key;
  if (!isDriving || event.target.matches("input, select") || !KEYS.includes(key)) return;
  event.preventDefault();
  event.stopPropagation();
  if (!event.repeat || performance.now() - pressedMs > REPEAT_MS) press(key);
}, true);

function say(sentence, isDone) {
  const answer = byId("answer");
  if (answer.textContent !== sentence) answer.textContent = sentence;
  answer.className = isDone ? "" : "bad";
}

byId("person").addEventListener("submit", (event) => {
  event.preventDefault();
  const text = byId("goal").value.trim();
  const place = text.split(/[\s,]+/).map(Number);
  if (!text) return;
  wish(place.length === 2 && place.every(Number.isFinite) ? { place } : { goal: text });
});
byId("pause").onclick = () => wish({ play: now !== null && now.is_paused });
byId("next").onclick = () => wish({ step: true });
byId("reset").onclick = () => wish({ resets: true });
byId("clear").onclick = () => wish({ clear: true });
byId("close").onclick = () => wish({ street: byId("street").value, closed: true });
byId("open").onclick = () => wish({ street: byId("street").value, closed: false });
byId("add").onclick = () => wish({ adds_worker: true });
byId("drive").onclick = () => drive(!isDriving);
byId("play").onclick = () => wish({ play: !playing.is_playing });
byId("step").onclick = () => wish({ step: true });
byId("speed").onchange = (event) => wish({ speed: Number(event.target.value) });
byId("time").oninput = (event) => { isSliding = true; wish({ seek_s: Number(event.target.value) }); };
byId("time").onchange = () => { isSliding = false; };
byId("player").addEventListener("submit", (event) => event.preventDefault());

connect();
