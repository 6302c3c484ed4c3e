// A canvas over a plane in mm: axes, zoom by wheel or keys, move by drag, and what is drawn at x, y.

export const theme = (name) => getComputedStyle(document.documentElement).getPropertyValue(name);
export const rgba = (name, alpha) => `rgba(${theme(name)}, ${alpha})`;

/** Fits a canvas's pixels to its size on the screen; returns its context in CSS pixels. */
export function prepare(canvas) {
  const ratio = window.devicePixelRatio || 1;
  const { clientWidth, clientHeight } = canvas;
  const width = Math.max(1, Math.round(clientWidth * ratio));
  const height = Math.max(1, Math.round(clientHeight * ratio));
  if (canvas.width !== width || canvas.height !== height) {
    canvas.width = width;
    canvas.height = height;
  }
  const context = canvas.getContext("2d");
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.clearRect(0, 0, clientWidth, clientHeight);
  context.font = '12px system-ui, "DejaVu Sans", sans-serif';
  return context;
}

/** A round step that divides a range into about `count` parts. */
function roundStep(range, count) {
  const power = 10 ** Math.floor(Math.log10(range / count));
  return [1, 2, 5, 10].map((k) => k * power).find((step) => range / step <= count);
}

export class Plane {
  static margin = { left: 46, right: 8, top: 8, bottom: 34 };

  /** @param labels of the axes; none: no axes */
  constructor(canvas, labels, redraw) {
    this.canvas = canvas;
    this.labels = labels;
    this.redraw = redraw;
    this.all = null; // {lower, upper}: what is shown unless somebody looks elsewhere
    this.view = null;
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.zoom(Math.exp(0.0015 * event.deltaY), [event.offsetX, event.offsetY]);
    }, { passive: false });
    let held = null;
    canvas.addEventListener("pointerdown", (event) => {
      held = [event.offsetX, event.offsetY];
      canvas.setPointerCapture(event.pointerId);
    });
    canvas.addEventListener("pointermove", (event) => {
      if (held) {
        const [x, y] = [event.offsetX, event.offsetY];
        this.move((held[0] - x) / this.scale, (y - held[1]) / this.scale);
        held = [x, y];
      }
    });
    canvas.addEventListener("pointerup", () => { held = null; });
    canvas.addEventListener("pointercancel", () => { held = null; });
    canvas.addEventListener("dblclick", () => this.showAll());
    canvas.addEventListener("keydown", (event) => {
      const step = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
      if (event.key === "+" || event.key === "-") {
        this.zoom(event.key === "+" ? 0.8 : 1.25);
      } else if (step[event.key]) {
        const tenth = 0.1 * this.box.side / this.scale;
        this.move(tenth * step[event.key][0], tenth * step[event.key][1]);
      } else {
        return;
      }
      event.preventDefault();
    });
  }

  /** Shows this area from now on, unless somebody looks elsewhere. */
  fit(lower, upper) {
    this.all = { lower, upper };
  }
  showAll() {
    this.view = null;
    this.redraw();
  }
  zoom(factor, pixel) {
    if (!this.all) return;
    const at = pixel ? this.place(pixel) : this.centre;
    const mm = (this.view?.mm ?? 1 / this.scale) * factor;
    const centre = [0, 1].map((i) => at[i] + (this.centre[i] - at[i]) * factor);
    this.view = { centre, mm };
    this.redraw();
  }
  move(x, y) {
    if (!this.all) return;
    this.view = { centre: [this.centre[0] + x, this.centre[1] + y], mm: 1 / this.scale };
    this.redraw();
  }

  begin() {
    const context = prepare(this.canvas);
    this.context = context;
    const margin = this.labels ? Plane.margin : { left: 4, right: 4, top: 4, bottom: 4 };
    const width = Math.max(1, this.canvas.clientWidth - margin.left - margin.right);
    const height = Math.max(1, this.canvas.clientHeight - margin.top - margin.bottom);
    this.box = { left: margin.left, top: margin.top, width, height,
                 side: Math.min(width, height) };
    const { lower, upper } = this.all ?? { lower: [-10, -10], upper: [10, 10] };
    const fitting = Math.min(width / (upper[0] - lower[0]), height / (upper[1] - lower[1]));
    this.scale = this.view ? 1 / this.view.mm : fitting; // pixels per mm
    this.centre = this.view?.centre ?? [0, 1].map((i) => 0.5 * (lower[i] + upper[i]));
    context.save();
    context.beginPath();
    context.rect(margin.left, margin.top, width, height);
    context.fillStyle = theme("--ground");
    context.fill();
    context.clip();
    return context;
  }
  pixel([x, y]) {
    return [this.box.left + this.box.width / 2 + (x - this.centre[0]) * this.scale,
            this.box.top + this.box.height / 2 - (y - this.centre[1]) * this.scale];
  }
  place([u, v]) {
    return [this.centre[0] + (u - this.box.left - this.box.width / 2) / this.scale,
            this.centre[1] - (v - this.box.top - this.box.height / 2) / this.scale];
  }

  /** Traces a closed polygon of places. */
  polygon(places) {
    this.context.beginPath();
    places.forEach((p, i) => this.context[i ? "lineTo" : "moveTo"](...this.pixel(p)));
    this.context.closePath();
  }
  /** Traces the ellipse {p: (p - centre)' covariance^-1 (p - centre) = radius^2}. */
  ellipse(centre, [[xx, xy], [, yy]], radius) {
    const middle = (xx + yy) / 2;
    const spread = Math.hypot((xx - yy) / 2, xy);
    const axes = [middle + spread, Math.max(middle - spread, 0)].map(
      (variance) => Math.max(radius * Math.sqrt(variance) * this.scale, 1));
    const [u, v] = this.pixel(centre);
    this.context.beginPath();
    this.context.ellipse(u, v, ...axes, -0.5 * Math.atan2(2 * xy, xx - yy), 0, 2 * Math.PI);
  }
  /** Draws an image of nx by ny cells, lowest row first, whose corner lies at `lower` of `pose`. */
  cells(image, lower, cell, [x, y, theta] = [0, 0, 0]) {
    const context = this.context;
    context.save();
    context.translate(...this.pixel([x, y]));
    context.rotate(-theta);
    context.scale(this.scale, -this.scale);
    context.imageSmoothingEnabled = false;
    context.drawImage(image, lower[0], lower[1], image.width * cell, image.height * cell);
    context.restore();
  }

  /** Ends the picture with its axes. */
  end() {
    const { context, box } = this;
    context.restore();
    if (!this.labels) return;
    context.strokeStyle = theme("--line");
    context.fillStyle = theme("--soft");
    context.strokeRect(box.left, box.top, box.width, box.height);
    const [lower, upper] = [this.place([box.left, box.top + box.height]),
                            this.place([box.left + box.width, box.top])];
    const step = roundStep(box.side / this.scale, 6);
    const digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
    context.textAlign = "center";
    for (let x = Math.ceil(lower[0] / step) * step; x <= upper[0]; x += step) {
      const [u] = this.pixel([x, 0]);
      context.fillText(x.toFixed(digits), u, box.top + box.height + 14);
      context.fillRect(u, box.top + box.height, 1, 4);
    }
    context.textAlign = "right";
    for (let y = Math.ceil(lower[1] / step) * step; y <= upper[1]; y += step) {
      const [, v] = this.pixel([0, y]);
      context.fillText(y.toFixed(digits), box.left - 6, v + 4);
      context.fillRect(box.left - 4, v, 4, 1);
    }
    context.textAlign = "center";
    context.fillText(this.labels[0], box.left + box.width / 2, box.top + box.height + 29);
    context.save();
    context.translate(11, box.top + box.height / 2);
    context.rotate(-Math.PI / 2);
    context.fillText(this.labels[1], 0, 0);
    context.restore();
  }
}

/** An image of bytes; colour(byte) gives [red, green, blue, alpha]. */
export function imageOf(bytes, nx, ny, colour) {
  const table = Array.from({ length: 256 }, (_, byte) => colour(byte));
  const image = new ImageData(nx, ny);
  bytes.forEach((byte, i) => image.data.set(table[byte], 4 * i));
  const canvas = document.createElement("canvas");
  canvas.width = nx;
  canvas.height = ny;
  canvas.getContext("2d").putImageData(image, 0, 0);
  return canvas;
}

/** A place of the frame that `pose` [x, y, theta] is of, in the frame that it is given in. */
export function placed([x, y, theta], [u, v]) {
  const [c, s] = [Math.cos(theta), Math.sin(theta)];
  return [x + c * u - s * v, y + s * u + c * v];
}
