// The learned map on a canvas: layers, panning, zooming, and goals by a click.
import { byId, cleared, colour, element, resized } from "/page/dom.js";

const LAYERS = [
  ["places", "streets, what stands there, active places", "#009e73", true],
  ["costs", "what driving there costs: dark is dear, grey blocked", "#31688e", false],
  ["truth", "the true town and path", "var(--house)", false],
  ["districts", "districts", "var(--district)", true],
  ["cuts", "links cut", "var(--cut)", false],
  ["path", "path", "var(--estimate)", true],
  ["closures", "loop closures", "var(--closure)", true],
  ["route", "plan", "var(--plan)", true],
  ["objects", "objects and their samples", "var(--object)", true],
  ["goals", "goals", "var(--goal)", true],
];
const MARGIN_M = 6;
const CLICK_PX = 4;

export class MapView {
  // The agent, which moves more often than the rest changes, is on a canvas of its own, `above`.
  constructor(canvas, above, layers, { onGoal, onLayer }) {
    this.canvas = canvas;
    this.above = above;
    this.onGoal = onGoal;
    this.onLayer = onLayer;
    this.takesGoals = false;
    this.map = null;
    this.now = null;
    this.truth = null;
    this.cuts = [];
    this.pictures = {};
    this.shown = {};
    this.view = null; // the middle in metres, and pixels a metre; null fits all
    for (const [name, label, swatch, isOn] of LAYERS) this.addLayer(layers, name, label, swatch, isOn);
    const fit = element("button", { type: "button" }, "Show all");
    fit.onclick = () => { this.view = null; this.draw(); };
    layers.append(fit);
    this.listen();
    resized(canvas, () => this.draw());
    resized(above, () => this.draw());
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.draw());
  }

  addLayer(layers, name, label, swatch, isOn) {
    const box = element("input", { type: "checkbox" });
    box.checked = this.shown[name] = isOn;
    box.onchange = () => {
      this.shown[name] = box.checked;
      this.draw();
      this.onLayer();
    };
    const sample = element("span", { class: "swatch", "aria-hidden": "true" });
    sample.style.background = swatch;
    layers.append(element("label", {}, [box, sample, label]));
  }

  setMap(map) {
    this.map = map;
    const count = map.objects.length;
    byId("map-text").textContent =
      `${count} objects, ${map.closures.length / 4} loop closures, ${map.goals.length} goals. ` +
      (this.takesGoals ? "A click gives a goal; drag and wheel, or the arrows, + and −, move the map." :
        "Drag and wheel, or the arrows, + and −, move the map.");
    this.draw();
  }

  // The picture before stays until the next one can be drawn.
  async setPicture(name, layer) {
    if (!layer.picture) return;
    const image = new Image();
    image.src = layer.picture;
    await image.decode().catch(() => {});
    this.pictures[name] = { ...layer, image };
    this.draw();
  }

  setNow(now) {
    this.now = now;
    if (this.scale) requestAnimationFrame(() => this.drawAbove());
    else this.draw();
  }

  setTruth(truth) { this.truth = truth; this.draw(); }
  setCuts(cuts) { this.cuts = cuts; this.draw(); }

  draw() {
    if (this.isDue) return;
    this.isDue = true;
    requestAnimationFrame(() => { this.isDue = false; this.drawNow(); });
  }

  drawNow() {
    const { context, width, height } = cleared(this.canvas);
    if (!this.map && !this.now) return;
    this.scale = this.view || this.fitted(width, height);
    this.size = [width, height];
    for (const name of ["places", "costs"]) {
      if (this.pictures[name] && this.shown[name]) this.drawPicture(context, this.pictures[name]);
    }
    if (this.truth && this.shown.truth) this.drawTruth(context);
    if (this.map) this.drawMap(context);
    this.drawScale(context, height);
    this.drawAbove();
  }

  drawAbove() {
    const { context } = cleared(this.above);
    if (this.now && this.now.pose) this.drawAgent(context);
  }

  fitted(width, height) {
    const points = [[0, 0]];
    const add = (flat) => { for (let i = 0; i < flat.length; i += 2) points.push([flat[i], flat[i + 1]]); };
    if (this.map) {
      add(this.map.path);
      add(this.map.route);
      for (const each of this.map.objects) points.push(each.at_m);
      for (const each of this.map.goals) points.push(each.at_m);
    }
    if (this.now && this.now.pose) points.push(this.now.pose);
    if (this.truth && this.shown.truth) for (const each of this.truth.buildings) add(each);
    const xs = points.map((each) => each[0]);
    const ys = points.map((each) => each[1]);
    const west = Math.min(...xs) - MARGIN_M, east = Math.max(...xs) + MARGIN_M;
    const south = Math.min(...ys) - MARGIN_M, north = Math.max(...ys) + MARGIN_M;
    return {
      x: (west + east) / 2,
      y: (south + north) / 2,
      pixels: Math.min(width / (east - west), height / (north - south)),
    };
  }

  toScreen(x, y) {
    const [width, height] = this.size;
    return [width / 2 + (x - this.scale.x) * this.scale.pixels, height / 2 - (y - this.scale.y) * this.scale.pixels];
  }

  toMap(px, py) {
    const [width, height] = this.size;
    return [this.scale.x + (px - width / 2) / this.scale.pixels, this.scale.y - (py - height / 2) / this.scale.pixels];
  }

  line(context, flat, { closed = false } = {}) {
    context.beginPath();
    for (let i = 0; i < flat.length; i += 2) context.lineTo(...this.toScreen(flat[i], flat[i + 1]));
    if (closed) context.closePath();
  }

  pairs(context, flat) {
    context.beginPath();
    for (let i = 0; i + 3 < flat.length; i += 4) {
      context.moveTo(...this.toScreen(flat[i], flat[i + 1]));
      context.lineTo(...this.toScreen(flat[i + 2], flat[i + 3]));
    }
    context.stroke();
  }

  drawPicture(context, picture) {
    const { west_m, south_m, width_m, height_m, image } = picture;
    const [left, top] = this.toScreen(west_m, south_m + height_m);
    context.imageSmoothingEnabled = false;
    context.globalAlpha = 0.75;
    context.drawImage(image, left, top, width_m * this.scale.pixels, height_m * this.scale.pixels);
    context.globalAlpha = 1;
  }

  drawTruth(context) {
    for (const each of this.truth.streets) {
      context.strokeStyle = each.is_closed ? colour("bad") : colour("faint");
      context.lineWidth = 1;
      this.line(context, each.line);
      context.stroke();
    }
    context.fillStyle = colour("house");
    for (const each of this.truth.buildings) {
      this.line(context, each, { closed: true });
      context.fill();
    }
    context.strokeStyle = colour("true");
    context.lineWidth = 3;
    this.line(context, this.truth.path);
    context.stroke();
  }

  drawMap(context) {
    const { map, shown } = this;
    context.lineJoin = "round";
    if (shown.districts) {
      context.fillStyle = context.strokeStyle = colour("district");
      for (const each of map.districts) {
        this.line(context, each.hull, { closed: true });
        context.globalAlpha = 0.15;
        context.fill();
        context.globalAlpha = 0.7;
        context.stroke();
        context.globalAlpha = 1;
      }
    }
    if (shown.cuts) {
      context.strokeStyle = colour("cut");
      context.lineWidth = 1;
      this.pairs(context, this.cuts);
    }
    if (shown.path) {
      context.strokeStyle = colour("estimate");
      context.lineWidth = 1.8;
      this.line(context, map.path);
      context.stroke();
    }
    if (shown.closures) {
      context.strokeStyle = colour("closure");
      context.lineWidth = 1;
      this.pairs(context, map.closures);
    }
    if (shown.route) {
      context.strokeStyle = colour("plan");
      context.lineWidth = 3;
      context.setLineDash([8, 5]);
      this.line(context, map.route);
      context.stroke();
      context.setLineDash([]);
    }
    if (shown.objects) for (const each of map.objects) this.drawObject(context, each);
    if (shown.goals) for (const each of map.goals) this.drawGoal(context, each);
  }

  drawObject(context, each) {
    context.fillStyle = context.strokeStyle = colour("object");
    context.globalAlpha = 0.35;
    for (let i = 0; i < each.samples.length; i += 2) {
      const [x, y] = this.toScreen(each.samples[i], each.samples[i + 1]);
      context.fillRect(x - 1, y - 1, 2, 2);
    }
    context.globalAlpha = 1;
    const [x, y] = this.toScreen(...each.at_m);
    context.lineWidth = 1;
    context.beginPath();
    context.ellipse(x, y, each.spread_m[0] * this.scale.pixels, each.spread_m[1] * this.scale.pixels, 0, 0, 2 * Math.PI);
    context.stroke();
    context.beginPath();
    context.arc(x, y, 3.5, 0, 2 * Math.PI);
    context.fill();
    context.fillStyle = colour("ink");
    context.font = "11px system-ui, sans-serif";
    context.textAlign = "left";
    context.fillText(each.name.replaceAll("_", " ") || each.label, x + 6, y - 4);
  }

  drawGoal(context, each) {
    const [x, y] = this.toScreen(...each.at_m);
    context.beginPath();
    for (let i = 0; i < 10; i += 1) {
      const radius = i % 2 ? 4 : 10;
      const angle = (i * Math.PI) / 5 - Math.PI / 2;
      context.lineTo(x + radius * Math.cos(angle), y + radius * Math.sin(angle));
    }
    context.closePath();
    context.fillStyle = colour(each.is_reached ? "goal" : "panel");
    context.fill();
    context.strokeStyle = colour("ink");
    context.lineWidth = 1.5;
    context.stroke();
    context.fillStyle = colour("ink");
    context.fillText(each.name, x + 12, y + 4);
  }

  drawAgent(context) {
    const { pose, samples } = this.now;
    context.fillStyle = colour("estimate");
    context.globalAlpha = 0.3;
    for (let i = 0; i < samples.length; i += 2) {
      const [x, y] = this.toScreen(samples[i], samples[i + 1]);
      context.fillRect(x - 1, y - 1, 2, 2);
    }
    context.globalAlpha = 1;
    const [x, y] = this.toScreen(pose[0], pose[1]);
    context.save();
    context.translate(x, y);
    context.rotate(-pose[2]);
    context.beginPath();
    context.moveTo(11, 0);
    context.lineTo(-7, 6);
    context.lineTo(-4, 0);
    context.lineTo(-7, -6);
    context.closePath();
    context.fill();
    context.strokeStyle = colour("panel");
    context.lineWidth = 1.2;
    context.stroke();
    context.restore();
  }

  drawScale(context, height) {
    const steps = [1, 2, 5, 10, 20, 50, 100, 200, 500, 1000];
    const metres = steps.find((each) => each * this.scale.pixels > 50) || 1000;
    context.strokeStyle = context.fillStyle = colour("ink");
    context.lineWidth = 2;
    context.beginPath();
    context.moveTo(8, height - 8);
    context.lineTo(8 + metres * this.scale.pixels, height - 8);
    context.stroke();
    context.font = "11px system-ui, sans-serif";
    context.fillText(`${metres} m`, 8, height - 14);
  }

  listen() {
    const { canvas } = this;
    let start = null;
    canvas.onpointerdown = (event) => {
      if (!this.scale) return;
      canvas.setPointerCapture(event.pointerId);
      start = { px: event.offsetX, py: event.offsetY, x: this.scale.x, y: this.scale.y, moved: false };
    };
    canvas.onpointermove = (event) => {
      if (!start) return;
      const [dx, dy] = [event.offsetX - start.px, event.offsetY - start.py];
      start.moved = start.moved || Math.hypot(dx, dy) > CLICK_PX;
      if (!start.moved) return;
      const { pixels } = this.scale;
      this.view = { x: start.x - dx / pixels, y: start.y + dy / pixels, pixels };
      this.draw();
    };
    canvas.onpointerup = (event) => {
      if (start && !start.moved && this.takesGoals) {
        const [x, y] = this.toMap(event.offsetX, event.offsetY);
        this.onGoal(Math.round(10 * x) / 10, Math.round(10 * y) / 10);
      }
      start = null;
    };
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.zoom(Math.exp(-event.deltaY / 500), event.offsetX, event.offsetY);
    }, { passive: false });
    canvas.onkeydown = (event) => {
      if (!this.scale) return;
      const step = 60 / this.scale.pixels;
      const moves = { ArrowLeft: [-step, 0], ArrowRight: [step, 0], ArrowUp: [0, step], ArrowDown: [0, -step] };
      const [width, height] = this.size;
      if (moves[event.key]) {
        const [dx, dy] = moves[event.key];
        this.view = { ...this.scale, x: this.scale.x + dx, y: this.scale.y + dy };
        this.draw();
      } else if (event.key === "+" || event.key === "=") this.zoom(1.25, width / 2, height / 2);
      else if (event.key === "-") this.zoom(0.8, width / 2, height / 2);
      else return;
      event.preventDefault();
    };
  }

  zoom(factor, px, py) {
    if (!this.scale) return;
    const [x, y] = this.toMap(px, py);
    const pixels = Math.min(400, Math.max(0.2, this.scale.pixels * factor));
    const [width, height] = this.size;
    this.view = { x: x - (px - width / 2) / pixels, y: y + (py - height / 2) / pixels, pixels };
    this.draw();
  }
}
