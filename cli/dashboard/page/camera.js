// The camera image with what was recognized in it, and depth.
import { byId, children, element, svg } from "/page/dom.js";

let newest = null;
let isLoading = false;

export function showCamera(camera) {
  showSeen(camera);
  if (camera.frame < 0) return;
  newest = camera;
  byId("camera-text").textContent =
    `frame ${camera.frame}, ${camera.at_s.toFixed(1)} s; recognized in frame ${camera.percepts_frame}`;
  load();
}

export function showDepth(depth) {
  if (depth.picture) put(byId("depth"), depth.picture);
}

// One image at a time: a slow browser leaves frames out.
async function load() {
  if (isLoading) return;
  isLoading = true;
  while (newest !== null) {
    const { frame, picture } = newest;
    newest = null;
    await put(byId("view"), picture);
    document.documentElement.dataset.frame = frame;
    document.documentElement.dataset.shownMs = Date.now();
  }
  isLoading = false;
}

async function put(image, picture) {
  image.src = picture;
  image.hidden = false;
  await image.decode().catch(() => {}); // a picture that cannot be shown is left out
}

function showSeen(camera) {
  const overlay = byId("overlay");
  overlay.setAttribute("viewBox", `0 0 ${camera.width_px || 1} ${camera.height_px || 1}`);
  const drawn = [];
  for (const each of camera.seen) {
    const points = [];
    for (let i = 0; i < each.outline.length; i += 2) points.push(`${each.outline[i]},${each.outline[i + 1]}`);
    const left = Math.max(2, Math.min(...each.outline.filter((_, i) => i % 2 === 0)));
    const top = Math.max(10, Math.min(...each.outline.filter((_, i) => i % 2 === 1)));
    drawn.push(svg("polygon", { points: points.join(" ") }));
    drawn.push(svg("text", { x: left, y: top - 2 }, `${each.name} ${each.activation.toFixed(2)}`));
  }
  children(overlay, camera.width_px ? drawn : []);
  children(byId("seen"), camera.seen.map((each) => {
    const others = each.names.map(([name, share]) => `${name} ${share.toFixed(2)}`).join(", ");
    const where = `${each.range_m.toFixed(1)} m, ${each.bearing_deg.toFixed(0)}°`;
    const which = each.label ? ` is ${each.label}` : "";
    return element("li", { title: others }, `${each.name} ${each.activation.toFixed(2)}${which}, ${where}`);
  }));
}
